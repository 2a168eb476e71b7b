/** Poses between poses, integers as bytes, and modules without debug sections. */
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import test from "node:test";

import { demo } from "../src/demo.js";
import { between, Playback } from "../src/playback.js";
import { decode, encode } from "../src/tour_code.js";
import { withoutSections } from "../wasm_sections.mjs";
import { constants } from "./load.mjs";

const pose = (x, ...quaternion) => Float32Array.from([x, 0, 0, ...quaternion]);
const frame = (timeS) => ({ timeS, pose: pose(timeS, 1, 0, 0, 0) });

test("a pose in the middle is in the middle, the short way round", () => {
  const s = Math.SQRT1_2;
  const middle = between({ timeS: 0, pose: pose(1, 1, 0, 0, 0) }, { timeS: 1, pose: pose(3, -s, 0, 0, -s) }, 0.5);
  assert.ok(Math.abs(middle[0] - 2) < 1e-6);
  assert.ok(Math.abs(middle[3] - Math.cos(Math.PI / 8)) < 1e-6 && Math.abs(middle[6] - Math.sin(Math.PI / 8)) < 1e-6);
});

test("pictures move evenly between the physics' messages", () => {
  const playback = new Playback(), seen = [];
  assert.equal(playback.next(0.01), null);
  for (let tick = 0; tick < 100; tick++) {
    if (tick % 2 === 0) playback.add([5, 10, 15, 20].map((ms) => frame(0.01 * tick + ms / 1000)));
    seen.push(playback.next(0.01)[0]);
  }
  const steps = seen.slice(20).map((x, i) => x - seen[19 + i]);
  assert.ok(Math.max(...steps) - Math.min(...steps) < 1e-4, `${Math.min(...steps)} ... ${Math.max(...steps)}`);
  assert.ok(playback.frames.length < 60, "old frames go");
  playback.add([frame(0.02)]);
  assert.ok(Math.abs(playback.next(0.01)[0] - 0.02) < 1e-6, "a robot that begins anew is where it begins");
});

test("a picture of time that stands still is the last step's", () => {
  const playback = new Playback();
  playback.add([frame(0.02), frame(0.04)]);
  playback.next(0);
  playback.catchUp();
  assert.ok(Math.abs(playback.next(0)[0] - 0.04) < 1e-6);
});

test("integers of every size come back from a link", () => {
  const events = [0, 1, -1, 63, 64, -64, -65, 8191, -100000, 123456].map((value, i) => [3 * i, "stick", [value, -value, 0]]);
  events.push([40, "end", []]);
  const read = decode(encode({ weights: "00ab12ff", seed: 65535, task: 5, events }));
  assert.deepEqual(read, { weights: "00ab12", seed: 65535, task: 5, events: events.map(([step, kind, v]) => [step, kind, v.map((x) => x + 0)]) });
});

test("the demonstration is the tour of the film", () => {
  const { moves, seconds } = constants.default_tour, { events } = demo(constants);
  assert.equal(events.filter(([, kind]) => kind === "stick").length, moves.length);
  assert.equal(events.at(-1)[0], Math.round(seconds * constants.control_hz));
  assert.ok(events.every(([, kind, values]) => kind !== "stick" || values.every((value) => Math.abs(value) <= 100)));
});

test("a module without debug sections is smaller and whole", () => {
  const bytes = readFileSync(createRequire(import.meta.url).resolve("@mujoco/mujoco/mujoco.wasm"));
  const small = withoutSections(bytes, /^(name|\.debug_.*)$/);
  assert.ok(small.length < 0.6 * bytes.length);
  assert.ok(WebAssembly.validate(small));
  assert.throws(() => withoutSections(Buffer.from("something else"), /x/), /expected/);
  assert.throws(() => withoutSections(bytes.subarray(0, 5000), /x/), /cut off/);
});
