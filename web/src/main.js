/** The page: connects what a visitor touches and sees with the robot in the worker. */
import { stance } from "./gait_clock.js";
import { Playback } from "./playback.js";
import { Plots } from "./plots.js";
import { View } from "./scene.js";
import { isStickKey, Stick, touchStick } from "./stick.js";
import { decode, encode, isOf } from "./tour_code.js";

const SLOW = 0.25;
const element = (id) => document.getElementById(id);
const worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
const view = new View(element("view"));
const playback = new Playback(), stick = new Stick();
const page = { constants: null, tasks: [], latest: null, plots: null, paused: false, slow: false, demo: false, weights: "", sent: [0, 0, 0], grabbed: null };

// -- Beginning ----------------------------------------------------------------------------------------------------------

const shared = sharedTour();
page.demo = shared === null;
worker.postMessage({ type: "start", base: document.baseURI, begin: shared ?? { demo: true } });
worker.onmessage = ({ data }) => messages[data.type](data);
worker.onerror = (event) => say(`This page cannot run here: ${event.message ?? "its worker did not start"}`, true);
requestAnimationFrame(draw);

/** The tour in the page's address, or null. */
function sharedTour() {
  const text = new URLSearchParams(location.hash.slice(1)).get("tour");
  try {
    return text === null ? null : decode(text);
  } catch (error) {
    say(`${error.message}; here is the demonstration instead.`, true);
    return null;
  }
}

const messages = {
  ready({ constants, geometry, weights }) {
    Object.assign(page, { constants, weights, tasks: Object.keys(constants.tasks) });
    view.build(geometry);
    page.plots = new Plots(element("strip"), element("plot"), constants.robot.legs, constants.control_hz);
    page.tasks.forEach(addGaitButton);
    const first = page.demo ? constants.default_tour.moves[0].task : page.tasks[shared.task];
    messages.gait({ name: first });
    if (constants.footfalls === undefined) element("compare").closest("label").remove();
    if (element("message").classList.contains("error")) return; // a link that could not be read
    if (page.demo) say("Demonstration. Touch a stick, a key or a gait to take over.");
    else say(isOf(shared, weights) ? "A tour from a link: touch anything to take over." : "This tour was driven with another network: it may go elsewhere.");
  },
  gait: ({ name }) => (element(`gait-${name}`).disabled = false),
  policy: () => (element("policy").options[1].disabled = false),
  step: (report) => takeStep(report),
  tour: ({ tour, full }) => share(tour, full),
  error: ({ message }) => say(message, true),
};

function takeStep(report) {
  const before = page.latest;
  page.latest = report;
  if (before === null) performance.mark("first motion");
  if (before === null || report.step <= before.step) {
    playback.clear();
    page.plots.clear();
    page.snap = true;
  }
  if (before !== null && before.fallen && !report.fallen) page.snap = true; // it stands at the origin again
  if (page.snap) playback.clear();
  playback.add(report.frames);
  const { gait } = page.constants.tasks[report.task];
  const planned = element("compare")?.value === "expert" ? expertContacts(report) : stance(gait, report.phase);
  page.plots.add({ contacts: report.contacts, planned, command: report.command, velocity: report.velocity });
  if (page.demo && before?.replaying && !report.replaying) begin({ demo: true });
}

/** Which feet the expert had on the ground at this phase of its recorded steps. */
function expertContacts({ task, phase }) {
  const bins = page.constants.footfalls[task];
  return bins[Math.min(Math.floor(phase * bins.length), bins.length - 1)].map(Boolean);
}

// -- Doing --------------------------------------------------------------------------------------------------------------

function begin(how) {
  page.sent = [0, 0, 0]; // a stick that is held is sent again
  worker.postMessage({ type: "begin", ...how });
}

/** A visitor's move: from now on nobody else drives. */
function move(kind, values) {
  takeOver();
  worker.postMessage({ type: "move", kind, values });
}

function takeOver() {
  if (page.demo) {
    page.demo = false;
    begin({ seed: randomSeed(), task: page.tasks.indexOf(page.latest?.requested ?? page.tasks[0]) });
  }
  say("");
}

const randomSeed = () => Math.floor(Math.random() * 65536);

function chooseGait(index) {
  const name = page.tasks[index];
  if (name === undefined || element(`gait-${name}`).disabled) return;
  move("button", [index]);
}

