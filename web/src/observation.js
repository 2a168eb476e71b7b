/** The flat observation of a policy, from its contract: `go1_mtl_gym.sensors` and `go1_mtl_gym.sensing.observation`. */
import { legKinematics } from "./kinematics.js";

/** Every part of an observation by name, from a reading of the sensors and the episode. */
export function measure(reading, episode, robot) {
  const turn = 2 * Math.PI * episode.phase;
  return {
    ...reading,
    command: episode.filteredCommand,
    phase: [Math.sin(turn), Math.cos(turn)],
    last_action: episode.lastAction,
    leg_kinematics: legKinematics(reading.q, reading.dq, reading.gyroscope, robot),
  };
}

/** The observations of one policy, with the frames that they remember. */
export class Observer {
  /**
   * @param policy with its `contract`, and the bounds `low` and `high` of its observation.
   * @param proprioception names of the parts that a frame consists of.
   */
  constructor(policy, proprioception) {
    this.terms = policy.contract.terms;
    this.tasks = policy.contract.tasks;
    this.low = Float32Array.from(policy.low);
    this.high = Float32Array.from(policy.high);
    this.proprioception = proprioception;
    const frame = this.terms.filter((term) => proprioception.includes(term.name));
    const size = frame.reduce((sum, term) => sum + term.size, 0);
    const older = this.terms.find((term) => term.name === "history");
    this.history = 1 + (older ? older.size / size : 0);
    this.frames = [];
  }

  /** Forget the frames: an episode begins. */
  reset() {
    this.frames = [];
  }

  /** The observation, float32, clipped to its bounds as a saturating sensor would; its frame is remembered. */
  observe(parts, taskName) {
    this.#remember(parts);
    const observation = new Float64Array(this.low.length);
    for (const { name, start } of this.terms) {
      observation.set(name === "history" ? this.frames.slice(1).flat() : parts[name], start);
    }
    observation[this.low.length - this.tasks.length + this.tasks.indexOf(taskName)] = 1;
    return Float32Array.from(observation, (value, i) => Math.min(Math.max(value, this.low[i]), this.high[i]));
  }

  /** Take in the newest frame; the first one of an episode also stands for those before it. */
  #remember(parts) {
    const frame = this.proprioception.flatMap((name) => Array.from(parts[name]));
    while (this.frames.length < this.history) this.frames.unshift(frame);
    this.frames.unshift(frame);
    this.frames.length = this.history;
  }
}
