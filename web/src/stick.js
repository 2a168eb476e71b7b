/** Where the stick is, from everything that moves it: keys, the sticks on a touch screen, a gamepad. */

const FORWARD = 0, LEFT = 1, TURN = 2;

/** Axis of the stick that a key holds at one of its ends; keys by `KeyboardEvent.code`, so that every layout has them in the same place. */
export const STICK_KEYS = {
  KeyW: [FORWARD, 1], ArrowUp: [FORWARD, 1], KeyS: [FORWARD, -1], ArrowDown: [FORWARD, -1],
  KeyQ: [LEFT, 1], KeyE: [LEFT, -1],
  KeyA: [TURN, 1], ArrowLeft: [TURN, 1], KeyD: [TURN, -1], ArrowRight: [TURN, -1],
};
const GENTLE = 0.5; // deflection by keys while Shift is held

export class Stick {
  constructor() {
    this.held = new Set();
    this.gentle = false;
    this.touch = [0, 0, 0];
    this.pad = [0, 0, 0];
  }

  /** A key of `STICK_KEYS` went down, or up. */
  key(code, down) {
    if (down) this.held.add(code);
    else this.held.delete(code);
  }

  /** Let go of everything: the window has lost the keyboard. */
  release() {
    this.held.clear();
    this.gentle = false;
    this.touch = [0, 0, 0];
  }

  /** Percent of full deflection: forward, left, turning left. */
  get percent() {
    const ends = new Set([...this.held].map((code) => String(STICK_KEYS[code]))); // W and up together pull once
    const sum = this.touch.map((value, axis) => value + this.pad[axis]);
    for (const end of ends) {
      const [axis, sign] = end.split(",").map(Number);
      sum[axis] += sign * (this.gentle ? GENTLE : 1);
    }
    return sum.map((value) => Math.round(100 * Math.min(Math.max(value, -1), 1)));
  }
}
