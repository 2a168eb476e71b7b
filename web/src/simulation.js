/** The robot in MuJoCo's WebAssembly build: `go1_mtl_gym.sim.simulation`. */

const LARGEST = 1e10; // mjMAXVAL, of values that MuJoCo does not call bad

/** Start of a sensor's readings, a joint's position, and the like, by name. */
function indices(mj, model, robot) {
  const id = (kind, name) => mj.mj_name2id(model, kind.value, name);
  const sensor = (name) => model.sensor_adr[id(mj.mjtObj.mjOBJ_SENSOR, name)];
  const joints = robot.joints.map((name) => id(mj.mjtObj.mjOBJ_JOINT, name));
  return {
    trunk: id(mj.mjtObj.mjOBJ_BODY, "trunk"),
    q: joints.map((joint) => model.jnt_qposadr[joint]),
    v: joints.map((joint) => model.jnt_dofadr[joint]),
    feet: robot.legs.map((leg) => id(mj.mjtObj.mjOBJ_GEOM, `${leg}_foot`)),
    touch: robot.legs.map((leg) => sensor(`${leg}_touch`)),
    accelerometer: sensor("accelerometer"),
    gyroscope: sensor("gyroscope"),
  };
}

export class Simulation {
  /**
   * @param mj the loaded module.
   * @param files text of "scene.xml" and "go1.xml".
   * @param constants of the page.
   */
  constructor(mj, files, constants) {
    this.mj = mj;
    this.constants = constants;
    const vfs = new mj.MjVFS();
    vfs.addBuffer("go1.xml", new TextEncoder().encode(files["go1.xml"]));
    this.model = mj.MjModel.from_xml_string(files["scene.xml"], vfs);
    vfs.delete();
    this.data = new mj.MjData(this.model);
    this.model.opt.timestep = 1 / constants.physics_hz;
    const { kp, kd } = constants.actuators;
    const gain = this.model.actuator_gainprm, bias = this.model.actuator_biasprm;
    const width = gain.length / constants.robot.joints.length;
    for (let i = 0; i < constants.robot.joints.length; i++) {
      gain[i * width] = kp;
      bias[i * width + 1] = -kp;
      bias[i * width + 2] = -kd;
    }
    this.index = indices(mj, this.model, constants.robot);
  }

  /** Stand still at the world's origin in a joint position, the lowest foot touching the ground. */
  reset(q) {
    const { mj, model, data, index } = this;
    mj.mj_resetData(model, data);
    const qpos = data.qpos, ctrl = data.ctrl;
    qpos.set([0, 0, this.constants.robot.standing_height, 1, 0, 0, 0]);
    index.q.forEach((place, i) => (qpos[place] = q[i]));
    ctrl.set(q);
    mj.mj_kinematics(model, data);
    const height = data.geom_xpos, size = model.geom_size;
    data.qpos[2] -= Math.min(...index.feet.map((foot) => height[3 * foot + 2] - size[3 * foot]));
    mj.mj_forward(model, data);
  }

  /**
   * Hold joint targets [rad] for some physics steps.
   *
   * @param beforeStep called before each of them, or null.
   */
  step(target, physicsSteps, beforeStep = null) {
    const { mj, model, data } = this;
    data.ctrl.set(target);
    for (let i = 0; i < physicsSteps; i++) {
      if (beforeStep !== null) beforeStep(this);
      mj.mj_step(model, data);
    }
    mj.mj_forward(model, data); // sensors of the state after the steps, not before the last one
  }

  /** All that the next step depends on, besides the targets. */
  get state() {
    const { qpos, qvel, qacc_warmstart: guess } = this.data;
    return { qpos: Array.from(qpos), qvel: Array.from(qvel), qacc_warmstart: Array.from(guess) };
  }

  set state(state) {
    for (const [name, values] of Object.entries(state)) this.data[name].set(values);
  }

  /** Add to the trunk's linear velocity [m/s], world frame. */
  push(velocity) {
    velocity.forEach((value, i) => (this.data.qvel[i] += value));
    this.mj.mj_forward(this.model, this.data);
  }

  /** Let a force [N] act at a point [m] of the trunk until it is changed, both in the world frame. */
  pull(force, point) {
    const trunk = this.index.trunk, center = this.data.xipos.subarray(3 * trunk, 3 * trunk + 3);
    const [x, y, z] = point.map((value, i) => value - center[i]);
    const torque = [
      y * force[2] - z * force[1],
      z * force[0] - x * force[2],
      x * force[1] - y * force[0],
    ];
    this.data.xfrc_applied.set([...force, ...torque], 6 * trunk);
  }

  /** Let no force act any more. */
  release() {
    this.data.xfrc_applied.fill(0);
  }

  /** The sensors' readings. */
  read() {
    const { data, index } = this;
    const qpos = data.qpos, qvel = data.qvel, sensors = data.sensordata;
    return {
      accelerometer: Array.from(sensors.subarray(index.accelerometer, index.accelerometer + 3)),
      gyroscope: Array.from(sensors.subarray(index.gyroscope, index.gyroscope + 3)),
      q: index.q.map((place) => qpos[place]),
      dq: index.v.map((place) => qvel[place]),
      contacts: this.contacts.map(Number),
    };
  }

  /** Which feet press on the ground. */
  get contacts() {
    const sensors = this.data.sensordata;
    return this.index.touch.map((place) => sensors[place] > this.constants.contact_force);
  }

  /** Rotation matrix from base to world, row by row. */
  get rotation() {
    const [w, x, y, z] = this.data.qpos.subarray(3, 7);
    return [
      [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
      [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
      [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ];
  }

  /** Heading [rad]. */
  get yaw() {
    const rotation = this.rotation;
    return Math.atan2(rotation[1][0], rotation[0][0]);
  }

  /** Measured (vx, vy [m/s], yaw rate [rad/s]) in the heading frame. */
  get baseVelocity() {
    const [vx, vy, , wx, wy, wz] = this.data.qvel;
    const up = this.rotation[2], yaw = this.yaw, cos = Math.cos(yaw), sin = Math.sin(yaw);
    return [cos * vx + sin * vy, cos * vy - sin * vx, up[0] * wx + up[1] * wy + up[2] * wz];
  }

  /** False once the physics has diverged: MuJoCo calls a position, velocity or acceleration bad that is no number or huge. */
  get stable() {
    const { qpos, qvel, qacc } = this.data;
    return [qpos, qvel, qacc].every((values) => values.every((value) => Math.abs(value) <= LARGEST));
  }

  /** Whether the robot lies, or the physics has diverged. */
  get fallen() {
    const { fallen_height: height, fallen_cosine: cosine } = this.constants.episode;
    const z = this.data.qpos[2], up = this.rotation[2][2];
    return !(this.stable && z >= height && up >= cosine);
  }
}
