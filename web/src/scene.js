/** The robot and its floor, drawn by three.js. z points up, as in MuJoCo. */
import {
  AmbientLight, ArrowHelper, CanvasTexture, Color, DirectionalLight, Fog, Group, HemisphereLight, Mesh,
  MeshStandardMaterial, PCFShadowMap, Plane, PlaneGeometry, Raycaster, RepeatWrapping, Scene, SRGBColorSpace, Vector2,
  Vector3, WebGLRenderer,
} from "three";
import { FollowingCamera } from "./camera.js";
import { meshOf } from "./robot_meshes.js";

const SKY = new Color(0xdfe7ee);
const FLOOR_M = 80, TILE_M = 1;

export class View {
  /**
   * @param canvas that is drawn on.
   * @param calm whether the visitor asked for little motion.
   */
  constructor(canvas, calm) {
    this.renderer = makeRenderer(canvas);
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.scene = new Scene();
    this.scene.background = SKY;
    this.scene.fog = new Fog(SKY, 6, 26);
    this.camera = new FollowingCamera(canvas, calm);
    this.#light();
    this.#floor();
    this.string = new ArrowHelper(new Vector3(1, 0, 0), new Vector3(), 1, 0xd9480f, 0.08, 0.05);
    this.string.visible = false;
    this.scene.add(this.string);
    this.raycaster = new Raycaster();
  }

  /** Take the robot's shapes. */
  build({ bodies, trunk, shapes }) {
    this.trunk = trunk;
    this.bodies = Array.from({ length: bodies }, () => new Group());
    this.robot = new Group();
    this.robot.add(...this.bodies);
    this.scene.add(this.robot);
    for (const shape of shapes) this.bodies[shape.body].add(meshOf(shape));
  }

  /**
   * Put the bodies where a pose has them, and let camera and lamp follow.
   *
   * @param elapsedS since the last picture [s]; Infinity lets the camera jump.
   */
  place(pose, elapsedS) {
    for (const [body, group] of this.bodies.entries()) {
      const [x, y, z, qw, qx, qy, qz] = pose.subarray(7 * body, 7 * body + 7);
      group.position.set(x, y, z);
      group.quaternion.set(qx, qy, qz, qw);
    }
    const { position, quaternion } = this.bodies[this.trunk], { x, y } = position;
    this.camera.follow(position, yawOf(quaternion), elapsedS);
    this.sun.position.set(x + 1.2, y - 1.4, 4);
    this.sun.target.position.set(x, y, 0);
    this.floor.position.set(TILE_M * 2 * Math.round(x / (2 * TILE_M)), TILE_M * 2 * Math.round(y / (2 * TILE_M)), 0);
  }

  /** Fit the picture into a size [pixels]. */
  resize(width, height, pixelRatio) {
    this.renderer.setPixelRatio(Math.min(pixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.fit(width / height);
  }

  draw() {
    this.camera.controls.update();
    this.renderer.render(this.scene, this.camera.lens);
  }

  /** The point of the trunk's frame that a pointer at (x, y) in [-1, 1] hits, or null. */
  grab(x, y) {
    if (!this.robot) return null;
    this.raycaster.setFromCamera(new Vector2(x, y), this.camera.lens);
    const hit = this.raycaster.intersectObject(this.robot, true)[0];
    return hit ? this.bodies[this.trunk].worldToLocal(hit.point.clone()) : null;
  }

  /** Where a pointer is in the plane through a point of the trunk that faces the camera, world frame. */
  pointAt(x, y, grabbed) {
    const through = this.bodies[this.trunk].localToWorld(grabbed.clone());
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.camera.lens.getWorldDirection(new Vector3()), through);
    this.raycaster.setFromCamera(new Vector2(x, y), this.camera.lens);
    return this.raycaster.ray.intersectPlane(plane, new Vector3()) ?? through;
  }

  /** Show what the robot is pulled by; null for nothing. */
  showString(pulled) {
    this.string.visible = pulled !== null;
    if (pulled === null) return;
    const from = this.bodies[this.trunk].localToWorld(new Vector3(...pulled.point));
    const along = new Vector3(...pulled.target).sub(from), length = Math.max(along.length(), 0.01);
    this.string.position.copy(from);
    this.string.setDirection(along.normalize());
    this.string.setLength(length, Math.min(0.08, length / 2), 0.05);
  }

  #light() {
    this.scene.add(new HemisphereLight(0xf4f8ff, 0x9aa3ab, 1.5), new AmbientLight(0xffffff, 0.35));
    this.sun = new DirectionalLight(0xfff4e2, 2.4);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    Object.assign(this.sun.shadow.camera, { left: -1, right: 1, top: 1, bottom: -1, near: 1, far: 8 });
    this.sun.shadow.bias = -0.0005;
    this.sun.shadow.radius = 4;
    this.scene.add(this.sun, this.sun.target);
  }

  #floor() {
    const texture = new CanvasTexture(checker());
    texture.colorSpace = SRGBColorSpace;
    texture.wrapS = texture.wrapT = RepeatWrapping;
    texture.repeat.setScalar(FLOOR_M / (2 * TILE_M));
    texture.anisotropy = 8;
    this.floor = new Mesh(new PlaneGeometry(FLOOR_M, FLOOR_M), new MeshStandardMaterial({ map: texture, roughness: 0.95 }));
    this.floor.receiveShadow = true;
    this.scene.add(this.floor);
  }
}

/** What draws on a canvas. @throws a sentence for the visitor if nothing can. */
function makeRenderer(canvas) {
  try {
    return new WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
  } catch (error) {
    const what = "This page draws with WebGL 2, which this browser does not have or has switched off.";
    throw new Error(`${what} Switch on hardware acceleration in its settings, or try another browser.`, { cause: error });
  }
}

/** A picture of two by two tiles with half-meter lines. */
function checker() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 256;
  const context = canvas.getContext("2d");
  for (const [x, y] of [[0, 0], [0, 1], [1, 0], [1, 1]]) {
    context.fillStyle = (x + y) % 2 ? "#aab4bd" : "#b6c0c9";
    context.fillRect(128 * x, 128 * y, 128, 128);
  }
  context.strokeStyle = "#c9d2d9";
  context.lineWidth = 2;
  for (let i = 0; i <= 256; i += 64) {
    context.strokeRect(i, -4, 64, 264);
    context.strokeRect(-4, i, 264, 64);
  }
  return canvas;
}

/** Heading [rad] of an attitude. */
function yawOf({ x, y, z, w }) {
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}
