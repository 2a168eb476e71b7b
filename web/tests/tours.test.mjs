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

let apart = 0;
tours.forEach((plan, number) => {
  test(`tour ${number}: ${plan.seconds} s from ${plan.task} on`, (t) => {
    const survivalS = drive(plan);
    const distance = Math.hypot(...[0, 1].map((i) => robot.simulation.data.qpos[i] - plan.qpos[i]));
    t.diagnostic(`${survivalS} s here, ${plan.survival_s} s in Python, ${distance.toExponential(1)} m apart at the end`);
    apart += distance < 0.01;
    assert.equal(robot.simulation.fallen, plan.fallen);
  });
});
test("tours in which nothing is left to chance end at the same place", (t) => {
  t.diagnostic(`${apart} of ${tours.length} within 1 cm`);
  assert.ok(apart >= tours.length / 2);
});
