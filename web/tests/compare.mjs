/** The page's robot beside what Python's did: drives from the same states, drives of its own, and operator tours. */
import { OperatorTour } from "../src/operator.js";
import { constants } from "./load.mjs";
import { drive } from "./script.mjs";

/** Largest absolute difference of numbers. */
export function distance(first, second) {
  if (first.length !== second.length) throw new Error(`${second.length} numbers were expected, got ${first.length}`);
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

/** Largest differences of observation and action, every step from Python's state. */
export function compareSteps(robot, given) {
  let observation = 0, action = 0;
  follow(robot, given, (i) => {
    observation = Math.max(observation, distance(robot.controller.observation, given.observations[i]));
    action = Math.max(action, distance(robot.controller.act(), given.actions[i]));
    robot.simulation.state = given.states[i]; // physics is chaotic: what rounding makes of it is not for here
    robot.apply(given.actions[i]);
  });
  return { observation, action };
}

/** How far apart the robots end [m] when the page's own network drives, and whether it fell. */
export function compareEnd(robot, given) {
  follow(robot, given, () => robot.step());
  return { apartM: distance(robot.simulation.data.qpos.slice(0, 3), given.qpos.slice(0, 3)), fallen: robot.simulation.fallen };
}

/** Drive an operator's tour to its end or to the fall; returns the time of it [s], and whether it fell. */
export function driveTour(robot, plan) {
  const tour = new OperatorTour(plan), steps = Math.round(plan.seconds * constants.control_hz);
  tour.begin(robot);
  for (let step = 1; step <= steps; step++) {
    tour.drive(robot);
    robot.step();
    if (robot.simulation.fallen) return { survivalS: step / constants.control_hz, fallen: true };
  }
  return { survivalS: plan.seconds, fallen: false };
}
