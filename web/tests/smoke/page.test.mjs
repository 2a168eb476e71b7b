/** The built page in a real browser: keys, buttons, dragging, touch, links. Needs a Chromium. */
import assert from "node:assert/strict";
import { cpSync, mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test, { after, before } from "node:test";
import { fileURLToPath } from "node:url";
import puppeteer from "puppeteer-core";

import { serve, SITE } from "../../serve.mjs";
import { encode } from "../../src/tour_code.js";
import { readJson } from "../load.mjs";
import { browserOptions, chromium } from "./chromium.mjs";

const pictures = fileURLToPath(new URL("../../build/pictures/", import.meta.url));
const skip = chromium === undefined ? "no Chromium on this machine" : false;
const PATIENCE_MS = 1000 * Number(process.env.PATIENCE_S ?? 60); // of every wait: software draws slowly
let server, browser, address, errors;
const folders = [];

/** A copy of the site in which these files are missing. */
function site(...missing) {
  const folder = mkdtempSync(join(tmpdir(), "go1-page-"));
  folders.push(folder);
  cpSync(SITE, folder, { recursive: true });
  for (const file of missing) rmSync(join(folder, file));
  return folder;
}

before(async () => {
  if (skip) return;
  mkdirSync(pictures, { recursive: true });
  server = await serve();
  address = `http://127.0.0.1:${server.address().port}/`;
  browser = await puppeteer.launch({ ...browserOptions(), protocolTimeout: 3 * PATIENCE_MS });
});
after(async () => {
  await browser?.close();
  server?.close();
  for (const folder of folders) rmSync(folder, { recursive: true });
});

/** A page that was opened, with its robot in motion; `prepare` runs in it first. */
async function open({ path = "", viewport = { width: 740, height: 500 }, calm = false, prepare = listen } = {}) {
  errors = [];
  const page = await browser.newPage();
  page.on("pageerror", (error) => errors.push(error.message));
  page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
  await page.setViewport(viewport);
  if (calm) await page.emulateMediaFeatures([{ name: "prefers-reduced-motion", value: "reduce" }]);
  await page.evaluateOnNewDocument(prepare);
  await page.goto(path.startsWith("http") ? path : address + path, { timeout: PATIENCE_MS });
  await until(page, () => document.getElementById("gait").textContent.trim() !== "");
  return page;
}

const until = (page, condition, ...values) => page.waitForFunction(condition, { timeout: PATIENCE_MS, polling: 100 }, ...values);
const text = (page, id) => page.$eval(`#${id}`, (element) => element.textContent.trim());

/** Wait for a gait's network and for the gait itself. */
async function choose(page, key, gait) {
  await until(page, (name) => !document.getElementById(`gait-${name}`).disabled, gait);
  await page.keyboard.press(key);
  await until(page, (name) => document.getElementById("gait").textContent === name, gait);
}

/** In the page: keep what the worker says of the robot, however seldom the page is drawn. */
function listen() {
  const forget = () => ({ low: [0, 0, 0], high: [0, 0, 0], mean: [0, 0, 0], falls: 0, pulls: 0, steps: 0 });
  window.seen = forget();
  window.forget = () => (window.seen = forget());
  window.Worker = class extends Worker {
    constructor(...how) {
      super(...how);
      this.addEventListener("message", ({ data }) => {
        if (data.type !== "step") return;
        const { seen } = window;
        seen.mean = seen.mean.map((value, i) => value + 0.08 * (data.velocity[i] - value));
        seen.low = seen.low.map((value, i) => Math.min(value, seen.mean[i]));
        seen.high = seen.high.map((value, i) => Math.max(value, seen.mean[i]));
        seen.falls = data.falls;
        seen.steps += 1;
        seen.pulls += data.pulled !== null;
      });
    }
  };
}

/** Wait until the robot's mean velocity has been beyond a level: 0 forward, 1 left, 2 turning. */
async function moving(page, axis, level) {
  await page.evaluate(() => window.forget());
  await until(page, (i, limit) => (limit < 0 ? window.seen.low[i] < limit : window.seen.high[i] > limit), axis, level);
}

async function done(page, name) {
  await page.screenshot({ path: `${pictures}${name}.png` });
  await page.close();
  assert.deepEqual(errors, []);
}

test("keys drive it, numbers change its gait", { skip }, async (t) => {
  const page = await open();
  const loaded = await page.evaluate(() => performance.getEntriesByName("first motion")[0].startTime);
  t.diagnostic(`first motion ${(loaded / 1000).toFixed(1)} s after the page was asked for`);
  assert.match(await text(page, "message"), /Demonstration/);
  await page.keyboard.down("w");
  await until(page, () => document.getElementById("message").textContent === "");
  await moving(page, 0, 0.6);
  await choose(page, "4", "walk");
  await page.keyboard.up("w");
  await page.keyboard.down("ArrowLeft");
  await moving(page, 2, 0.4);
  await page.keyboard.up("ArrowLeft");
  await page.keyboard.down("e");
  await moving(page, 1, -0.15);
  await page.keyboard.up("e");
  const rate = Number((await text(page, "rate")).slice(2));
  t.diagnostic(`${rate} x real time`);
  assert.ok(rate > 0.3);
  await done(page, "desktop");
});

test("pause stops time, slow motion slows it, reset begins anew", { skip }, async () => {
  const page = await open();
  const rate = (low, high) => until(page, (a, b) => {
    const value = Number(document.getElementById("rate").textContent.slice(2));
    return a <= value && value <= b;
  }, low, high);
  await page.keyboard.press("Space");
  await rate(0, 0);
  const steps = await page.evaluate(async () => {
    for (let before = -1; before !== window.seen.steps; await new Promise((wake) => setTimeout(wake, 500))) {
      before = window.seen.steps; // a step may have been under way
    }
    return window.seen.steps;
  });
  await page.keyboard.press("n");
  await until(page, (before) => window.seen.steps === before + 1, steps);
  await page.keyboard.press("-");
  await page.keyboard.press("-");
  assert.equal(await text(page, "speed"), "0.25 ×");
  await page.click("#pause");
  await rate(0.1, 0.3);
  await page.keyboard.press("=");
  await page.keyboard.press("=");
  assert.equal(await text(page, "speed"), "1 ×");
  await page.keyboard.press("r");
  await until(page, () => document.getElementById("message").textContent === "");
  await done(page, "reset");
});

test("dragging the robot pushes it", { skip }, async () => {
  const page = await open();
  await page.keyboard.press("r");
  await until(page, () => document.querySelectorAll(".wanted td")[0].textContent === "0.00");
  await page.evaluate(() => window.forget());
  await page.mouse.move(370, 241);
  await page.mouse.down();
  await page.mouse.move(560, 160, { steps: 3 });
  await until(page, () => window.seen.pulls > 0 && (window.seen.falls > 0 || Math.max(...window.seen.high.slice(0, 2), ...window.seen.low.slice(0, 2).map(Math.abs)) > 0.03));
  await page.mouse.up();
  await until(page, () => !document.getElementById("view").className.includes("pulling"));
  await done(page, "pushed");
});

test("a key pushes it away from the camera", { skip }, async () => {
  const page = await open();
  await page.keyboard.press("r");
  await until(page, () => document.querySelectorAll(".wanted td")[0].textContent === "0.00");
  await page.keyboard.press("c");
  assert.equal(await page.$eval("#camera", (select) => select.value), "follow");
  await page.evaluate(() => window.forget());
  await page.keyboard.press("p"); // the camera stands behind it, on its right
  await until(page, () => window.seen.high[0] > 0.05 && window.seen.high[1] > 0.05);
  await done(page, "key_push");
});

test("who asks for little motion sees a robot that stands", { skip }, async () => {
  const page = await open({ calm: true });
  assert.match(await text(page, "message"), /little motion/);
  assert.equal(await page.$eval("#camera", (select) => select.value), "follow");
  await page.keyboard.press("l");
  await until(page, () => location.hash.startsWith("#tour="));
  await done(page, "calm");
});

test("a button that Tab reached is pressed by Space, and names itself", { skip }, async () => {
  const page = await open();
  await page.focus("#help");
  await page.keyboard.press("Space");
  await until(page, () => document.getElementById("keys").open);
  const nameless = await page.evaluate(() => [...document.querySelectorAll("button, select, canvas")].filter((each) => !each.textContent.trim() && !each.getAttribute("aria-label")).map((each) => each.id));
  assert.deepEqual(nameless, []);
  assert.equal(await text(page, "state"), "", "Space did not pause as well");
  await page.keyboard.press("w"); // a key that drives closes it
  await until(page, () => !document.getElementById("keys").open);
  await done(page, "focus");
});

test("the student without a clock takes over", { skip }, async () => {
  const page = await open();
  await until(page, () => !document.getElementById("policy").options[1].disabled);
  await page.keyboard.press("t");
  await page.keyboard.press("g");
  assert.equal(await page.$eval("#compare", (select) => select.value), "expert");
  await page.keyboard.down("w");
  await moving(page, 0, 0.6);
  assert.equal(await page.$eval("#policy", (select) => select.value), "phase_free");
  await done(page, "phase_free");
});

test("a link drives the same tour", { skip }, async () => {
  const page = await open();
  await page.keyboard.press("r");
  await page.keyboard.down("w");
  await moving(page, 0, 0.4);
  await new Promise((resolve) => setTimeout(resolve, 3000)); // long enough to be seen when it is driven again
  await page.keyboard.up("w");
  await page.keyboard.press("l");
  await until(page, () => location.hash.startsWith("#tour="));
  const hash = await page.evaluate(() => location.hash);
  await page.close();
  const other = await open({ path: hash });
  assert.match(await text(other, "message"), /A tour from a link/);
  await moving(other, 0, 0.4);
  await done(other, "link");
});

test("a link to a gait that there is not shows the demonstration", { skip }, async () => {
  const code = encode({ weights: "000000", seed: 1, task: 99, events: [[100, "end", []]] });
  const page = await open({ path: `#tour=${code}` });
  assert.match(await text(page, "message"), /no tour that this page can drive: .*number 99 of trot.*; here is the demonstration/);
  await until(page, () => Number(document.querySelectorAll(".wanted td")[0].textContent) > 0.1);
  await done(page, "broken_link");
});

test("a page that cannot start says what is missing and what to do", { skip }, async () => {
  const withoutWebGl = () => {
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, ...how) {
      return kind.startsWith("webgl") ? null : getContext.call(this, kind, ...how);
    };
  };
  const brokenWorker = () => {
    window.Worker = class extends Worker {
      constructor() {
        super(URL.createObjectURL(new Blob(["throw new Error('broken')"])));
      }
    };
  };
  const cases = [
    [site(), withoutWebGl, /draws with WebGL 2.*Switch on hardware acceleration/],
    [site(), brokenWorker, /physics has stopped \(.*broken\)\. Load the page again/],
    [site("worker.js"), () => {}, /physics could not start: worker\.js did not come.*load the page again/],
    [site("page.js"), () => {}, /page\.js could not be loaded.*load the page again/],
    [site("main.js"), () => {}, /main\.js did not come.*load the page again/],
    [site("constants.json"), () => {}, /could not be loaded \(constants\.json: 404 Not Found\).*load the page again/],
  ];
  for (const [folder, prepare, sentence] of cases) {
    const host = await serve(0, folder), page = await browser.newPage();
    await page.evaluateOnNewDocument(prepare);
    await page.goto(`http://127.0.0.1:${host.address().port}/`, { timeout: PATIENCE_MS });
    await until(page, () => document.getElementById("message").classList.contains("error"));
    assert.match(await text(page, "message"), sentence);
    await page.close();
    host.close();
  }
});

