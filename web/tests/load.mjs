/** The page's own modules in node, on the data that Python wrote. */
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { fileURLToPath } from "node:url";
import { join } from "node:path";

import { Clocked, PhaseFree } from "../src/controllers.js";
import { loadModule } from "../src/mujoco_module.js";
import { PhaseEstimator, Student } from "../src/network.js";
import { Robot } from "../src/robot.js";
import { Simulation } from "../src/simulation.js";

const root = fileURLToPath(new URL("..", import.meta.url));
const data = process.env.WEB_DATA ?? join(root, "build", "data");
const reference = process.env.WEB_REFERENCE ?? join(root, "build", "reference");

export const constants = readJson(join(data, "constants.json"));

export function readJson(path) {
  return JSON.parse(readFileSync(path, "utf8"));
}

/** What Python wrote for comparison. */
export function readReference(name) {
  return readJson(join(reference, name));
}

/** Where a file of the page's data lies. */
export const dataFile = (file) => join(data, file);

function buffer(file) {
  const bytes = readFileSync(dataFile(file));
  return bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
}

export function loadStudent(policy) {
  const student = new Student(policy, buffer(policy.shared.file));
  for (const [task, head] of Object.entries(policy.heads)) student.addHead(task, buffer(head.file));
  return student;
}

/** The controller of a kind of policy. */
export function makeController(kind) {
  const policy = constants.policies[kind];
  if (kind === "multi_head") return new Clocked(constants, loadStudent(policy));
  const estimator = new PhaseEstimator(policy.estimator, buffer(policy.estimator.weights.file));
  const controller = new PhaseFree(constants, policy);
  controller.load(loadStudent(policy.student), estimator);
  return controller;
}

/** A simulation of the robot. */
export async function makeSimulation() {
  const wasm = createRequire(import.meta.url).resolve("@mujoco/mujoco/mujoco.wasm");
  const mj = await loadModule(await WebAssembly.compile(readFileSync(wasm)));
  const files = Object.fromEntries(
    ["go1.xml", "scene.xml"].map((name) => [name, readFileSync(join(data, "model", name), "utf8")]),
  );
  return new Simulation(mj, files, constants);
}

export async function makeRobot(kind = "multi_head") {
  return new Robot(await makeSimulation(), makeController(kind));
}