function nextGait(direction) {
  const count = page.tasks.length;
  if (page.latest) chooseGait((page.tasks.indexOf(page.latest.requested) + direction + count) % count);
}

function reset() {
  const { requested, policy } = page.latest ?? {};
  page.demo = false;
  say("");
  history.replaceState(null, "", location.pathname + location.search);
  begin({ seed: randomSeed(), task: Math.max(page.tasks.indexOf(requested), 0), policy: policy === "phase_free" ? 1 : 0 });
}

function setSpeed() {
  element("pause").setAttribute("aria-pressed", page.paused);
  element("slow").setAttribute("aria-pressed", page.slow);
  worker.postMessage({ type: "speed", speed: speed() });
}

function speed() {
  if (page.paused || document.hidden) return 0;
  return page.slow ? SLOW : 1;
}

/** Put the link to a tour into the address and the clipboard. */
async function share(tour, full) {
  const text = encode({ ...tour, weights: page.weights });
  history.replaceState(null, "", `#tour=${text}`);
  const seconds = (tour.events.at(-1)[0] / page.constants.control_hz).toFixed(0);
  const note = full ? " (its first ten minutes)" : "";
  try {
    await navigator.clipboard.writeText(location.href);
    say(`Copied: a link that drives these ${seconds} s again${note}.`);
  } catch {
    say(`The address is now a link that drives these ${seconds} s again${note}.`);
  }
}

function say(text, isError = false) {
  element("message").textContent = text;
  element("message").classList.toggle("error", isError);
}

// -- Touching -----------------------------------------------------------------------------------------------------------

const keys = {
  Space: () => element("pause").click(),
  KeyT: () => element("slow").click(),
  KeyR: reset,
  KeyL: () => element("link").click(),
  KeyH: () => element("help").click(),
};

window.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || element("keys").open || event.target.tagName === "SELECT") return;
  if (isStickKey(event.code)) stick.key(event.code, true, event.shiftKey);
  else if (/^(Digit|Numpad)[1-9]$/.test(event.code) && !event.repeat) chooseGait(Number(event.code.at(-1)) - 1);
  else if (event.code in keys && !event.repeat) {
    document.activeElement?.blur?.(); // or Space would press the button that has the focus as well
    keys[event.code]();
  } else if (event.key === "Shift") stick.slow = true;
  else return;
  event.preventDefault();
});
window.addEventListener("keyup", (event) => {
  if (event.key === "Shift") stick.slow = false;
  if (isStickKey(event.code)) stick.key(event.code, false, event.shiftKey);
});
window.addEventListener("hashchange", () => location.reload()); // another tour was pasted into the address
window.addEventListener("blur", () => stick.release());
document.addEventListener("visibilitychange", () => {
  stick.release();
  setSpeed();
});

function addGaitButton(name, index) {
  const button = document.createElement("button");
  button.id = `gait-${name}`;
  button.disabled = true;
  button.innerHTML = `<small>${index + 1}</small>${name}`;
  button.addEventListener("click", () => chooseGait(index));
  element("gaits").append(button);
}

element("pause").addEventListener("click", () => {
  page.paused = !page.paused;
  setSpeed();
});
element("slow").addEventListener("click", () => {
  page.slow = !page.slow;
  setSpeed();
});
element("reset").addEventListener("click", reset);
element("link").addEventListener("click", () => worker.postMessage({ type: "tour" }));
element("help").addEventListener("click", () => element("keys").showModal());
element("policy").addEventListener("change", ({ target }) => {
  move("policy", [Number(target.value)]);
  target.blur();
});
element("compare").addEventListener("change", ({ target }) => target.blur());
touchStick(element("left"), (right, up) => ([stick.touch[0], stick.touch[1]] = [up, -right]));
touchStick(element("right"), (right) => (stick.touch[2] = -right));

const canvas = element("view");
const pointer = (event) => [(2 * event.clientX) / window.innerWidth - 1, 1 - (2 * event.clientY) / window.innerHeight];

