/** The page's robot against Python's: network, observation, and where it ends after seconds of driving. */
import assert from "node:assert/strict";
import test from "node:test";

import { compareEnd, compareSteps, distance } from "./compare.mjs";
import { makeController, makeRobot, readReference } from "./load.mjs";

const POLICY = 1e-6, OBSERVATION = 1e-6, POSITION_M = 0.01;

/** Name of the task in an observation. */
function taskOf(tasks, observation) {
  return tasks[Array.from(observation.slice(-tasks.length)).indexOf(1)];
}

for (const kind of ["multi_head", "phase_free"]) {
  const drives = readReference(`drives_${kind}.json`);
  const robot = await makeRobot(kind);

  for (const [name, given] of Object.entries(drives)) {
    test(`${kind}, ${name}: observation and action of every step from the same states`, (t) => {
      const { observation, action } = compareSteps(robot, given);
      t.diagnostic(`largest differences ${observation.toExponential(1)} and ${action.toExponential(1)}`);
      assert.ok(observation <= OBSERVATION, `observations differ by ${observation}`);
      assert.ok(action <= POLICY, `actions differ by ${action}`);
    });

    test(`${kind}, ${name}: where it ends when its own network drives`, (t) => {
      const { apartM, fallen } = compareEnd(robot, given);
      t.diagnostic(`${apartM.toExponential(1)} m apart after ${given.actions.length / 50} s`);
      assert.equal(fallen, given.fallen);
      assert.ok(apartM <= POSITION_M, `the robots end ${apartM} m apart`);
    });
  }
}

test("actions for the same observations", (t) => {
  const { observer, student } = makeController("multi_head");
  let worst = 0;
  for (const { observations, actions } of Object.values(readReference("drives_multi_head.json"))) {
    for (const [i, action] of actions.entries()) {
      const observation = Float32Array.from(observations[i]);
      worst = Math.max(worst, distance(student.act(observation, taskOf(observer.tasks, observation)), action));
    }
  }
  t.diagnostic(`largest difference ${worst.toExponential(1)}`);
  assert.ok(worst <= POLICY, `actions differ by ${worst}`);
});
