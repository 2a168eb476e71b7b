/** What the worker fetches, when some of it is not there. */
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { basename } from "node:path";
import test from "node:test";

import { Loading } from "../src/loading.js";
import { constants, dataFile } from "./load.mjs";

const BASE = "http://localhost/";
const TASKS = Object.keys(constants.tasks);
const wasm = createRequire(import.meta.url).resolve("@mujoco/mujoco/mujoco.wasm");
const headOf = (task) => basename(constants.policies.multi_head.heads[task].file);

/** Let `fetch` find the files but for some; `broken` are cut off, and `unreachable` throws as it does without a network. */
function hostWithout(names, { broken = [], unreachable = [] } = {}) {
  globalThis.fetch = async ({ pathname }) => {
    const name = basename(pathname);
    if (unreachable.includes(name)) throw new TypeError("Failed to fetch");
    if (names.includes(name)) return new Response("no", { status: 404, statusText: "Not Found" });
    const bytes = readFileSync(name === "mujoco.wasm" ? wasm : dataFile(pathname.slice(1)));
    return new Response(broken.includes(name) ? bytes.subarray(8) : bytes);
  };
}

/** Load all; returns the session, what came and what did not. */
async function load(tasks) {
  const loading = new Loading(BASE), came = [], missing = [];
  const session = await loading.session(tasks);
  await loading.rest(TASKS, (kind, name) => came.push(name), (kind, name, message) => missing.push([kind, name, message]));
  return { session, came, missing };
}

test("a network that is missing, cut off or out of reach keeps none that follows, and is named", async () => {
  hostWithout([headOf("bound")], { broken: [headOf("jump")], unreachable: [headOf("pace")] });
  const { session, came, missing } = await load(["trot"]);
  assert.deepEqual(came, ["walk", "gallop", "phase_free"]);
  assert.deepEqual(missing.map(([kind, name]) => [kind, name]), [["gait", "bound"], ["gait", "jump"], ["gait", "pace"]]);
  const [bound, jump, pace] = missing.map(([, , message]) => message);
  assert.match(bound, new RegExp(`${headOf("bound")}: 404 Not Found`));
  assert.match(jump, new RegExp(`${headOf("jump")}: \\d+ bytes were expected, got`));
  assert.match(pace, new RegExp(`${headOf("pace")}: Failed to fetch`));
  assert.deepEqual(TASKS.filter((name) => session.isReady(name)), ["trot", "walk", "gallop"]);
});

test("without the first gait's network the robot begins in another", async () => {
  hostWithout([headOf("trot")]);
  const { session, came, missing } = await load(["trot", "bound"]);
  assert.deepEqual([session.isReady("trot"), session.isReady("bound")], [false, true]);
  assert.deepEqual([came.length, missing[0][1]], [5, "trot"]);
});

test("without the estimator all gaits are there", async () => {
  const { file } = constants.policies.phase_free.estimator.weights;
  hostWithout([basename(file)]);
  const { came, missing } = await load(["trot"]);
  assert.deepEqual([came, missing], [TASKS.slice(1), [["policy", "phase_free", `${file}: 404 Not Found`]]]);
});

test("what nothing works without fails by its name", async () => {
  for (const name of ["constants.json", "mujoco.wasm", "go1.xml", basename(constants.policies.multi_head.shared.file)]) {
    hostWithout([name]);
    await assert.rejects(() => load(["trot"]), new RegExp(`${name}: 404 Not Found`));
  }
});