test("gaits whose networks are missing are named, the others can be driven", { skip }, async () => {
  const { heads } = readJson(`${SITE}/constants.json`).policies.multi_head;
  const host = await serve(0, site(heads.bound.file, heads.pace.file));
  const forbidden = () => {
    navigator.getGamepads = () => { throw new DOMException("blocked by permissions policy", "SecurityError"); };
  };
  const page = await open({ path: `http://127.0.0.1:${host.address().port}/`, prepare: forbidden });
  await until(page, () => document.querySelectorAll("button.missing").length === 2);
  assert.match(await text(page, "message"), /Without bound, pace: .*404 Not Found/);
  await page.screenshot({ path: `${pictures}missing_gaits.png` });
  await until(page, () => !document.getElementById("policy").options[1].disabled);
  await choose(page, "6", "gallop");
  assert.deepEqual(await page.$$eval("#gaits button:disabled", (buttons) => buttons.map(({ id }) => id)), ["gait-bound", "gait-pace"]);
  host.close();
  await page.close();
  assert.deepEqual(errors.filter((error) => !error.includes("404")), []);
});

test("fingers drive it on a phone", { skip }, async () => {
  const page = await open({ viewport: { width: 390, height: 844, deviceScaleFactor: 1, isMobile: true, hasTouch: true } });
  const box = await (await page.$("#left")).boundingBox();
  const finger = await page.touchscreen.touchStart(box.x + box.width / 2, box.y + box.height / 2);
  await finger.move(box.x + box.width / 2, box.y + 4);
  await moving(page, 0, 0.6);
  await page.screenshot({ path: `${pictures}phone.png` });
  await finger.end();
  await until(page, () => Math.abs(Number(document.querySelectorAll(".wanted td")[0].textContent.replace("−", "-"))) < 0.05);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);
  assert.ok(wide);
  await done(page, "phone_end");
});

test("the help opens and closes", { skip }, async () => {
  const page = await open();
  await page.keyboard.press("h");
  await until(page, () => document.getElementById("keys").open);
  await page.screenshot({ path: `${pictures}help.png` });
  for (const key of ["Escape", "h"]) {
    await page.keyboard.press(key);
    await until(page, () => !document.getElementById("keys").open);
    if (key === "Escape") await page.keyboard.press("h");
  }
  await done(page, "help_closed");
});
