/** What hands do to a robot: `trainers.OperatorWrapper`, and its plans. */

const clip = (value, reach) => Math.min(Math.max(value, -reach), reach);

/** Put the stick somewhere in [-1, 1]^3: a share of the range of the task that was asked for last. */
export function moveStick(robot, stick) {
  const { command_range: range } = robot.episode.requestedTask;
  robot.setCommand(stick.map((value, i) => value * range[i]));
}

/** Press a gait's button; a command beyond the new task's reach is brought to its border first. */
export function pressButton(robot, taskName) {
  const { command_range: range } = robot.constants.tasks[taskName];
  const { command_limit: limit } = robot.episode.requestedTask;
  robot.setCommand(robot.episode.command.map((value, i) => clip(value, Math.min(range[i], limit[i]))));
  robot.setTask(taskName);
}

/** The largest push in a direction [m/s], as `Task.largest_push` has it: of an ellipse in each quadrant. */
export function largestPush({ push_limit: [forward, backward, sideways] }, angle) {
  const x = Math.cos(angle), y = Math.sin(angle), along = x >= 0 ? forward : backward;
  return along === 0 || sideways === 0 ? 0 : 1 / Math.hypot(x / along, y / sideways);
}

/** Push the trunk by a change of velocity [m/s] at an angle from forward to the left [rad]. */
export function push(robot, size, angle) {
  const direction = angle + robot.simulation.yaw;
  robot.simulation.push([size * Math.cos(direction), size * Math.sin(direction), 0]);
}

/** A plan that Python drew, step by step. */
export class OperatorTour {
  /** @param plan of the reference data: task, segments, changes, pushes. */
  constructor(plan) {
    this.plan = plan;
    this.timeS = 0;
  }

  /** Begin it. */
  begin(robot) {
    robot.reset(this.plan.task, [0, 0, 0], this.plan.start);
    moveStick(robot, this.#stick(0));
  }

  /** Do what the hands do at the beginning of a control period. */
  drive(robot) {
    const before = this.timeS, { changes, pushes } = this.plan;
    this.timeS += 1 / robot.constants.control_hz;
    const now = ([timeS]) => before < timeS && timeS <= this.timeS;
    for (const [, task] of changes.filter(now)) pressButton(robot, task);
    for (const [, angle, size] of pushes.filter(now)) push(robot, size, angle);
    moveStick(robot, this.#stick(this.timeS));
  }

  #stick(timeS) {
    const [startS, endS, before, after] = this.plan.segments.findLast(([start]) => start <= timeS) ?? this.plan.segments[0];
    const span = endS - startS;
    const done = span <= 0 ? 1 : Math.min(Math.max((timeS - startS) / span, 0), 1);
    return before.map((value, i) => (1 - done) * value + done * after[i]);
  }
}
