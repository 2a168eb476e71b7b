/** Poses between those that the physics sends, for screens of any rate. */

const BEHIND_S = 0.03; // how far the picture is behind the physics: its messages come every 20 ms
const MOST_BEHIND_S = 0.12;

export class Playback {
  constructor() {
    this.frames = [];
    this.timeS = null;
  }

  /** Forget everything: the robot stands somewhere else. */
  clear() {
    this.frames = [];
    this.timeS = null;
  }

  /** Take poses {timeS, pose} in order of time; a time that runs back is a new beginning. */
  add(frames) {
    if (this.frames.length && frames[0].timeS <= this.frames.at(-1).timeS) this.clear();
    this.frames.push(...frames);
    const kept = this.frames.findIndex(({ timeS }) => timeS > (this.timeS ?? 0) - 0.1);
    if (kept > 1) this.frames.splice(0, kept - 1);
  }

  /** Be as far as the physics: time stands still. */
  catchUp() {
    this.timeS = this.frames.at(-1)?.timeS ?? null;
  }

  /**
   * The pose to draw, or null if there is none yet.
   *
   * @param elapsedS robot's time since the last picture [s].
   */
  next(elapsedS) {
    if (this.frames.length === 0) return null;
    const latest = this.frames.at(-1).timeS;
    const wanted = this.timeS === null ? latest - BEHIND_S : this.timeS + elapsedS;
    this.timeS = Math.min(Math.max(wanted, latest - MOST_BEHIND_S), latest);
    const after = this.frames.findIndex(({ timeS }) => timeS >= this.timeS);
    if (after <= 0) return this.frames[0].pose;
    return between(this.frames[after - 1], this.frames[after], this.timeS);
  }
}

/** Linear in positions and, renormalized, in quaternions. */
export function between(first, second, timeS) {
  const share = (timeS - first.timeS) / (second.timeS - first.timeS);
  const pose = new Float32Array(first.pose.length);
  for (let i = 0; i < pose.length; i += 7) {
    for (let j = i; j < i + 3; j++) pose[j] = first.pose[j] + share * (second.pose[j] - first.pose[j]);
    let dot = 0, length = 0;
    for (let j = i + 3; j < i + 7; j++) dot += first.pose[j] * second.pose[j];
    for (let j = i + 3; j < i + 7; j++) {
      pose[j] = (1 - share) * first.pose[j] + share * (dot < 0 ? -1 : 1) * second.pose[j];
      length += pose[j] ** 2;
    }
    for (let j = i + 3; j < i + 7; j++) pose[j] /= Math.sqrt(length);
  }
  return pose;
}
