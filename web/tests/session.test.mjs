/** A visitor's session: his tour drives the same way from its link, and a fall is got over. */
import assert from "node:assert/strict";
import test from "node:test";

import { largestPush } from "../src/operator.js";
import { FALL_PAUSE_S, Session } from "../src/session.js";
import { decode, encode, isOf } from "../src/tour_code.js";
import { constants, makeController, makeRobot } from "./load.mjs";

const robot = await makeRobot();
const session = new Session(robot, { multi_head: robot.controller, phase_free: makeController("phase_free") });
const WEIGHTS = "7fb5e491797eed2d.bin";

/** Let some seconds pass. */
function wait(seconds) {
  for (let i = 0; i < Math.round(50 * seconds); i++) assert.ok(session.tick());
}

/** A tour with everything in it; returns where it ends. */
function tour() {
  session.begin({ seed: 7, task: 0 });
  session.move("stick", [60, 0, 0]);
  wait(1.5);
  session.move("button", [4]);
  session.move("stick", [60, -20, 30]);
  wait(2);
  session.move("pull", [50, 0, 30, 900, 700, 400]);
  wait(0.2);
  session.move("release", []);
  session.move("push", [785, 50]);
  session.move("policy", [1]);
  wait(2);
  session.move("stick", [0, 0, 0]);
  wait(1);
  return robot.simulation.state;
}

test("a link drives the same tour to the bit", () => {
  const end = tour();
  const text = encode({ ...session.tour, weights: WEIGHTS });
  assert.ok(text.length < 120, `${text.length} letters`);
  const read = decode(text);
  assert.deepEqual(read.events, session.tour.events);
  assert.ok(isOf(read, WEIGHTS) && !isOf(read, "ffff" + WEIGHTS.slice(4)));
  session.begin(read);
  for (let i = 0; session.replaying; i++) assert.ok(session.tick() && i < 1000);
  session.begin(read);
  wait(6.7);
  assert.equal(robot.simulation.fallen, false);
  assert.deepEqual(robot.simulation.state, end);
  assert.equal(encode({ ...session.tour, weights: WEIGHTS }), text, "and can be handed on");
});

test("hands that take over end a replay", () => {
  tour();
  session.begin(session.tour);
  wait(1);
  assert.ok(session.replaying);
  session.move("stick", [10, 0, 0]);
  assert.ok(!session.replaying);
  assert.deepEqual(session.tour.events.at(-2), [50, "stick", [10, 0, 0]]);
});

test("a robot that is thrown over stands up again", () => {
  session.begin({ seed: 1, task: 0 });
  wait(0.5);
  robot.simulation.push([0, 6, 2]);
  while (session.fallenFor === 0) wait(0.02);
  wait(FALL_PAUSE_S + 1);
  assert.equal(session.falls, 1);
  assert.equal(robot.simulation.fallen, false);
  session.move("stick", [50, 0, 0]);
  wait(3);
  assert.ok(robot.simulation.baseVelocity[0] > 0.4);
});

test("a robot whose physics diverged has fallen, and stands up with all its senses", () => {
  const { data } = robot.simulation;
  for (const spoil of [() => (data.qvel[2] = NaN), () => robot.simulation.push([1e9, 0, 0]), () => (data.qpos[9] = Infinity)]) {
    session.begin({ seed: 1, task: 0 });
    wait(0.1);
    const { stands } = session;
    spoil();
    wait(0.02);
    assert.deepEqual([session.falls, session.stands - stands], [1, 1]);
    assert.ok(robot.simulation.stable);
    assert.ok([...robot.simulation.baseVelocity, ...robot.controller.observation].every(Number.isFinite));
  }
  session.move("stick", [50, 0, 0]);
  wait(2);
  assert.equal(robot.simulation.fallen, false);
  assert.ok(robot.simulation.baseVelocity[0] > 0.2);
  data.qvel[0] = NaN; // a trunk that is high and level
  assert.equal(robot.simulation.fallen, true);
});

test("when a tour is over, or somebody takes over, its hands let go", () => {
  const events = [[0, "stick", [60, 0, 0]], [5, "pull", [0, 0, 0, 500, 0, 300]]];
  session.begin({ seed: 1, task: 0, events: [...events, [10, "end", []]] });
  wait(0.22);
  assert.deepEqual([session.stick, session.pulled], [[0, 0, 0], null]);
  const { tour } = session;
  session.begin({ ...tour, events: [...events, [50, "end", []]] });
  wait(0.2);
  assert.notEqual(session.pulled, null);
  session.move("button", [1]);
  assert.deepEqual([session.stick, session.pulled, session.replaying], [[0, 0, 0], null, false]);
});

test("of a drag only what the next control period feels is written down", () => {
  session.begin({ seed: 1, task: 0 });
  for (const x of [500, 510, 520]) {
    session.move("pull", [0, 0, 0, x, 0, 300]);
    session.move("stick", [x / 10, 0, 0]);
  }
  session.move("button", [1]);
  wait(0.02);
  session.move("pull", [0, 0, 0, 520, 0, 300]); // as before
  session.move("release", []);
  session.move("release", []);
  const last = [[0, "pull", [0, 0, 0, 520, 0, 300]], [0, "stick", [52, 0, 0]], [0, "button", [1]], [1, "release", []]];
  assert.deepEqual(session.tour.events, [...last, [1, "end", []]]);
});

