/** Moves at fixed steps, as `trainers.Script` makes them. */

/** Make the moves that are due before a step: the stick in the middle, the button, the stick where it belongs. */
export function drive(robot, moves, step) {
  for (const [at, task, command] of moves) {
    if (at !== step || at === 0) continue;
    robot.setTask(task);
    robot.setCommand(command);
  }
}
