/** The gait clock: `go1_mtl_gym.gaits` in JavaScript. A gait is an object of the constants, made by Python. */

/** Remainder in [0, divisor), with Python's sign. */
export function modulo(value, divisor) {
  const rest = value % divisor;
  return rest < 0 ? rest + divisor : rest;
}

/** Whether a gait can stand and the filtered command is about zero. */
export function asksToStand(gait, command, { stand_command: small }) {
  return gait.can_stand && command.every((value, i) => Math.abs(value) < small[i]);
}

/** The clock [cycles], in [0, 1), after some time under one filtered command. */
export function nextPhase(gait, phase, command, seconds, clock) {
  const turns = phase + seconds / gait.period;
  if (asksToStand(gait, command, clock) && (phase === 0 || turns >= 1 - clock.slack)) return 0;
  return turns % 1; // neither is negative; a second "% 1" would round once more than Python
}

/** Whether the clock came to, or past, a phase between two readings less than a cycle apart. */
export function passes(mark, before, after) {
  return modulo(mark - before, 1) <= modulo(after - before, 1);
}

/** Which legs should be on the ground. */
export function stance(gait, phase) {
  return gait.offsets.map((offset, leg) => modulo(phase + offset, 1) < gait.duties[leg]);
}
