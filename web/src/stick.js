/** Where the stick is, from everything that moves it: keys, the sticks on a touch screen, a gamepad. */

/** Keys by `KeyboardEvent.code`, so that they lie where they do on every layout: axis and direction. */
const KEYS = {
  KeyW: [0, 1], ArrowUp: [0, 1], KeyS: [0, -1], ArrowDown: [0, -1],
  KeyA: [1, 1], KeyD: [1, -1],
  KeyQ: [2, 1], ArrowLeft: [2, 1], KeyE: [2, -1], ArrowRight: [2, -1],
};
const SLOW = 0.5; // with Shift
const DEAD_ZONE = 0.12;

export const isStickKey = (code) => code in KEYS;

export class Stick {
  constructor() {
    this.pressed = new Set();
    this.slow = false;
    this.touch = [0, 0, 0];
    this.pad = [0, 0, 0];
  }

  key(code, down, shift) {
    this.slow = shift;
    if (down) this.pressed.add(code);
    else this.pressed.delete(code);
  }

  /** Let go of everything: the window has lost the keyboard. */
  release() {
    this.pressed.clear();
    this.touch = [0, 0, 0];
  }

  /** Read the first gamepad: left stick moves, right stick turns. */
  readPad(pad) {
    const axis = (i) => (Math.abs(pad?.axes[i] ?? 0) < DEAD_ZONE ? 0 : -pad.axes[i]);
    this.pad = [axis(1), axis(0), axis(2)];
  }

  /** Percent of full deflection: forward, left, turning left. */
  get percent() {
    const sum = [0, 0, 0];
    for (const code of this.pressed) sum[KEYS[code][0]] += KEYS[code][1] * (this.slow ? SLOW : 1);
    return sum.map((value, i) => {
      const keys = Math.min(Math.max(value, -1), 1); // two keys of one direction are no more than one
      return Math.round(100 * Math.min(Math.max(keys + this.touch[i] + this.pad[i], -1), 1));
    });
  }
}

/**
 * Make an element a stick for fingers.
 *
 * @param element with a knob in it.
 * @param moved called with (right, up) in [-1, 1]; (0, 0) when it is let go.
 */
export function touchStick(element, moved) {
  const knob = element.querySelector(".knob");
  let finger = null;
  const put = (right, up) => {
    knob.style.transform = `translate(${right * 34}px, ${-up * 34}px)`;
    moved(right, up);
  };
  const follow = (event) => {
    const box = element.getBoundingClientRect(), radius = box.width / 2;
    const [right, up] = [(event.clientX - box.left) / radius - 1, 1 - (event.clientY - box.top) / radius];
    const scale = 1 / Math.max(1, Math.hypot(right, up));
    put(element.dataset.axes === "x" ? Math.min(Math.max(right, -1), 1) : right * scale, element.dataset.axes === "x" ? 0 : up * scale);
  };
  element.addEventListener("pointerdown", (event) => {
    finger = event.pointerId;
    element.setPointerCapture(finger);
    follow(event);
  });
  element.addEventListener("pointermove", (event) => event.pointerId === finger && follow(event));
  for (const kind of ["pointerup", "pointercancel"]) {
    element.addEventListener(kind, (event) => {
      if (event.pointerId !== finger) return;
      finger = null;
      put(0, 0);
    });
  }
}
