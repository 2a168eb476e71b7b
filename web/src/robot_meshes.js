/** Meshes of the robot's shapes, as MuJoCo has them. */
import {
  BoxGeometry, CapsuleGeometry, Color, CylinderGeometry, Mesh, MeshStandardMaterial, Quaternion, SphereGeometry,
  SRGBColorSpace, Vector3,
} from "three";

/** The mesh of a shape of `poses.robotGeometry`. */
export function meshOf({ shape, size, position, quaternion, color, shininess, emission }) {
  const mesh = new Mesh(
    geometryOf(shape, size),
    new MeshStandardMaterial({
      color: new Color().setRGB(color[0], color[1], color[2], SRGBColorSpace),
      roughness: 1 - 0.6 * shininess,
      metalness: 0.15,
      emissive: new Color().setRGB(color[0], color[1], color[2], SRGBColorSpace),
      emissiveIntensity: emission,
    }),
  );
  const [w, x, y, z] = quaternion;
  mesh.position.set(...position);
  // three.js has its cylinders along y, MuJoCo along z
  const turn = shape === "cylinder" || shape === "capsule" ? new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), Math.PI / 2) : new Quaternion();
  mesh.quaternion.set(x, y, z, w).multiply(turn);
  if (shape === "ellipsoid") mesh.scale.set(...size);
  mesh.castShadow = mesh.receiveShadow = true;
  return mesh;
}

/** Geometry of a MuJoCo shape, whose sizes are radii and half lengths. */
function geometryOf(shape, [a, b, c]) {
  if (shape === "sphere") return new SphereGeometry(a, 20, 14);
  if (shape === "ellipsoid") return new SphereGeometry(1, 24, 16);
  if (shape === "capsule") return new CapsuleGeometry(a, 2 * b, 6, 16);
  if (shape === "cylinder") return new CylinderGeometry(a, a, 2 * b, 28);
  return new BoxGeometry(2 * a, 2 * b, 2 * c);
}
