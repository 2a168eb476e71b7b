/** A tour as text for a link: what hands did, step by step, in few characters. */

/** Kinds of events and the number of integers that come with each. */
const KINDS = [
  ["stick", 3], // percent of full deflection
  ["button", 1], // index of the task
  ["pull", 6], // point of the trunk and where it is pulled to [mm]
  ["release", 0],
  ["policy", 1], // index of the policy
  ["end", 0], // nothing more is known
  ["push", 2], // direction from the world's x axis to the left [mrad], percent of the largest
];
const VERSION = 1;

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
      if (this.done) throw new Error("the tour in the link is cut off");
      byte = this.bytes[this.place++];
      value += (byte & 127) * factor;
      factor *= 128;
    } while (byte & 128);
    if (!Number.isSafeInteger(value)) throw new Error("the link holds no tour");
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
  let last = 0;
  for (const [step, kind, values] of events) {
    writeInteger(bytes, step - last);
    writeInteger(bytes, KINDS.findIndex(([name]) => name === kind));
    for (const value of values) writeInteger(bytes, value);
    last = step;
  }
  return btoa(String.fromCharCode(...bytes)).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
}

/**
 * The tour of a text.
 *
 * @throws if it is none.
 */
export function decode(text) {
  if (!/^[\w-]+$/.test(text)) throw new Error("the link holds no tour");
  const raw = atob(text.replace(/-/g, "+").replace(/_/g, "/"));
  const reader = new Reader(Uint8Array.from(raw, (letter) => letter.charCodeAt(0)));
  const version = reader.integer();
  if (version !== VERSION) throw new Error(`the link holds a tour of version ${version}, this page reads ${VERSION}`);
  const [hash, seed, task] = [reader.integer(), reader.integer(), reader.integer()];
  const events = [];
  let step = 0;
  while (!reader.done) {
    step += reader.integer();
    const kind = KINDS[reader.integer()];
    if (kind === undefined) throw new Error("the link holds a tour with moves that this page does not know");
    events.push([step, kind[0], Array.from({ length: kind[1] }, () => reader.integer())]);
  }
  return { weights: hash.toString(16).padStart(6, "0"), seed, task, events };
}

/** Whether a tour was driven with a network. */
export function isOf(tour, weights) {
  return tour.weights === weights.slice(0, 6);
}
