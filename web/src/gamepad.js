/** A gamepad's sticks and buttons, in the browsers' standard mapping; what they do is as in `trainers.play.gamepad`. */

const DEAD_ZONE = 0.12; // sticks do not come back to exactly zero
const LEFT_X = 0, LEFT_Y = 1, RIGHT_X = 2;

/** Names of actions by the buttons' numbers; those with an argument take it from here. */
const BUTTONS = {
  0: ["push", false], 1: ["reset"], 2: ["changeComparison"], 3: ["changePolicy"],
  4: ["chooseNext", -1], 5: ["chooseNext", 1], 8: ["changeCamera"], 9: ["pause"],
};

export class Gamepad {
  /**
   * @param stick that its sticks lean.
   * @param actions that its buttons do, by name.
   */
  constructor(stick, actions) {
    Object.assign(this, { stick, actions, pressed: [], isAllowed: true });
  }

  /** Take in where the sticks of the first gamepad are, and which buttons went down since the last time. */
  poll() {
    const pad = this.#first();
    this.stick.pad = [LEFT_Y, LEFT_X, RIGHT_X].map((axis) => -rested(pad?.axes[axis] ?? 0)); // theirs point down and right
    const pressed = pad === null ? [] : pad.buttons.map((button) => button.pressed);
    for (const [button, [action, ...values]] of Object.entries(BUTTONS)) {
      if (pressed[button] && !this.pressed[button]) this.actions[action](...values);
    }
    this.pressed = pressed;
  }

  /** The first gamepad whose axes and buttons are known: of others, wheels and pedals, an axis at rest may be a full deflection. */
  #first() {
    if (!this.isAllowed) return null;
    try {
      return Array.from(navigator.getGamepads?.() ?? []).find((each) => each?.connected && each.mapping === "standard") ?? null;
    } catch {
      this.isAllowed = false; // by the page that this one is a part of; nothing changes that
      return null;
    }
  }
}

/** A deflection without the dead zone; the rest is stretched, so that it begins at zero and ends at one. */
export function rested(deflection) {
  return Math.sign(deflection) * Math.min(Math.max((Math.abs(deflection) - DEAD_ZONE) / (1 - DEAD_ZONE), 0), 1);
}
