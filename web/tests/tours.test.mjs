/** Operator tours through the page's own code, and Python's verdicts on the same ones. */
import assert from "node:assert/strict";
import test from "node:test";

import { OperatorTour } from "../src/operator.js";
import { constants, makeRobot, readReference } from "./load.mjs";

const robot = await makeRobot();
const tours = readReference("tours.json");

/** Drive a tour to its end or to the fall; returns the time of it [s]. */
function drive(plan) {
  const tour = new OperatorTour(plan), steps = Math.round(plan.seconds * constants.control_hz);
  tour.begin(robot);
  for (let step = 1; step <= steps; step++) {
    tour.drive(robot);
    robot.step();
    if (robot.simulation.fallen) return step / constants.control_hz;
  }
  return plan.seconds;
}

for (const [number, plan] of tours.entries()) {
  test(`tour ${number}: ${plan.seconds} s from ${plan.task} on`, (t) => {
    const survivalS = drive(plan), { qpos } = robot.simulation.data;
    assert.equal(robot.simulation.fallen, plan.fallen, `fell after ${survivalS} s`);
    if (plan.qpos === null) return;
    const apart = Math.hypot(qpos[0] - plan.qpos[0], qpos[1] - plan.qpos[1]);
    t.diagnostic(`${apart.toFixed(3)} m apart at the end`); // physics is chaotic: rounding grows over 90 s
    assert.ok(plan.fallen || apart < 1);
  });
}
