/** The built page in a real browser: keys, buttons, dragging, touch, links. Needs a Chromium; CHROMIUM names another. */
import assert from "node:assert/strict";
import { existsSync, mkdirSync } from "node:fs";
import test, { after, before } from "node:test";
import { fileURLToPath } from "node:url";
import puppeteer from "puppeteer-core";

import { serve } from "../../serve.mjs";

const chromium = process.env.CHROMIUM ?? ["/usr/bin/chromium", "/usr/bin/google-chrome", "/usr/bin/chromium-browser"].find(existsSync);
const pictures = fileURLToPath(new URL("../../build/pictures/", import.meta.url));
const skip = chromium === undefined ? "no Chromium on this machine" : false;
const GPU = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];
const PATIENCE_MS = 60000;
let server, browser, address, errors;

before(async () => {
  if (skip) return;
  mkdirSync(pictures, { recursive: true });
  server = await serve();
  address = `http://127.0.0.1:${server.address().port}/`;
  browser = await puppeteer.launch({ executablePath: chromium, headless: true, protocolTimeout: 180000, args: ["--no-sandbox", ...GPU] });
});
after(async () => {
  await browser?.close();
  server?.close();
});

/** A page that was opened, with its robot in motion. */
async function open({ path = "", viewport = { width: 740, height: 480 } } = {}) {
  errors = [];
  const page = await browser.newPage();
  page.on("pageerror", (error) => errors.push(error.message));
  page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
  await page.setViewport(viewport);
  await page.evaluateOnNewDocument(listen);
  await page.goto(address + path, { timeout: PATIENCE_MS });
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
  const forget = () => ({ low: [0, 0, 0], high: [0, 0, 0], mean: [0, 0, 0], falls: 0, pulls: 0 });
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
  await page.keyboard.down("d");
  await moving(page, 1, -0.15);
  await page.keyboard.up("d");
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
  await page.keyboard.press("t");
  await page.click("#pause");
  await rate(0.1, 0.3);
  await page.keyboard.press("t");
  await page.keyboard.press("r");
  await until(page, () => document.getElementById("message").textContent === "");
  await done(page, "reset");
});

test("dragging the robot pushes it", { skip }, async () => {
  const page = await open();
  await page.keyboard.press("r");
  await until(page, () => document.querySelectorAll(".wanted td")[0].textContent === "0.00");
  await page.evaluate(() => window.forget());
  await page.mouse.move(370, 232);
  await page.mouse.down();
  await page.mouse.move(560, 160, { steps: 3 });
  await until(page, () => window.seen.pulls > 0 && (window.seen.falls > 0 || Math.max(...window.seen.high.slice(0, 2), ...window.seen.low.slice(0, 2).map(Math.abs)) > 0.03));
  await page.mouse.up();
  await until(page, () => !document.getElementById("view").className.includes("pulling"));
  await done(page, "pushed");
});

test("the student without a clock takes over", { skip }, async () => {
  const page = await open();
  await until(page, () => !document.getElementById("policy").options[1].disabled);
  await page.select("#policy", "1");
  await page.select("#compare", "expert");
  await page.keyboard.down("w");
  await moving(page, 0, 0.6);
  assert.equal(await page.$eval("#policy", (select) => select.value), "1");
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
  const broken = await open({ path: "#tour=x!" });
  assert.match(await text(broken, "message"), /no tour; here is the demonstration/);
  await done(broken, "broken_link");
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
  await page.keyboard.press("Escape");
  await until(page, () => !document.getElementById("keys").open);
  await done(page, "help_closed");
});
