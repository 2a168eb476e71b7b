/** When a robot can leave one gait for another: `go1_mtl_gym.gait_change`. */
import { passes } from "./gait_clock.js";

/** A change of task that waits until the robot can leave its gait. */
export class GaitChange {
  /**
   * @param present task that goes on meanwhile.
   * @param wanted task that was asked for.
   * @param sinceS since when the present one goes on [s]; -Infinity if it need not go on for a while.
   * @param rules the constants "gait_change".
   */
  constructor(present, wanted, sinceS, rules) {
    Object.assign(this, { present, wanted, sinceS, rules });
    /** Largest |vx|, |vy| [m/s] and |yaw rate| [rad/s] to change with. */
    this.reach = present.command_range.map((value, i) => rules.fraction * Math.min(value, wanted.command_range[i]));
  }

  /** What the command filter follows meanwhile. */
  slowed(command) {
    return command.map((value, i) => Math.min(Math.max(value, -this.reach[i]), this.reach[i]));
  }

  /** Whether there is nothing to wait for when it is asked for. */
  beginsAtOnce(filteredCommand, timeS) {
    return this.present.gait.change_phase === null && this.#allowed(filteredCommand, timeS);
  }

  /** Whether it begins at the end of some time, in which the clock went from `before` to `after`. */
  beginsAfter(before, after, filteredCommand, timeS) {
    const mark = this.present.gait.change_phase;
    const leaves = mark === null || before === after || passes(mark, before, after);
    return leaves && this.#allowed(filteredCommand, timeS);
  }

  #allowed(filteredCommand, timeS) {
    const { shortest_task_s: shortest, slack_s: slack, reach, slack_command: more } = this.rules;
    if (timeS - this.sinceS < shortest - slack) return false;
    return filteredCommand.every((value, i) => Math.abs(value) <= reach * this.reach[i] + more);
  }
}
