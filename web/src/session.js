/** A robot in a visitor's hands: his moves, what is done by itself after a fall, and a tour that can be driven again. */
import { largestPush, moveStick, pressButton, push } from "./operator.js";

export const FALL_PAUSE_S = 1.5;
/** A fallen robot lies for this long before it stands up anew [s]. */
const LONGEST_TOUR_S = 600;
/** Moves are written down for this long [s]. */
const PULL = { stiffness: 120, damping: 10, limit: 60 };
/** Of the string that the robot is dragged by [N/m, N s/m, N]. */

/** Numbers in [0, 1) that follow from a seed (mulberry32, by T. Ettinger, public domain). */
function generator(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(state ^ (state >>> 15), state | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

export class Session {
  /**
   * @param robot that is driven.
   * @param controllers by name, in the order of their numbers in a tour; each has `isReady(taskName)`.
   */
  constructor(robot, controllers) {
    this.robot = robot;
    this.controllers = controllers;
    this.names = Object.keys(controllers);
    this.tasks = Object.keys(robot.constants.tasks);
    this.begin({ seed: 0, task: 0, policy: 0 });
  }

  /**
   * Stand up, and begin a new tour.
   *
   * @param how `seed` of the joints' positions, indices of `task` and `policy`, and `events` of a tour to drive again;
   *   `punctual` says what happens while the network that they need is on its way: time stands still, or they are late.
   * @throws if the tour asks for a gait or a policy that there is not.
   */
  begin({ seed, task, policy = 0, events = [], punctual = true }) {
    this.#check([[0, "button", [task]], [0, "policy", [policy]], ...events]);
    this.random = generator(seed);
    this.start = { seed, task };
    this.events = [];
    this.replayed = events;
    this.punctual = punctual;
    this.step = 0;
    this.stick = [0, 0, 0];
    this.pulled = null;
    this.fallenFor = 0;
    this.falls = 0;
    this.full = false;
    this.policy = 0;
    this.robot.setController(this.controllers[this.names[0]], false);
    this.#stand(this.tasks[task]);
    if (policy !== 0) this.do("policy", [policy]);
  }

  /** What has been done since the beginning, as `tour_code.encode` takes it, but for the network's name. */
  get tour() {
    return { ...this.start, events: [...this.events, [this.step, "end", []]] };
  }

  get replaying() {
    return this.replayed.length > 0;
  }

  /** Whether there is a network for what is asked for next. */
  isReady(taskName) {
    return this.controllers[this.names[this.policy]].isReady(taskName);
  }

  /** A visitor's own move; it ends a tour that is being driven again. */
  move(kind, values) {
    this.replayed = [];
    this.do(kind, values);
  }

  /** Do something and write it down. */
  do(kind, values) {
    if (kind === "stick" && values.every((value, i) => value === this.stick[i])) return;
    if (kind === "end") return;
    if (this.step * this.#controlS < LONGEST_TOUR_S) this.events.push([this.step, kind, values]);
    else this.full = true;
    if (kind === "stick") this.stick = values;
    if (kind === "button") pressButton(this.robot, this.tasks[values[0]]);
    if (kind === "pull") this.pulled = { point: meters(values.slice(0, 3)), target: meters(values.slice(3)) };
    if (kind === "release") this.pulled = null;
    if (kind === "push") this.#push(values[0] / 1000, values[1] / 100);
    if (kind === "policy") {
      this.policy = values[0];
      this.robot.setController(this.controllers[this.names[this.policy]]);
    }
  }

  /**
   * Let a control period pass.
   *
   * @param beforePhysicsStep called with the number of each physics step, before it.
   * @returns whether it could: a gait whose network is still on its way holds a punctual tour up.
   */
  tick(beforePhysicsStep = () => {}) {
    if (!this.#replay()) return false;
    moveStick(this.robot, this.stick.map((value) => value / 100));
    let number = 0;
    this.robot.step((simulation) => {
      this.#pull(simulation);
      beforePhysicsStep(number++);
    });
    this.step += 1;
    this.#watch();
    return true;
  }

  #check(events) {
    for (const [, kind, [index]] of events) {
      const known = { button: this.tasks, policy: this.names }[kind];
      if (known !== undefined && known[index] === undefined) {
        throw new Error(`the tour asks for number ${index} of ${known.join(", ")}, counted from 0`);
      }
    }
  }

  get #controlS() {
    return 1 / this.robot.constants.control_hz;
  }

  #replay() {
    while (this.replaying && this.replayed[0][0] <= this.step) {
      const [, kind, values] = this.replayed[0];
      if (!this.#canDo(kind, values)) {
        if (!this.punctual) this.replayed = this.replayed.map(([step, ...move]) => [step + 1, ...move]);
        return !this.punctual;
      }
      this.replayed = this.replayed.slice(1);
      this.do(kind, values);
    }
    return true;
  }

  /** Whether the network that a move needs is there. */
  #canDo(kind, [index]) {
    if (kind === "button") return this.isReady(this.tasks[index]);
    if (kind === "policy") return this.controllers[this.names[index]].isReady(this.robot.episode.task.gait.name);
    return true;
  }

  /** After a fall stand up in the gait that was asked for last. */
  #watch() {
    if (this.fallenFor === 0 && !this.robot.simulation.fallen) return;
    this.falls += this.fallenFor === 0;
    this.fallenFor += this.#controlS;
    if (this.fallenFor >= FALL_PAUSE_S) this.#stand(this.robot.episode.requestedTask.gait.name);
  }

  #stand(taskName) {
    const { joint_noise: noise } = this.robot.constants.episode;
    const q = this.robot.constants.robot.home_pose.map((value) => value + noise * (2 * this.random() - 1));
    this.fallenFor = 0;
    this.pulled = null;
    this.robot.simulation.release();
    this.robot.reset(taskName, [0, 0, 0], q);
  }

  /**
   * Push the trunk.
   *
   * @param direction from the world's x axis to the left [rad].
   * @param share of the largest push that the expert bears in the present gait and that direction.
   */
  #push(direction, share) {
    const { simulation, episode } = this.robot, angle = direction - simulation.yaw;
    push(this.robot, share * largestPush(episode.task, angle), angle);
  }

  /** Pull at the trunk with a damped string of limited strength. */
  #pull(simulation) {
    if (this.pulled === null) {
      simulation.release();
      return;
    }
    const { rotation, data } = simulation, { stiffness, damping, limit } = PULL;
    const arm = rotation.map((row) => row.reduce((sum, value, i) => sum + value * this.pulled.point[i], 0));
    const point = arm.map((value, i) => value + data.qpos[i]);
    const force = point.map((value, i) => stiffness * (this.pulled.target[i] - value) - damping * data.qvel[i]);
    const scale = Math.min(1, limit / Math.max(Math.hypot(...force), 1e-9));
    simulation.pull(force.map((value) => scale * value), point);
  }
}

const meters = (millimeters) => millimeters.map((value) => value / 1000);
