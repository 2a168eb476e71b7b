/** A robot in a visitor's hands: his moves, what is done by itself after a fall, and a tour that can be driven again. */
import { largestPush, moveStick, pressButton, push } from "./operator.js";
import { checkTour, LONGEST_TOUR_S } from "./tour_limits.js";

export const FALL_PAUSE_S = 1.5;
/** A fallen robot lies for this long before it stands up anew [s]. */
const PULL = { stiffness: 120, damping: 10, limit: 60 };
/** Of the string that the robot is dragged by [N/m, N s/m, N]. */
const LASTING = ["stick", "pull"];
/** Moves of which the last one before a control period is all that matters. */

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
    this.complete = false; // whether all networks are there that will ever be
    this.stands = 0; // how often the robot was stood up
    this.begin({ seed: 0, task: 0, policy: 0 });
  }

  /**
   * Stand up, and begin a new tour.
   *
   * @param how `seed` of the joints' positions, indices of `task` and `policy`, and `events` of a tour to drive again;
   *   `punctual` says what happens while the network that they need is on its way: time stands still, or they are late.
   * @throws if the tour asks for a gait or a policy that there is not, or for what no hands do.
   */
  begin({ seed, task, policy = 0, events = [], punctual = true }) {
    checkTour({ seed, task, policy, events }, this.tasks, this.names, this.robot.constants.control_hz);
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
    this.policy = 0;
    this.robot.setController(this.controllers[this.names[0]], false);
    this.#stand(this.tasks[task]);
    if (policy !== 0 && this.#canDo("policy", [policy])) this.do("policy", [policy]);
  }

  /** What has been done since the beginning, as `tour_code.encode` takes it, but for the network's name. */
  get tour() {
    return { ...this.start, events: [...this.events, [Math.min(this.step, this.#longest), "end", []]] };
  }

  /** Whether the tour is longer than what is written down of it. */
  get full() {
    return this.step > this.#longest;
  }

  get replaying() {
    return this.replayed.length > 0;
  }

  /** Whether there is a network for what is asked for next. */
  isReady(taskName) {
    return this.controllers[this.names[this.policy]].isReady(taskName);
  }

  /**
   * A visitor's own move; it ends a tour that is being driven again.
   *
   * @returns whether it could be made: not if the network that it needs is missing.
   */
  move(kind, values) {
    if (this.replaying) this.#letGo();
    this.replayed = [];
    if (!this.#canDo(kind, values)) return false;
    this.do(kind, values);
    return true;
  }

  /** Do something and write it down. */
  do(kind, values) {
    if (kind === "end") this.#letGo();
    if (kind === "end" || this.#isDone(kind, values)) return;
    this.#write(kind, values);
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

  /** Hands that drove again leave the stick and the robot: nobody else knows that they held them. */
  #letGo() {
    this.do("stick", [0, 0, 0]);
    this.do("release", []);
  }

  /** Whether a move would change nothing. */
  #isDone(kind, values) {
    const isThere = (held) => values.every((value, i) => value === held[i]);
    if (kind === "stick") return isThere(this.stick);
    if (kind === "pull") return this.pulled !== null && isThere([...this.pulled.point, ...this.pulled.target].map(millimeters));
    return kind === "release" && this.pulled === null;
  }

  /** Write a move down, as long as there is room for it. */
  #write(kind, values) {
    if (this.step >= this.#longest) return;
    const { events, step } = this, isLasting = ([at, other]) => at === step && LASTING.includes(other);
    for (let i = events.length - 1; LASTING.includes(kind) && i >= 0 && isLasting(events[i]); i--) {
      if (events[i][1] === kind) events.splice(i, 1); // as often as pictures are drawn it may have been sent
    }
    events.push([step, kind, values]);
  }

  /** Control periods of the longest tour. */
  get #longest() {
    return LONGEST_TOUR_S * this.robot.constants.control_hz;
  }

  get #controlS() {
    return 1 / this.robot.constants.control_hz;
  }

  #replay() {
    while (this.replaying && this.replayed[0][0] <= this.step) {
      const [, kind, values] = this.replayed[0];
      const canDo = this.#canDo(kind, values);
      if (!canDo && !this.complete) {
        if (!this.punctual) this.replayed = this.replayed.map(([step, ...move]) => [step + 1, ...move]);
        return !this.punctual;
      }
      this.replayed = this.replayed.slice(1);
      if (canDo) this.do(kind, values); // or without it, rather than never go on
    }
    return true;
  }

  /** Whether the network that a move needs is there. */
  #canDo(kind, [index]) {
    if (kind === "button") return this.isReady(this.tasks[index]);
    if (kind !== "policy") return true;
    const { task, requestedTask } = this.robot.episode, controller = this.controllers[this.names[index]];
    return [task, requestedTask].every(({ gait }) => controller.isReady(gait.name));
  }

  /** After a fall stand up in the gait that was asked for last; at once if the physics has diverged: there is nothing to see. */
  #watch() {
    const { stable, fallen } = this.robot.simulation;
    if (this.fallenFor === 0 && !fallen) return;
    this.falls += this.fallenFor === 0;
    this.fallenFor += this.#controlS;
    if (!stable || this.fallenFor >= FALL_PAUSE_S) this.#stand(this.robot.episode.requestedTask.gait.name);
  }

  #stand(taskName) {
    const { joint_noise: noise } = this.robot.constants.episode;
    const q = this.robot.constants.robot.home_pose.map((value) => value + noise * (2 * this.random() - 1));
    this.fallenFor = 0;
    this.pulled = null;
    this.stands += 1;
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

const millimeters = (value) => Math.round(1000 * value);
const meters = (millimeters) => millimeters.map((value) => value / 1000);
