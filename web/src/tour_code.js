/** A tour as text for a link: what hands did, step by step, in few characters. */
import { refuse } from "./tour_limits.js";

/** Kinds of events and the number of integers that come with each. */
const KINDS = [
  ["stick", 3], // percent of full deflection
  ["button", 1], // index of the task
  ["pull", 6], // point of the trunk and where it is pulled to [mm]
  ["release", 0],
  ["policy", 1], // index of the policy
  ["end", 0], // nothing more is known
  ["push", 2], // direction from the world's x axis to the left [mrad], percent of the largest
  ["drag", 3], // in text alone: a pull at the same point as the last one, by how much farther [mm]
];
const VERSION = 1;
const CUT_OFF = "it is cut off", STRANGE = "it is made of other letters";

/** Integers as few bytes: seven bits each, the lowest first; the sign in the lowest bit. */
function writeInteger(bytes, value) {
  let rest = value < 0 ? -2 * value - 1 : 2 * value;
  for (; rest > 127; rest = Math.floor(rest / 128)) bytes.push((rest % 128) | 128);
  bytes.push(rest);
}

class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.place = 0;
  }

  get done() {
    return this.place >= this.bytes.length;
  }

  integer() {
    let value = 0, factor = 1, byte;
    do {
      if (this.done) refuse(CUT_OFF);
      byte = this.bytes[this.place++];
      value += (byte & 127) * factor;
      factor *= 128;
    } while (byte & 128);
    if (!Number.isSafeInteger(value)) refuse(STRANGE);
    return value % 2 ? -(value + 1) / 2 : value / 2;
  }
}

/**
 * Text of a tour.
 *
 * @param tour with `weights` (the network's name), `seed`, `task` (an index) and `events` [step, kind, integers].
 */
export function encode({ weights, seed, task, events }) {
  const bytes = [];
  for (const value of [VERSION, parseInt(weights.slice(0, 6), 16), seed, task]) writeInteger(bytes, value);
  let last = 0, pull = null;
  for (const [step, kind, values] of events) {
    const [word, numbers] = kind === "pull" && isFarther(pull, values) ? ["drag", apart(pull, values)] : [kind, values];
    writeInteger(bytes, step - last);
    writeInteger(bytes, KINDS.findIndex(([name]) => name === word));
    for (const number of numbers) writeInteger(bytes, number);
    last = step;
    if (kind === "pull") pull = values;
  }
  const raw = bytes.map((byte) => String.fromCharCode(byte)).join(""); // not one call: so many arguments none takes
  return btoa(raw).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
}

/** Whether two pulls are at the same point of the trunk. */
const isFarther = (before, after) => before !== null && after.slice(0, 3).every((value, i) => value === before[i]);

/** From where one pull goes to where another does. */
const apart = (before, after) => after.slice(3).map((value, i) => value - before[3 + i]);

/**
 * The tour of a text.
 *
 * @throws if it is none.
 */
export function decode(text) {
  if (!/^[\w-]+$/.test(text)) refuse(STRANGE);
  if (text.length % 4 === 1) refuse(CUT_OFF); // base64 has no such length
  const raw = atob(text.replace(/-/g, "+").replace(/_/g, "/"));
  const reader = new Reader(Uint8Array.from(raw, (letter) => letter.charCodeAt(0)));
  const version = reader.integer();
  if (version !== VERSION) refuse(`it is of version ${version}, this page reads ${VERSION}`);
  const [hash, seed, task] = [reader.integer(), reader.integer(), reader.integer()];
  const events = [];
  let step = 0, pull = null;
  while (events.at(-1)?.[1] !== "end") {
    step += reader.integer();
    const [word, count] = KINDS[reader.integer()] ?? refuse("this page does not know its moves");
    const numbers = Array.from({ length: count }, () => reader.integer());
    if (word === "drag" && pull === null) refuse("it drags a robot that nobody holds");
    const [kind, values] = word === "drag" ? ["pull", farther(pull, numbers)] : [word, numbers];
    if (kind === "pull") pull = values;
    events.push([step, kind, values]);
  }
  if (!reader.done) refuse("it goes on after its end");
  return { weights: hash.toString(16).padStart(6, "0"), seed, task, events };
}

/** A pull at the same point that goes so much farther. */
const farther = (pull, way) => [...pull.slice(0, 3), ...way.map((value, i) => pull[3 + i] + value)];

/** Whether a tour was driven with a network. */
export function isOf(tour, weights) {
  return tour.weights === weights.slice(0, 6);
}
