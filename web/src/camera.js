/** Where the visitor looks from: a camera that follows the robot, and that mouse and fingers move. */
import { MOUSE, PerspectiveCamera, TOUCH, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

/** Behind the robot and turning with it; beside it, not turning; where it was put. */
const MODES = ["chase", "follow", "free"];
const FOLLOW_S = 0.12; // time constant of its way after the robot, so that steps do not shake it
const AIM_HEIGHT = 0.22; // of the point that is looked at [m]
const UP = new Vector3(0, 0, 1);

export class FollowingCamera {
  /**
   * @param canvas that pointers move it on.
   * @param calm whether the visitor asked for little motion: then it neither turns by itself nor glides.
   */
  constructor(canvas, calm) {
    this.mode = calm ? "follow" : "chase";
    this.yaw = 0;
    this.lens = new PerspectiveCamera(38, 1, 0.05, 100);
    this.lens.up.copy(UP);
    this.lens.position.set(-1.65, -1.4, 1.0);
    this.controls = new OrbitControls(this.lens, canvas);
    Object.assign(this.controls, { enableDamping: !calm, minDistance: 0.6, maxDistance: 8, maxPolarAngle: 1.52 });
    this.controls.mouseButtons = { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
    this.controls.touches = { ONE: TOUCH.ROTATE, TWO: TOUCH.DOLLY_ROTATE };
    this.controls.target.set(0, 0, AIM_HEIGHT);
    canvas.addEventListener("pointermove", ({ buttons }) => buttons === 2 && (this.mode = "free")); // panning ends the following
  }

  /** Where it looks, from the world's x axis to the left [rad]. */
  get direction() {
    const { x, y } = this.controls.target.clone().sub(this.lens.position);
    return Math.atan2(y, x);
  }

  /** Change to the mode after the present one. */
  changeMode() {
    this.mode = MODES[(MODES.indexOf(this.mode) + 1) % MODES.length];
  }

  /**
   * Go along with the robot.
   *
   * @param position of the trunk [m], with `x` and `y`.
   * @param yaw of the trunk [rad].
   * @param elapsedS since the last picture [s]; Infinity lets it jump.
   */
  follow({ x, y }, yaw, elapsedS) {
    const share = 1 - Math.exp(-elapsedS / FOLLOW_S), { target } = this.controls, { position } = this.lens;
    const turn = share * Math.atan2(Math.sin(yaw - this.yaw), Math.cos(yaw - this.yaw));
    this.yaw += turn;
    if (this.mode === "free") return;
    const step = new Vector3(x, y, AIM_HEIGHT).sub(target).multiplyScalar(share);
    target.add(step);
    position.add(step);
    if (this.mode === "chase") position.sub(target).applyAxisAngle(UP, turn).add(target);
  }

  /** Fit it to a picture of this width over height. */
  fit(aspect) {
    this.lens.aspect = aspect;
    this.lens.fov = aspect < 1 ? 52 : 38;
    this.lens.updateProjectionMatrix();
  }
}
