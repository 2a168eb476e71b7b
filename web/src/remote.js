/** The robot in the worker, as the page drives it: what a visitor does, what drives while nobody does, and links. */
import { encode, isOf } from "./tour_code.js";
import { SEEDS } from "./tour_limits.js";

const PARAMETER = "tour"; // in the part of the address after #
const LONGEST = 1e6; // letters that every browser takes in an address; ten minutes of dragging have a third of them
const LONG = 2000; // letters from which on other programs may cut an address

export class Remote {
  /**
   * @param worker that holds the robot.
   * @param say tells the visitor a sentence, and whether it is an error.
   * @param calm whether the visitor asked for little motion: then nothing moves by itself.
   */
  constructor(worker, say, calm) {
    Object.assign(this, { worker, say, calm });
    this.latest = null; // what the worker said last of the robot
    this.tasks = [];
    this.missing = []; // what could not be loaded
    const code = new URLSearchParams(location.hash.slice(1)).get(PARAMETER);
    this.demonstrates = code === null && !calm;
    this.sent = [0, 0, 0];
    const alone = calm ? { seed: randomSeed(), task: 0 } : { demo: true };
    worker.postMessage({ type: "start", begin: code === null ? alone : { code }, instead: alone });
    window.addEventListener("hashchange", () => location.reload()); // another tour was pasted into the address
  }

  /** The link holds no tour that can be driven. */
  refused(why) {
    this.demonstrates = !this.calm;
    this.say(`${why[0].toUpperCase()}${why.slice(1)}; ${this.calm ? "the robot stands" : "here is the demonstration"} instead.`, true);
  }

  /** A network could not be loaded; the others are there. */
  lacks(name, why) {
    this.missing.push(name);
    this.say(`Without ${this.missing.join(", ")}: not everything could be loaded (${why}). The rest works; load the page again to try once more.`, true);
  }

  /** The worker is ready; tell the visitor what he sees. */
  begun({ constants, weights, drivenWith }, wasTold) {
    Object.assign(this, { constants, weights, tasks: Object.keys(constants.tasks) });
    if (wasTold) return;
    if (this.demonstrates) this.say("Demonstration. Touch a stick, a key or a gait to take over.");
    else if (drivenWith === null) this.say("Your device asks for little motion, so nothing moves until you drive: H has the keys.");
    else if (isOf({ weights: drivenWith }, weights)) this.say("A tour from a link: touch anything to take over.");
    else this.say("This tour was driven with another network: it may go elsewhere.");
  }

  /** Take in what the worker says of the robot. */
  take(report) {
    const over = this.demonstrates && this.latest?.replaying && !report.replaying;
    this.latest = report;
    if (over) this.#begin({ demo: true });
  }

  /** A visitor's move: from now on nobody else drives. */
  move(kind, values) {
    if (this.demonstrates) {
      this.demonstrates = false;
      this.#begin({ seed: randomSeed(), task: this.#task });
    }
    this.say("");
    this.worker.postMessage({ type: "move", kind, values });
  }

  /** Put the stick somewhere [percent], unless it is there. */
  moveStick(percent) {
    if (percent.every((value, i) => value === this.sent[i])) return;
    this.sent = percent;
    this.move("stick", percent);
  }

  /** Stand up in the gait that was asked for last, under the same policy, and begin a new tour. */
  reset() {
    this.demonstrates = false;
    this.say("");
    history.replaceState(null, "", location.pathname + location.search);
    this.#begin({ seed: randomSeed(), task: this.#task, policy: this.latest?.policy === "phase_free" ? 1 : 0 });
  }

  /** Let one control period pass. */
  oneStep() {
    this.worker.postMessage({ type: "step" });
  }

  /** Let time pass at this share of real time. */
  setSpeed(speed) {
    this.worker.postMessage({ type: "speed", speed });
  }

  /** Ask for the tour since the beginning; `share` takes the answer. */
  askForTour() {
    this.worker.postMessage({ type: "tour" });
  }

  /** Put the link to a tour into the address and the clipboard. */
  async share({ tour, full }) {
    const seconds = (tour.events.at(-1)[0] / this.constants.control_hz).toFixed(0);
    try {
      this.#putIntoAddress(encode({ ...tour, weights: this.weights }));
    } catch ({ message }) {
      this.say(`There is no link to these ${seconds} s: ${message}. R begins a shorter tour.`, true);
      return;
    }
    const { length } = location.href, short = full ? ` (the first ${seconds} s, what came later is not in it)` : "";
    const warning = length > LONG ? ` It has ${length} letters: mail and messengers may cut it off.` : "";
    const what = `link that drives ${full ? "this tour" : `these ${seconds} s`} again${short}.${warning}`;
    try {
      await navigator.clipboard.writeText(location.href);
      this.say(`Copied: a ${what}`);
    } catch {
      this.say(`The address is now a ${what}`);
    }
  }

  /** @throws a reason, if the browser or a limit does not let it. */
  #putIntoAddress(code) {
    if (code.length > LONGEST) throw new Error(`it would have ${code.length} letters, an address holds ${LONGEST}`);
    history.replaceState(null, "", `#${PARAMETER}=${code}`);
  }

  get #task() {
    return Math.max(this.tasks.indexOf(this.latest?.requested), 0);
  }

  #begin(how) {
    this.sent = [0, 0, 0]; // a stick that is held is sent again
    this.worker.postMessage({ type: "begin", ...how });
  }
}

const randomSeed = () => Math.floor(Math.random() * SEEDS);
