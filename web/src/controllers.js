/** Policies that turn what is measured into actions: `trainers.MultiHeadPolicy` and `trainers.PhaseFreePolicy`. */
import { asksToStand, modulo } from "./gait_clock.js";
import { unit } from "./network.js";
import { Observer } from "./observation.js";

/** The student, which sees the gait clock. */
export class Clocked {
  constructor(constants, student) {
    this.student = student;
    this.observer = new Observer(student.policy, constants.proprioception);
  }

  /** Whether there is a network for a task. */
  isReady(taskName) {
    return this.student.has(taskName);
  }

  reset() {
    this.observer.reset();
  }

  /** Take in what a reset or a step has led to. */
  observe(parts, gait) {
    this.gait = gait;
    this.observation = this.observer.observe(parts, gait.name);
  }

  /** The action for what was observed last: a button that was pressed since then shows after the next step. */
  act() {
    return this.student.act(this.observation, this.gait.name);
  }
}

/** The student with a clock of its own, which an estimate of the phase corrects at every step. */
export class PhaseFree {
  /**
   * @param constants of the page.
   * @param policy the constants of this policy.
   */
  constructor(constants, policy) {
    Object.assign(this, { constants, policy });
    this.observer = new Observer(policy, constants.proprioception);
    this.clocked = null;
  }

  /**
   * Take its networks, which may come later than the page.
   *
   * @param student that sees a clock.
   * @param estimator of the phase.
   */
  load(student, estimator) {
    this.estimator = estimator;
    this.clocked = new Clocked(this.constants, student);
    this.reset();
  }

  /** Whether there is a network for a task. */
  isReady(taskName) {
    return this.clocked !== null && this.clocked.isReady(taskName);
  }

  reset() {
    this.observer.reset();
    this.clocked.reset();
    this.gait = null;
    this.clock = [0, 1];
  }

  /** Take in what a reset or a step has led to. */
  observe(parts, gait) {
    this.observation = this.observer.observe(parts, gait.name);
    const estimate = this.estimator.estimate(this.observation);
    this.clock = this.#corrected(gait, estimate, parts.command.map(Math.fround));
    this.gait = gait;
    this.clocked.observe({ ...parts, phase: this.clock }, gait);
  }

  act() {
    return this.clocked.act();
  }

  /** The clock of this period as (sine, cosine). */
  #corrected(gait, estimate, command) {
    const anew = this.gait !== gait;
    const before = anew ? 0 : turns(this.clock);
    const later = 2 * Math.PI * (anew ? 0 : before + 1 / (gait.period * this.constants.control_hz));
    const share = this.policy.correction;
    const clock = unit([
      (1 - share) * Math.sin(later) + share * estimate[0],
      (1 - share) * Math.cos(later) + share * estimate[1],
    ]);
    const after = turns(clock);
    const forward = modulo(after - before, 1) < 0.5;
    const rests = asksToStand(gait, command, this.constants.clock) && (before === 0 || (forward && after < before));
    return rests ? [0, 1] : clock;
  }
}

/** Phase [cycles] of a sine and cosine. */
function turns([sine, cosine]) {
  return modulo(Math.atan2(sine, cosine) / (2 * Math.PI), 1);
}
