/** Task, command, gait clock and memory of an episode: `go1_mtl_gym.episode`. */
import { GaitChange } from "./gait_change.js";
import { nextPhase } from "./gait_clock.js";

/** The filtered command after some time: first-order low-pass, then a limit on its slope. */
export function filtered(command, before, seconds, { time_constant_s: constant, slew }) {
  const fraction = 1 - Math.exp(-seconds / constant);
  return before.map((value, i) => {
    const limit = slew[i] * seconds;
    return value + Math.min(Math.max(fraction * (command[i] - value), -limit), limit);
  });
}

export class Episode {
  /**
   * @param constants of the page.
   * @param task that it begins in, one of `constants.tasks`.
   * @param command as asked for (vx [m/s], vy [m/s], yaw rate [rad/s]).
   */
  constructor(constants, task, command) {
    this.constants = constants;
    this.task = task;
    this.command = command;
    this.lastAction = new Float64Array(constants.robot.joints.length);
    this.filteredCommand = [0, 0, 0];
    this.phase = 0;
    this.steps = 0;
    this.timeS = 0;
    this.gaitChange = null;
    this.taskSinceS = -Infinity;
  }

  /** The present task, or the one that waits until the present gait can be left. */
  get requestedTask() {
    return this.gaitChange === null ? this.task : this.gaitChange.wanted;
  }

  /** Let a control period pass: clock and command filter move on. */
  advance(action) {
    const seconds = 1 / this.constants.control_hz;
    this.#pass(seconds);
    this.lastAction = action;
    this.steps += 1;
    this.timeS = this.steps * seconds;
  }

  #pass(seconds) {
    const before = this.phase, change = this.gaitChange, timeS = this.timeS + seconds;
    this.phase = nextPhase(this.task.gait, before, this.filteredCommand, seconds, this.constants.clock);
    if (change !== null && change.beginsAfter(before, this.phase, this.filteredCommand, timeS)) {
      this.#begin(change.wanted, timeS);
    }
    const followed = this.gaitChange === null ? this.command : this.gaitChange.slowed(this.command);
    this.filteredCommand = filtered(followed, this.filteredCommand, seconds, this.constants.command_filter);
  }

  /** Change the task to phase 0 of its gait as soon as the present one can be left. */
  changeTask(task) {
    this.gaitChange =
      task === this.task ? null : new GaitChange(this.task, task, this.taskSinceS, this.constants.gait_change);
    if (this.gaitChange !== null && this.gaitChange.beginsAtOnce(this.filteredCommand, this.timeS)) {
      this.#begin(task, this.timeS);
    }
  }

  #begin(task, sinceS) {
    this.task = task;
    this.phase = 0;
    this.gaitChange = null;
    this.taskSinceS = sinceS;
  }
}