canvas.addEventListener("pointerdown", (event) => {
  const point = event.button === 0 ? view.grab(...pointer(event)) : null;
  if (point === null) return;
  event.stopImmediatePropagation(); // the camera stays
  canvas.setPointerCapture(event.pointerId);
  canvas.classList.add("pulling");
  page.grabbed = { point, at: pointer(event), id: event.pointerId };
}, { capture: true });
canvas.addEventListener("pointermove", (event) => {
  if (page.grabbed?.id === event.pointerId) page.grabbed.at = pointer(event);
  else if (event.pointerType === "mouse" && event.buttons === 0) canvas.classList.toggle("on-robot", view.grab(...pointer(event)) !== null);
});
for (const kind of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(kind, (event) => {
    if (page.grabbed?.id === event.pointerId) letGo();
  });
}

function letGo() {
  page.grabbed = null;
  canvas.classList.remove("pulling");
  move("release", []);
}

const padButtons = { 4: () => nextGait(-1), 5: () => nextGait(1), 9: () => element("pause").click(), 3: reset };
let padPressed = [];

function readPad() {
  const pad = navigator.getGamepads?.().find((each) => each !== null);
  stick.readPad(pad);
  const pressed = pad ? pad.buttons.map((button) => button.pressed) : [];
  for (const [index, act] of Object.entries(padButtons)) if (pressed[index] && !padPressed[index]) act();
  padPressed = pressed;
}

// -- Seeing -------------------------------------------------------------------------------------------------------------

let lastMs = performance.now(), rate = { ms: lastMs, step: 0, value: 1 };

function draw(nowMs) {
  requestAnimationFrame(draw);
  const elapsedS = (nowMs - lastMs) / 1000;
  lastMs = nowMs;
  fit();
  if (page.latest !== null) {
    readPad();
    sendStick();
    sendPull();
    const pose = playback.next(elapsedS * speed());
    if (pose !== null) view.place(pose, page.snap ? Infinity : elapsedS);
    page.snap = false;
    view.showString(page.latest.pulled);
    show(page.latest, nowMs, elapsedS);
    page.plots.draw();
  }
  view.draw();
}

/** Tell the worker where the stick is, if it was moved. */
function sendStick() {
  const percent = stick.percent;
  if (percent.every((value, i) => value === page.sent[i])) return;
  page.sent = percent;
  move("stick", percent);
}

/** Tell the worker where the robot is dragged to. */
function sendPull() {
  if (page.grabbed === null) return;
  if (page.latest.fallen) {
    letGo(); // or it would be torn over again as soon as it stands
    return;
  }
  const { point, at } = page.grabbed, millimeters = (vector) => vector.toArray().map((value) => Math.round(1000 * value));
  move("pull", [...millimeters(point), ...millimeters(view.pointAt(...at, point))]);
}

function show(report, nowMs, elapsedS) {
  element("gait").textContent = report.task;
  const change = report.requested === report.task ? "" : `→ ${report.requested}`;
  element("state").textContent = report.fallen ? "fallen" : page.paused ? "paused" : change;
  for (const name of page.tasks) {
    const button = element(`gait-${name}`);
    button.setAttribute("aria-pressed", name === report.task);
    button.classList.toggle("waiting", name === report.requested && name !== report.task);
  }
  element("policy").value = report.policy === "phase_free" ? "1" : "0";
  fill(".wanted", report.command);
  fill(".measured", smoothed(report.velocity, elapsedS));
  if (nowMs - rate.ms > 500) {
    const made = (report.step - rate.step) / page.constants.control_hz / ((nowMs - rate.ms) / 1000);
    rate = { ms: nowMs, step: report.step, value: made < 0 ? rate.value : made };
    element("rate").textContent = `× ${rate.value.toFixed(2)}`;
  }
}

let mean = [0, 0, 0];

/** Velocities without their shaking, to be read. */
function smoothed(velocity, elapsedS) {
  mean = mean.map((value, i) => value + (1 - Math.exp(-elapsedS / 0.25)) * (velocity[i] - value));
  return mean;
}

function fill(row, values) {
  document.querySelectorAll(`${row} td`).forEach((cell, i) => {
    const text = values[i].toFixed(2).replace("-0.00", "0.00").replace("-", "−");
    if (cell.textContent !== text) cell.textContent = text;
  });
}

let size = "";

function fit() {
  const now = `${window.innerWidth} ${window.innerHeight} ${window.devicePixelRatio}`;
  if (now === size) return;
  size = now;
  view.resize(window.innerWidth, window.innerHeight, window.devicePixelRatio);
}
