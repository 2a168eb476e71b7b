/** The page's robot against Python's: network, observation, and where it ends after seconds of driving. */
import assert from "node:assert/strict";
import test from "node:test";

import { drive } from "./script.mjs";
import { makeController, makeRobot, readReference } from "./load.mjs";

const POLICY = 1e-6, OBSERVATION = 1e-6, POSITION_M = 0.01;

/** Largest absolute difference of numbers. */
function distance(first, second) {
  assert.equal(first.length, second.length);
  let largest = 0;
  for (let i = 0; i < first.length; i++) largest = Math.max(largest, Math.abs(first[i] - second[i]));
  return largest;
}

/** Drive as the reference was driven; `step` makes one. */
function follow(robot, given, step) {
  const [[, task, command]] = given.moves;
  const [pushStep, push] = given.push;
  robot.reset(task, command, given.start);
  for (let i = 0; i < given.actions.length; i++) {
    drive(robot, given.moves, i);
    if (i === pushStep) robot.simulation.push(push);
    step(i);
  }
}

/** Name of the task in an observation. */
function taskOf(tasks, observation) {
  return tasks[Array.from(observation.slice(-tasks.length)).indexOf(1)];
}

for (const kind of ["multi_head", "phase_free"]) {
  const drives = readReference(`drives_${kind}.json`);
  const robot = await makeRobot(kind);

  for (const [name, given] of Object.entries(drives)) {
    test(`${kind}, ${name}: observation and action of every step from the same states`, (t) => {
      let seen = 0, done = 0;
      follow(robot, given, (i) => {
        seen = Math.max(seen, distance(robot.controller.observation, given.observations[i]));
        done = Math.max(done, distance(robot.controller.act(), given.actions[i]));
        robot.simulation.state = given.states[i]; // physics is chaotic: what rounding makes of it is not for here
        robot.apply(given.actions[i]);
      });
      t.diagnostic(`largest differences ${seen.toExponential(1)} and ${done.toExponential(1)}`);
      assert.ok(seen <= OBSERVATION, `observations differ by ${seen}`);
      assert.ok(done <= POLICY, `actions differ by ${done}`);
    });

    test(`${kind}, ${name}: where it ends when its own network drives`, (t) => {
      follow(robot, given, () => robot.step());
      const apart = distance(robot.simulation.data.qpos.slice(0, 3), given.qpos.slice(0, 3));
      t.diagnostic(`${apart.toExponential(1)} m apart after ${given.actions.length / 50} s`);
      assert.equal(robot.simulation.fallen, given.fallen);
      assert.ok(apart <= POSITION_M, `the robots end ${apart} m apart`);
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
