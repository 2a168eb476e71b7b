/** How fast time passes: real time, slow motion, or not at all. */

const SPEEDS = [0.1, 0.25, 0.5, 1];

export class Pace {
  constructor() {
    this.paused = false;
    this.speed = 1;
  }

  /** Robot's time over time on the wall; a page that nobody sees stands still. */
  get factor() {
    return this.paused || document.hidden ? 0 : this.speed;
  }

  /** Slow the time down by so many steps; negative speeds it up, as far as real time. */
  slower(steps = 1) {
    const place = SPEEDS.indexOf(this.speed) - steps;
    this.speed = SPEEDS[Math.min(Math.max(place, 0), SPEEDS.length - 1)];
  }

  /** The next slower speed, and real time after the slowest: for a single button. */
  cycle() {
    if (this.speed === SPEEDS[0]) this.speed = 1;
    else this.slower();
  }
}
