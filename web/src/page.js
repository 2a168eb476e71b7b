/** The page: connects what a visitor touches and sees with the robot in the worker. */
import { Dragging } from "./dragging.js";
import { stance } from "./gait_clock.js";
import { Gamepad } from "./gamepad.js";
import { Keyboard, writeHelp } from "./keyboard.js";
import { fail, say } from "./message.js";
import { Pace } from "./pace.js";
import { Playback } from "./playback.js";
import { Plots } from "./plots.js";
import { Readouts } from "./readouts.js";
import { Remote } from "./remote.js";
import { View } from "./scene.js";
import { Stick } from "./stick.js";
import { touchStick } from "./touch_stick.js";

const PUSH = 50, HARD_PUSH = 100; // percent of the largest push that the expert bears
const element = (id) => document.getElementById(id);

export class Page {
  /**
   * @param worker that holds the robot.
   * @param started called when the robot is there.
   * @throws a sentence for the visitor if this browser cannot show it.
   */
  constructor(worker, started) {
    this.started = started;
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.remote = new Remote(worker, say, calm);
    this.view = new View(element("view"), calm);
    this.playback = new Playback();
    this.stick = new Stick();
    this.pace = new Pace();
    this.gamepad = new Gamepad(this.stick, this.actions);
    this.dragging = new Dragging(this.view, element("view"), () => this.remote.move("release", []));
    this.jumps = true; // whether the robot was put somewhere else since the last picture
    worker.onmessage = ({ data }) => this.#handlers[data.type](data);
    this.#listen();
    this.#fit();
    this.view.draw(); // the floor; until the robot comes the machine has better things to do
  }

