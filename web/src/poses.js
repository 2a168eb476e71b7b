/** What the page draws: the robot's shapes once, then where its bodies are, several times per control period. */

const EVERY = 5; // physics steps between two poses

/** Shapes of the robot as plain values: what is seen, not what collides. */
export function robotGeometry(mj, { model }) {
  const visual = 2, shapes = [];
  const names = Object.fromEntries(
    ["SPHERE", "CAPSULE", "ELLIPSOID", "CYLINDER", "BOX"].map((name) => [mj.mjtGeom[`mjGEOM_${name}`].value, name.toLowerCase()]),
  );
  for (let i = 0; i < model.ngeom; i++) {
    if (model.geom_group[i] !== visual || !(model.geom_type[i] in names)) continue;
    const material = model.geom_matid[i];
    shapes.push({
      body: model.geom_bodyid[i],
      shape: names[model.geom_type[i]],
      size: Array.from(model.geom_size.subarray(3 * i, 3 * i + 3)),
      position: Array.from(model.geom_pos.subarray(3 * i, 3 * i + 3)),
      quaternion: Array.from(model.geom_quat.subarray(4 * i, 4 * i + 4)),
      color: Array.from(material < 0 ? model.geom_rgba.subarray(4 * i, 4 * i + 4) : model.mat_rgba.subarray(4 * material, 4 * material + 4)),
      shininess: material < 0 ? 0.5 : model.mat_shininess[material],
      emission: material < 0 ? 0 : model.mat_emission[material],
    });
  }
  return { bodies: model.nbody, trunk: mj.mj_name2id(model, mj.mjtObj.mjOBJ_BODY.value, "trunk"), shapes };
}

/** Positions and attitudes of all bodies, collected during a control period. */
export class Poses {
  constructor(simulation) {
    this.simulation = simulation;
    this.frames = [];
  }

  /** Look before a physics step: MuJoCo then has the bodies of one step ago. */
  watch(number) {
    if (number > 1 && (number - 1) % EVERY === 0) this.frames.push([number - 1, this.#pose()]);
  }

  /** The poses of a control period that ends now, with their times [s]. */
  take(timeS) {
    const { physics_hz: physicsHz, control_hz: controlHz } = this.simulation.constants;
    const beganS = timeS - 1 / controlHz;
    const frames = this.frames.map(([steps, pose]) => ({ timeS: beganS + steps / physicsHz, pose }));
    this.frames = [];
    return [...frames, { timeS, pose: this.#pose() }];
  }

  /** Seven numbers per body: position [m], quaternion (w, x, y, z). */
  #pose() {
    const { xpos, xquat } = this.simulation.data, bodies = xpos.length / 3, pose = new Float32Array(7 * bodies);
    for (let body = 0; body < bodies; body++) {
      pose.set(xpos.subarray(3 * body, 3 * body + 3), 7 * body);
      pose.set(xquat.subarray(4 * body, 4 * body + 4), 7 * body + 3);
    }
    return pose;
  }
}
