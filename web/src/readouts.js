/** What the page says of the robot in words and figures. */
import { put } from "./message.js";

const RATE_EVERY_MS = 500;
const MEAN_S = 0.25; // time constant of velocities that are read

const element = (id) => document.getElementById(id);

export class Readouts {
  /**
   * @param tasks names of the gaits.
   * @param controlHz control periods per second.
   * @param choose called with the index of a gait whose button is pressed.
   */
  constructor(tasks, controlHz, choose) {
    Object.assign(this, { tasks, controlHz, mean: [0, 0, 0], rate: null });
    this.buttons = Object.fromEntries(tasks.map((name, index) => [name, gaitButton(name, index, choose)]));
    element("gaits").append(...Object.values(this.buttons));
  }

  /** A gait's network has come. */
  enable(task) {
    this.buttons[task].disabled = false;
  }

  /** A gait's network will not come. */
  lacks(task) {
    this.buttons[task].classList.add("missing");
    this.buttons[task].title += ": could not be loaded";
  }

  /** Whether a gait can be asked for: its network has come. */
  isEnabled(task) {
    return task in this.buttons && !this.buttons[task].disabled;
  }

  /**
   * Show the robot as it is.
   *
   * @param report of the worker.
   * @param elapsedS since the last time [s].
   */
  show(report, nowMs, elapsedS, paused) {
    const { task, requested } = report, waits = requested !== task;
    put(element("gait"), task);
    put(element("state"), report.fallen ? "fallen" : paused ? "paused" : waits ? `→ ${requested}` : "");
    for (const [name, button] of Object.entries(this.buttons)) {
      button.setAttribute("aria-pressed", name === task);
      button.classList.toggle("waiting", waits && name === requested);
    }
    element("policy").value = report.policy;
    fill(".wanted", report.command);
    fill(".measured", this.#smoothed(report.velocity, elapsedS));
    this.#showRate(report.step, nowMs);
  }

  #showRate(step, nowMs) {
    const since = this.rate;
    if (since !== null && step >= since.step && nowMs - since.ms < RATE_EVERY_MS) return;
    if (since !== null && step >= since.step) {
      const made = (step - since.step) / this.controlHz / ((nowMs - since.ms) / 1000);
      put(element("rate"), `× ${made.toFixed(2)}`);
    }
    this.rate = { ms: nowMs, step };
  }

  /** Velocities without their shaking. */
  #smoothed(velocity, elapsedS) {
    const share = 1 - Math.exp(-elapsedS / MEAN_S);
    this.mean = this.mean.map((value, i) => value + share * (velocity[i] - value));
    return this.mean;
  }
}

function gaitButton(name, index, choose) {
  const button = document.createElement("button"), number = document.createElement("small");
  number.textContent = index + 1;
  button.append(number, name);
  Object.assign(button, { id: `gait-${name}`, disabled: true, title: `${index + 1}` });
  button.addEventListener("click", () => choose(index));
  return button;
}

function fill(row, values) {
  document.querySelectorAll(`${row} td`).forEach((cell, i) => put(cell, values[i].toFixed(2).replace("-0.00", "0.00").replace("-", "−")));
}
