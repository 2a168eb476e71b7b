/** How a robot begins: as the page asks for it, or as a link does, if it holds a tour that can be driven here. */
import { demo } from "./demo.js";
import { decode } from "./tour_code.js";
import { checkTour } from "./tour_limits.js";

/**
 * What `Session.begin` takes.
 *
 * @param asked `{ code }` of a link, `{ demo: true }`, or what `Session.begin` takes already.
 * @param constants of the page.
 * @throws if the code is no tour, or asks for what there is not.
 */
export function beginning({ code, ...asked }, constants) {
  if (asked.demo) return demo(constants);
  if (code === undefined) return asked;
  const tour = decode(code), { tasks, policies, control_hz: controlHz } = constants;
  checkTour(tour, Object.keys(tasks), Object.keys(policies), controlHz);
  return tour;
}
