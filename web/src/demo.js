/** What the page shows while nobody drives: the tour of the film in the README. */

/** The default tour as what `Session.begin` takes. */
export function demo(constants) {
  const names = Object.keys(constants.tasks), { moves, seconds } = constants.default_tour;
  const events = [];
  let task = moves[0].task;
  for (const move of moves) {
    const step = Math.round(move.time_s * constants.control_hz);
    if (move.task !== task) events.push([step, "button", [names.indexOf(move.task)]]);
    task = move.task;
    const { command_range: range } = constants.tasks[task];
    events.push([step, "stick", move.command.map((value, i) => Math.round((100 * value) / range[i]))]);
  }
  events.push([Math.round(seconds * constants.control_hz), "end", []]);
  return { seed: 1, task: names.indexOf(moves[0].task), events, punctual: false };
}
