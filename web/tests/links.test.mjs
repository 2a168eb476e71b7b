/** Codes in a link: what is refused, and what fits into one. */
import assert from "node:assert/strict";
import test from "node:test";

import { beginning } from "../src/beginning.js";
import { decode, encode } from "../src/tour_code.js";
import { constants } from "./load.mjs";

const TOUR = { weights: "0d610a", seed: 1, task: 0, events: [[5, "stick", [100, -100, 50]], [30000, "push", [-3142, 100]], [30000, "end", []]] };
const begin = (code) => beginning({ code }, constants);

/** A code of the tour with other fields; `move` comes in its middle. */
function code({ move = [5, "release", []], ...changed }) {
  const [first, ...others] = TOUR.events;
  return encode({ ...TOUR, events: [first, move, ...others], ...changed });
}

test("a tour that hands can drive is taken from its link", () => {
  assert.deepEqual(begin(encode(TOUR)), TOUR);
  assert.equal(begin(code({ move: [7, "policy", [1]], seed: 65535, task: 5 })).task, 5);
});

test("every bad code is refused in the same words", () => {
  const end = [[9, "end", []]];
  const bad = {
    "no letters": ["", /other letters/],
    "other letters": ["not a tour!", /other letters/],
    "a length that no code has": ["AAAAA", /cut off/],
    "another version": ["BAAA", /version 2/],
    "version 0": ["AAAA", /version 0/],
    "a code cut off": [encode(TOUR).slice(0, -2), /cut off/],
    "a code cut off between two moves": [encode({ ...TOUR, events: TOUR.events.slice(0, 1) }), /cut off/],
    "something after the end": [encode({ ...TOUR, events: [...TOUR.events, [40000, "release", []]] }), /after its end/],
    "an unknown move": [encode({ ...TOUR, events: [] }) + "AAZk", /does not know|cut off/],
    "an unknown gait": [code({ task: 99 }), /number 99 of trot, bound/],
    "a gait before the first": [code({ task: -1 }), /number -1 of/],
    "an unknown gait's button": [code({ move: [6, "button", [99]] }), /number 99 of trot/],
    "an unknown policy": [code({ move: [6, "policy", [2]] }), /number 2 of multi_head/],
    "a negative seed": [code({ seed: -5 }), /seed is -5/],
    "a seed beyond all": [code({ seed: 65536 }), /seed is 65536/],
    "a stick beyond its reach": [code({ move: [6, "stick", [0, 101, 0]] }), /stick of 101/],
    "a stick far beyond its reach": [code({ move: [6, "stick", [-100000, 0, 0]] }), /stick of -100000/],
    "a huge push": [code({ move: [6, "push", [0, 10 ** 14]] }), /push of 1000/],
    "a push of no direction": [code({ move: [6, "push", [10 ** 9, 50]] }), /push of 1000000000/],
    "a pull beside the robot": [code({ move: [6, "pull", [0, 1001, 0, 0, 0, 0]] }), /pull of 1001/],
    "a pull out of the world": [code({ move: [6, "pull", [0, 0, 0, 0, 0, 10 ** 12]] }), /pull of 1000000000000/],
    "a step that runs back": [code({ move: [-100, "release", []] }), /step -100 follows/],
    "a first step before the beginning": [encode({ ...TOUR, events: [[-1, "release", []], ...end] }), /step -1 follows/],
    "a step after the last": [code({ move: [30001, "release", []] }), /step 30001/],
  };
  for (const [what, [text, why]] of Object.entries(bad)) {
    assert.throws(() => begin(text), ({ message }) => /^the link holds no tour that this page can drive: /.test(message) && why.test(message), what);
  }
});

test("letters at random are refused or are a tour, and nothing else happens", () => {
  const letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  let state = 1;
  const random = (below) => (state = (state * 48271) % 2147483647) % below;
  for (let i = 0; i < 5000; i++) {
    const text = Array.from({ length: 1 + random(40) }, () => letters[random(64)]).join("");
    try {
      begin(i % 2 ? text : `Ag${text}`); // the half with the right version
    } catch ({ message }) {
      assert.match(message, /^the link holds no tour/);
    }
  }
});

test("ten minutes of dragging with one hand and steering with the other are a link", (t) => {
  const events = [];
  for (let step = 0; step < 30000; step++) {
    const turn = step / 8;
    events.push([step, "pull", [120, -35, 60, Math.round(step + 900 * Math.cos(turn)), Math.round(700 * Math.sin(turn)), 260 + (step % 90)]]);
    events.push([step, "stick", [60 + (step % 37), 40 - (step % 80), step % 95]]);
  }
  events.push([30000, "end", []]);
  const text = encode({ ...TOUR, events });
  t.diagnostic(`${text.length} letters`);
  assert.ok(text.length < 750000);
  assert.ok(JSON.stringify(decode(text).events) === JSON.stringify(events));
  const drags = encode({ ...TOUR, events: events.filter(([, kind]) => kind !== "stick") });
  t.diagnostic(`${drags.length} letters without steering`);
  assert.ok(drags.length < 350000);
});

test("a robot that is taken at another point comes back as it was", () => {
  const pulls = [[0, 0, 0, 5, 6, 7], [0, 0, 0, -5, 6, 900], [1, 0, 0, 8, 9, 10], [1, 0, 0, 8, 9, 11]];
  const events = pulls.flatMap((values, i) => [[i, "pull", values], [i, "release", []]]);
  assert.deepEqual(decode(encode({ ...TOUR, events: [...events, [9, "end", []]] })).events.slice(0, -1), events);
});

test("links in which every pull was written in full are still driven", () => {
  const { events } = begin("ApSEawIAAAQCAAAQEhQCBAIAABASFgIK");
  assert.deepEqual(events, [[0, "pull", [1, 0, 0, 8, 9, 10]], [1, "pull", [1, 0, 0, 8, 9, 11]], [2, "end", []]]);
});
