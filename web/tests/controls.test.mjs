/** What keys, fingers and gamepads come to. */
import assert from "node:assert/strict";
import test from "node:test";

import { Gamepad, rested } from "../src/gamepad.js";
import { ACTION_KEYS, HELP } from "../src/keyboard.js";
import { Pace } from "../src/pace.js";
import { Stick } from "../src/stick.js";

/** Where the stick is while keys are held. */
function held(codes, gentle = false) {
  const stick = new Stick();
  for (const code of codes) stick.key(code, true);
  stick.gentle = gentle;
  return stick.percent;
}

test("two keys for one direction pull once, opposite ones not at all, Shift halves", () => {
  assert.deepEqual(held(["KeyW", "ArrowUp"]), [100, 0, 0]);
  assert.deepEqual(held(["KeyW", "ArrowUp", "KeyD"], true), [50, 0, -50]);
  assert.deepEqual(held(["KeyW", "KeyS", "KeyQ"]), [0, 100, 0]);
  assert.deepEqual(held(["ArrowLeft", "KeyE"]), [0, -100, 100]);
});

test("a stick comes back when everything is let go, and ends where it ends", () => {
  const stick = new Stick();
  stick.key("KeyW", true);
  stick.touch = [0.5, -0.25, 0];
  stick.pad = [0, -0.25, 1];
  assert.deepEqual(stick.percent, [100, -50, 100]);
  stick.key("KeyW", false);
  assert.deepEqual(stick.percent, [50, -50, 100]);
  stick.release();
  stick.pad = [0, 0, 0];
  assert.deepEqual(stick.percent, [0, 0, 0]);
});

/** Make the browser's gamepads these. */
function browserHas(getGamepads) {
  Object.defineProperty(globalThis, "navigator", { value: { getGamepads }, configurable: true });
}

test("a gamepad leans the stick, and a button that stays down acts once", () => {
  const done = [], stick = new Stick();
  const actions = { push: (hard) => done.push(["push", hard]), chooseNext: (places) => done.push(["next", places]) };
  const buttons = Array.from({ length: 16 }, () => ({ pressed: false }));
  const plugged = [{ connected: true, mapping: "standard", axes: [0.56, -1, 0.1, 0], buttons }];
  browserHas(() => plugged);
  const gamepad = new Gamepad(stick, actions);
  buttons[0].pressed = buttons[4].pressed = true;
  gamepad.poll();
  gamepad.poll();
  assert.deepEqual(stick.percent, [100, -50, 0]);
  assert.deepEqual(done, [["push", false], ["next", -1]]);
  plugged.pop();
  gamepad.poll();
  assert.deepEqual(stick.percent, [0, 0, 0]);
  assert.ok(Math.abs(rested(-0.56) + 0.5) < 1e-12);
});

test("a wheel whose axes nobody knows drives nothing, and stands in no gamepad's way", () => {
  const buttons = Array.from({ length: 12 }, () => ({ pressed: true })), done = [], stick = new Stick();
  const wheel = { connected: true, mapping: "", axes: [0, 0, -1, 0, 0, -1], buttons }, plugged = [null, wheel];
  browserHas(() => plugged);
  const gamepad = new Gamepad(stick, { pause: () => done.push("pause") });
  gamepad.poll();
  assert.deepEqual([stick.percent, done], [[0, 0, 0], []]);
  plugged.push({ connected: true, mapping: "standard", axes: [0.1, -1, -0.1, 0], buttons: [] });
  gamepad.poll();
  assert.deepEqual(stick.percent, [100, 0, 0]);
});

test("a browser that allows no gamepads is asked once", () => {
  let asked = 0;
  browserHas(() => {
    asked += 1;
    throw new Error("blocked by permissions policy");
  });
  const stick = new Stick(), gamepad = new Gamepad(stick, {});
  gamepad.poll();
  gamepad.poll();
  assert.deepEqual([stick.percent, asked], [[0, 0, 0], 1]);
});

test("time is slowed down to a tenth, and sped up to real time", () => {
  globalThis.document = { hidden: false };
  const pace = new Pace();
  pace.slower(-1);
  assert.equal(pace.factor, 1);
  for (let i = 0; i < 5; i++) pace.slower();
  assert.equal(pace.factor, 0.1);
  pace.cycle();
  assert.equal(pace.factor, 1);
  pace.paused = true;
  assert.equal(pace.factor, 0);
});

test("the help names every key that does something", () => {
  const named = HELP.flatMap(([alternatives]) => alternatives.flatMap((keys) => keys.split(" ")));
  for (const code of Object.keys(ACTION_KEYS)) {
    const name = { Minus: "-", Equal: "=" }[code] ?? code.replace("Key", "");
    assert.ok(named.includes(name), name);
  }
});
