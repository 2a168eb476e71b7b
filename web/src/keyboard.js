/** Keys and what they do: the same as in the desktop player, `trainers.play.controls`, but for the link. */
import { STICK_KEYS } from "./stick.js";

/** Names of actions by the keys' `KeyboardEvent.code`. */
export const ACTION_KEYS = {
  KeyP: "push",
  KeyT: "changePolicy",
  KeyG: "changeComparison",
  Space: "pause",
  KeyN: "oneStep",
  Minus: "slower",
  Equal: "faster",
  KeyR: "reset",
  KeyC: "changeCamera",
  KeyL: "link",
  KeyH: "help",
};

/** Keys and what they do, as a visitor reads it: the keys in alternatives of several. */
export const HELP = [
  [["W S", "↑ ↓"], "forward, backward"],
  [["A D", "← →"], "turn"],
  [["Q E"], "step to the side"],
  [["Shift"], "half as fast"],
  [["1 2 3 4 5 6"], "gait (or click on it)"],
  [["P", "Shift P"], "push away from you, harder"],
  [["T"], "student with or without a clock"],
  [["G"], "compare feet with the plan or the expert"],
  [["Space", "N"], "pause, one step on"],
  [["- ="], "slower, faster"],
  [["R"], "stand up again"],
  [["C"], "camera: chase, follow, free"],
  [["L"], "a link that drives the same tour again"],
  [["H"], "this help"],
];

/** By the letters printed on the keys where they do not lie as on an American keyboard. */
const PRINTED = { "-": "Minus", "+": "Equal", "=": "Equal" };
const HARMLESS = ["Tab", "Enter", "Escape"];

export class Keyboard {
  /**
   * @param stick that keys hold.
   * @param actions that keys do, by name: those of `ACTION_KEYS`, and `choose(index)`.
   * @param dialog with the help; a key that does something closes it.
   */
  constructor(stick, actions, dialog) {
    Object.assign(this, { stick, actions, dialog });
    window.addEventListener("keydown", (event) => this.#down(event));
    window.addEventListener("keyup", (event) => this.#up(event));
    window.addEventListener("blur", () => stick.release());
  }

  #down(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || this.#isForControl(event)) return;
    this.stick.gentle = event.shiftKey;
    const code = PRINTED[event.key] ?? event.code, number = /^(?:Digit|Numpad)([1-9])$/.exec(code);
    const action = ACTION_KEYS[code];
    if (code in STICK_KEYS) this.stick.key(code, true);
    else if (number === null && action === undefined) return;
    event.preventDefault();
    const helpWasOpen = this.dialog.open;
    if (helpWasOpen) this.dialog.close();
    if (event.repeat || (helpWasOpen && action === "help")) return;
    if (number !== null) this.actions.choose(Number(number[1]) - 1);
    else if (action !== undefined) this.actions[action](event.shiftKey);
  }

  #up(event) {
    this.stick.gentle = event.shiftKey;
    if (event.code in STICK_KEYS) this.stick.key(event.code, false);
  }

  /** Whether a key belongs to what has the focus: a list, a button that Space presses, links and buttons that Enter and Tab reach. */
  #isForControl({ code, target }) {
    if (HARMLESS.includes(code) || target.tagName === "SELECT") return true;
    return code === "Space" && ["BUTTON", "A"].includes(target.tagName);
  }
}

/** Write the help into a list of terms. */
export function writeHelp(list) {
  for (const [alternatives, meaning] of HELP) {
    const term = document.createElement("dt"), definition = document.createElement("dd");
    alternatives.forEach((keys, i) => {
      if (i > 0) term.append(" or ");
      for (const name of keys.split(" ")) term.append(Object.assign(document.createElement("kbd"), { textContent: name }), " ");
    });
    definition.textContent = meaning;
    list.append(term, definition);
  }
}
