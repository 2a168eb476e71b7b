/** The robot in the worker, as the page drives it: what a visitor does, what drives while nobody does, and links. */
import { decode, encode, isOf } from "./tour_code.js";

const PARAMETER = "tour"; // in the part of the address after #
const SEEDS = 65536;

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
    this.shared = this.#sharedTour();
    this.demonstrates = this.shared === null && !calm;
    this.sent = [0, 0, 0];
    worker.postMessage({ type: "start", begin: this.#beginning() });
    window.addEventListener("hashchange", () => location.reload()); // another tour was pasted into the address
  }

  /** The worker is ready; tell the visitor what he sees. */
  begun({ constants, weights }, wasTold) {
    Object.assign(this, { constants, weights, tasks: Object.keys(constants.tasks) });
    if (wasTold) return;
    if (this.demonstrates) this.say("Demonstration. Touch a stick, a key or a gait to take over.");
    else if (this.shared === null) this.say("Your device asks for little motion, so nothing moves until you drive: H has the keys.");
    else if (isOf(this.shared, weights)) this.say("A tour from a link: touch anything to take over.");
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
    history.replaceState(null, "", `#${PARAMETER}=${encode({ ...tour, weights: this.weights })}`);
    const seconds = (tour.events.at(-1)[0] / this.constants.control_hz).toFixed(0);
    const what = `link that drives these ${seconds} s again${full ? " (its first ten minutes)" : ""}`;
    try {
      await navigator.clipboard.writeText(location.href);
      this.say(`Copied: a ${what}.`);
    } catch {
      this.say(`The address is now a ${what}.`);
    }
  }

  get #task() {
    return Math.max(this.tasks.indexOf(this.latest?.requested), 0);
  }

  /** How the robot begins when the page has been loaded. */
  #beginning() {
    if (this.shared !== null) return this.shared;
    return this.demonstrates ? { demo: true } : { seed: randomSeed(), task: 0 };
  }

  #begin(how) {
    this.sent = [0, 0, 0]; // a stick that is held is sent again
    this.worker.postMessage({ type: "begin", ...how });
  }

  /** The tour in the page's address, or null. */
  #sharedTour() {
    const text = new URLSearchParams(location.hash.slice(1)).get(PARAMETER);
    try {
      return text === null ? null : decode(text);
    } catch (error) {
      this.say(`${error.message}; ${this.calm ? "it stands" : "here is the demonstration"} instead.`, true);
      return null;
    }
  }
}

const randomSeed = () => Math.floor(Math.random() * SEEDS);