  /** What the worker sends. */
  #handlers = {
    ready: (message) => this.#begin(message),
    gait: ({ name }) => this.readouts.enable(name),
    policy: ({ name }) => (element("policy").querySelector(`[value=${name}]`).disabled = false),
    step: (report) => this.#take(report),
    tour: (message) => this.remote.share(message),
    noTour: ({ message }) => this.remote.refused(message),
    refused: ({ message }) => say(message, true),
    missing: ({ kind, name, message }) => {
      this.remote.lacks(name.replace("phase_free", "the student without a clock"), message);
      if (kind === "gait") this.readouts.lacks(name);
    },
    failed: ({ message }) => fail(`The robot could not be loaded (${message}). Check the connection and load the page again, or try another browser.`),
  };

  /** What keys, buttons and a gamepad do. */
  actions = {
    choose: (index) => this.#choose(index),
    chooseNext: (places) => {
      const { tasks, latest } = this.remote;
      if (latest !== null) this.#choose((tasks.indexOf(latest.requested) + places + tasks.length) % tasks.length);
    },
    push: (hard) => this.#isReady && this.remote.move("push", [Math.round(1000 * this.view.camera.direction), hard ? HARD_PUSH : PUSH]),
    changePolicy: () => chooseNext(element("policy")),
    changeComparison: () => chooseNext(element("compare")),
    changeCamera: () => {
      this.view.camera.changeMode();
      this.#showCamera();
    },
    pause: () => this.#setPace(() => (this.pace.paused = !this.pace.paused)),
    oneStep: () => {
      this.#setPace(() => (this.pace.paused = true));
      this.remote.oneStep();
    },
    slower: () => this.#setPace(() => this.pace.slower()),
    faster: () => this.#setPace(() => this.pace.slower(-1)),
    reset: () => this.#isReady && this.remote.reset(),
    link: () => this.remote.askForTour(),
    help: () => element("keys").showModal(),
  };

  get #isReady() {
    return this.remote.latest !== null;
  }

  // -- What the worker says ------------------------------------------------------------------------------------------------

  #begin(message) {
    const { constants, geometry, first } = message;
    this.remote.begun(message, element("message").classList.contains("error"));
    this.view.build(geometry);
    this.plots = new Plots(element("strip"), element("plot"), constants.robot.legs, constants.control_hz);
    this.readouts = new Readouts(this.remote.tasks, constants.control_hz, this.actions.choose);
    this.readouts.enable(first);
    this.footfalls = constants.footfalls;
    offer(element("compare"), this.footfalls !== undefined);
    offer(element("policy"), constants.policies.phase_free !== undefined);
    element("compare").options[1].disabled = false;
    this.lastMs = performance.now();
    requestAnimationFrame((nowMs) => this.#draw(nowMs));
    this.started();
  }

  #take(report) {
    const before = this.remote.latest, anew = before === null || report.step <= before.step;
    this.remote.take(report);
    if (anew) this.plots.clear();
    const stoodUp = anew || report.stands !== before.stands; // at the origin
    if (stoodUp) {
      this.playback.clear();
      this.jumps = true;
    }
    this.playback.add(stoodUp ? report.frames.slice(-1) : report.frames); // the others are of where it lay
    if (this.pace.paused) this.playback.catchUp();
    const { contacts, command, velocity } = report;
    this.plots.add({ contacts, planned: this.#planned(report), command, velocity });
  }

  /** The contacts that the robot's are compared with: the gait's plan, or the expert's at this phase of its recorded steps. */
  #planned({ task, phase }) {
    if (element("compare").value !== "expert") return stance(this.remote.constants.tasks[task].gait, phase);
    const bins = this.footfalls[task];
    return bins[Math.min(Math.floor(phase * bins.length), bins.length - 1)].map(Boolean);
  }

  // -- What a visitor touches ----------------------------------------------------------------------------------------------

  #listen() {
    new Keyboard(this.stick, this.actions, element("keys"));
    writeHelp(element("help-keys"));
    for (const action of ["pause", "reset", "link", "help", "push"]) {
      element(action).addEventListener("click", ({ shiftKey }) => this.actions[action](shiftKey));
    }
    element("speed").addEventListener("click", () => this.#setPace(() => this.pace.cycle()));
    element("policy").addEventListener("change", ({ target }) => this.remote.move("policy", [target.selectedIndex]));
    element("camera").addEventListener("change", ({ target }) => (this.view.camera.mode = target.value));
    this.#showCamera();
    for (const list of document.querySelectorAll("select")) list.addEventListener("change", () => list.blur()); // keys drive again
    document.addEventListener("click", ({ target, detail }) => detail > 0 && target.closest("button")?.blur()); // Space pauses again
    touchStick(element("left"), (right, up) => this.#lean({ 0: up, 1: -right }));
    touchStick(element("right"), (right) => this.#lean({ 2: -right }));
    document.addEventListener("visibilitychange", () => {
      this.stick.release();
      this.remote.setSpeed(this.pace.factor);
    });
  }

  #lean(axes) {
    Object.assign(this.stick.touch, axes);
  }

  #choose(index) {
    const { tasks } = this.remote;
    if (index < tasks.length && this.readouts.isEnabled(tasks[index])) this.remote.move("button", [index]);
  }

  /** Change the time's pace, and show it. */
  #setPace(change) {
    change();
    const { paused, speed, factor } = this.pace;
    element("pause").setAttribute("aria-pressed", paused);
    element("speed").textContent = `${speed} ×`;
    element("speed").setAttribute("aria-label", `speed: ${speed} of real time`);
    this.remote.setSpeed(factor);
  }

  #showCamera() {
    element("camera").value = this.view.camera.mode;
  }

  // -- What a visitor sees -------------------------------------------------------------------------------------------------

  #draw(nowMs) {
    requestAnimationFrame((nextMs) => this.#draw(nextMs));
    const elapsedS = Math.max(nowMs - this.lastMs, 0) / 1000;
    this.lastMs = nowMs;
    this.#fit();
    this.gamepad.poll();
    if (this.#isReady) {
      this.remote.moveStick(this.stick.percent);
      this.#sendPull();
      this.#show(nowMs, elapsedS);
    }
    this.view.draw();
    if (this.#isReady && !this.wasSeen) {
      this.wasSeen = true;
      performance.mark("first motion");
    }
  }

  #show(nowMs, elapsedS) {
    const { latest } = this.remote;
    this.view.place(this.playback.next(elapsedS * this.pace.factor), this.jumps ? Infinity : elapsedS);
    this.jumps = false;
    this.view.showString(latest.pulled);
    this.readouts.show(latest, nowMs, elapsedS, this.pace.paused);
    this.plots.draw();
    if (element("camera").value !== this.view.camera.mode) this.#showCamera(); // panning has ended the following
  }

  /** Tell the worker where the robot is dragged to. */
  #sendPull() {
    if (this.remote.latest.fallen) this.dragging.end(); // or it would be torn over again as soon as it stands
    const { pull } = this.dragging;
    if (pull !== null) this.remote.move("pull", pull);
  }

  #fit() {
    const size = [window.innerWidth, window.innerHeight, window.devicePixelRatio];
    if (String(size) === this.size) return;
    this.size = String(size);
    this.view.resize(...size);
  }
}

/** Show a list, or hide it where there is nothing to choose from. */
function offer(list, isChoice) {
  list.closest("label").hidden = !isChoice;
}

/** Choose the next entry of a list that can be chosen, as if a hand had. */
function chooseNext(list) {
  if (list.closest("label").hidden) return;
  const { length } = list.options;
  for (let i = 1; i < length; i++) {
    const index = (list.selectedIndex + i) % length;
    if (list.options[index].disabled) continue;
    list.selectedIndex = index;
    list.dispatchEvent(new Event("change"));
    return;
  }
}