test("after ten minutes nothing is written down any more, and the tour says so", () => {
  session.begin({ seed: 1, task: 0 });
  session.step = 29999;
  session.move("stick", [10, 0, 0]);
  session.step = 30000;
  session.move("stick", [20, 0, 0]);
  assert.equal(session.full, false);
  session.step = 30001;
  assert.deepEqual([session.full, session.tour.events], [true, [[29999, "stick", [10, 0, 0]], [30000, "end", []]]]);
  session.begin(decode(encode({ ...session.tour, weights: WEIGHTS })));
});

test("a pull moves the robot its way, and is over when it is let go", () => {
  session.begin({ seed: 1, task: 0 });
  wait(0.5);
  session.move("pull", [0, 0, 0, 0, 300, 300]);
  wait(0.3);
  assert.ok(robot.simulation.data.qvel[1] > 0.1);
  session.move("release", []);
  wait(0.02);
  assert.ok(robot.simulation.data.xfrc_applied.every((value) => value === 0));
  wait(2);
  assert.equal(session.falls, 0);
});

test("a push goes where it was aimed, half as hard as the expert bears", () => {
  session.begin({ seed: 1, task: 0 });
  wait(0.5);
  const [forward, backward, sideways] = constants.tasks.trot.push_limit;
  for (const [angle, limit] of [[0, forward], [Math.PI, backward], [Math.PI / 2, sideways], [-Math.PI / 2, sideways]]) {
    assert.ok(Math.abs(largestPush(constants.tasks.trot, angle) - limit) < 1e-9);
    const { data, yaw } = robot.simulation, before = Array.from(data.qvel.slice(0, 2)), aim = angle + yaw;
    session.move("push", [Math.round(1000 * aim), 50]);
    assert.ok(Math.abs(data.qvel[0] - before[0] - 0.5 * limit * Math.cos(aim)) < 2e-3);
    assert.ok(Math.abs(data.qvel[1] - before[1] - 0.5 * limit * Math.sin(aim)) < 2e-3);
  }
  const diagonal = largestPush({ push_limit: [3, 1, 4] }, Math.atan2(4, 3));
  assert.ok(Math.abs(diagonal - 5 / Math.SQRT2) < 1e-9, "(3, 4) / sqrt(2) lies on the ellipse of 3 and 4");
  assert.equal(largestPush({ push_limit: [0, 1, 1] }, 0), 0);
});

test("a tour through a gait that there is not is refused, and nothing is changed", () => {
  session.begin({ seed: 1, task: 0 });
  assert.throws(() => session.begin({ seed: 2, task: 0, events: [[10, "button", [6]]] }), /number 6 of trot, bound/);
  assert.throws(() => session.begin({ seed: 2, task: 7 }), /number 7 of trot/);
  assert.throws(() => session.begin({ seed: 2, task: 0, events: [[0, "policy", [2]]] }), /number 2 of multi_head/);
  assert.equal(session.start.seed, 1);
});

test("a gait whose network is on its way holds a tour up", () => {
  const heads = robot.controller.student?.heads ?? session.controllers.multi_head.student.heads;
  const { walk } = heads;
  delete heads.walk;
  session.begin({ seed: 1, task: 0, events: [[10, "button", [3]], [20, "end", []]] });
  wait(0.2);
  assert.equal(session.tick(), false);
  heads.walk = walk;
  wait(0.5);
  assert.equal(robot.episode.requestedTask.gait.name, "walk");
});

test("a gait whose network will never come is left out, by a tour and by hands", () => {
  const { heads } = session.controllers.multi_head.student, { walk } = heads;
  delete heads.walk;
  session.complete = true;
  try {
    for (const punctual of [true, false]) {
      session.begin({ seed: 1, task: 0, events: [[10, "button", [3]], [20, "stick", [30, 0, 0]]], punctual });
      wait(0.5);
      assert.deepEqual([session.step, robot.episode.requestedTask.gait.name, session.stick], [25, "trot", [30, 0, 0]]);
    }
    assert.equal(session.move("button", [3]), false);
    assert.equal(session.move("button", [1]), true);
    wait(0.1);
  } finally {
    heads.walk = walk;
    session.complete = false;
  }
});

test("the demonstration goes on without a network that is on its way, and is late", () => {
  const { heads } = session.controllers.multi_head.student, { walk } = heads;
  delete heads.walk;
  session.begin({ seed: 1, task: 0, events: [[10, "button", [3]], [20, "stick", [10, 0, 0]]], punctual: false });
  wait(1);
  assert.deepEqual([session.step, session.replayed.map(([step]) => step)], [50, [50, 60]]);
  heads.walk = walk;
  wait(0.22);
  assert.deepEqual(session.tour.events.map(([step, kind]) => [step, kind]), [[50, "button"], [60, "stick"], [61, "end"]]);
});
