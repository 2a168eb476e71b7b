/** Operator tours through the page's own code, and Python's verdicts on the same ones. */
import assert from "node:assert/strict";
import test from "node:test";

import { driveTour } from "./compare.mjs";
import { makeRobot, readReference } from "./load.mjs";

const robot = await makeRobot();
const tours = readReference("tours.json");

for (const [number, plan] of tours.entries()) {
  test(`tour ${number}: ${plan.seconds} s from ${plan.task} on`, (t) => {
    const { survivalS, fallen } = driveTour(robot, plan), { qpos } = robot.simulation.data;
    assert.equal(fallen, plan.fallen, `fell after ${survivalS} s`);
    if (plan.qpos === null) return;
    const apart = Math.hypot(qpos[0] - plan.qpos[0], qpos[1] - plan.qpos[1]);
    t.diagnostic(`${apart.toFixed(3)} m apart at the end`); // physics is chaotic: rounding grows over 90 s
    assert.ok(plan.fallen || apart < 1);
  });
}
