/** What a tour may hold. Hands on the page do no more than that; links come from anywhere and are held to it. */

export const SEEDS = 65536;
/** Seeds of a tour are whole numbers below this. */
export const LONGEST_TOUR_S = 600;
/** Moves are written down for this long [s]. */

const FAR_MM = 1e8; // beyond where any robot walks
const REACHES = {
  stick: [100, 100, 100], // percent of full deflection
  pull: [1000, 1000, 1000, FAR_MM, FAR_MM, FAR_MM], // no part of the robot is farther from its trunk than a meter
  push: [6284, 100], // a turn [mrad], percent of the largest
};

/** Let nothing pass that is no tour. @throws an error that says why, and nothing else. */
export function refuse(why) {
  throw new Error(`the link holds no tour that this page can drive: ${why}`);
}

/**
 * Compare a tour with what there is and what hands can do.
 *
 * @param tour with `seed`, index of `task`, perhaps of `policy`, and `events` [step, kind, integers].
 * @param tasks names of the gaits, policies names of the policies.
 * @param controlHz control periods per second.
 * @throws if it asks for something else.
 */
export function checkTour({ seed, task, policy = 0, events = [] }, tasks, policies, controlHz) {
  if (!isWithin(seed, 0, SEEDS - 1)) refuse(`its seed is ${seed}, expected is one from 0 to ${SEEDS - 1}`);
  let last = 0;
  for (const [step, kind, values] of [[0, "button", [task]], [0, "policy", [policy]], ...events]) {
    const latest = kind === "end" ? Infinity : LONGEST_TOUR_S * controlHz;
    if (!isWithin(step, last, latest)) refuse(`a move at step ${step} follows one at step ${last}, the last of all is ${latest}`);
    last = step;
    const names = { button: tasks, policy: policies }[kind];
    if (names !== undefined && names[values[0]] === undefined) refuse(`it asks for number ${values[0]} of ${names.join(", ")}, counted from 0`);
    const reach = REACHES[kind] ?? [];
    values.slice(0, reach.length).forEach((value, i) => {
      if (!isWithin(value, -reach[i], reach[i])) refuse(`a ${kind} of ${value} is beyond ${reach[i]}`);
    });
  }
}

const isWithin = (value, low, high) => Number.isInteger(value) && low <= value && value <= high;
