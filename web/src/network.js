/** Networks as products of typed arrays; weights are those of `trainers.policies`, in float32. */

/** Tensors of a file by their names. */
function tensors({ tensors: shapes, bytes, file }, buffer) {
  if (buffer.byteLength !== bytes) throw new Error(`${file}: ${bytes} bytes were expected, got ${buffer.byteLength}`);
  const named = {};
  let offset = 0;
  for (const { name, shape } of shapes) {
    const size = shape.reduce((product, n) => product * n, 1);
    named[name] = new Float32Array(buffer, offset, size);
    offset += 4 * size;
  }
  return named;
}

/** y = W x + b, with ELU afterwards if asked for; sums in float64, values in float32. */
function linear(weight, bias, x, elu) {
  const rows = bias.length, columns = x.length, y = new Float32Array(rows);
  for (let i = 0, k = 0; i < rows; i++) {
    let a = 0, b = 0, c = 0, d = 0, j = 0;
    for (; j + 3 < columns; j += 4, k += 4) {
      a += weight[k] * x[j];
      b += weight[k + 1] * x[j + 1];
      c += weight[k + 2] * x[j + 2];
      d += weight[k + 3] * x[j + 3];
    }
    for (; j < columns; j++, k++) a += weight[k] * x[j];
    const sum = a + b + (c + d) + bias[i];
    y[i] = elu && sum < 0 ? Math.expm1(sum) : sum;
  }
  return y;
}

/** Linear layers at these indices of a torch Sequential; ELU follows all of them but, perhaps, the last. */
function layers(named, prefix, indices, x, eluAtEnd) {
  indices.forEach((index, i) => {
    const elu = eluAtEnd || i < indices.length - 1;
    x = linear(named[`${prefix}${index}.weight`], named[`${prefix}${index}.bias`], x, elu);
  });
  return x;
}

/** (x - shift) / scale, clipped, of the first entries of an observation. */
function normalized(observation, shift, scale, clip) {
  const x = new Float32Array(shift.length);
  for (let i = 0; i < x.length; i++) {
    const value = Math.fround(Math.fround(observation[i] - shift[i]) / scale[i]);
    x[i] = Math.min(Math.max(value, -clip), clip);
  }
  return x;
}

/** The student: a trunk, and a head per gait; heads may come later than the trunk. */
export class Student {
  /**
   * @param policy of the constants.
   * @param shared the buffer of trunk and normalizers.
   */
  constructor(policy, shared) {
    this.policy = policy;
    this.shared = tensors(policy.shared, shared);
    this.heads = {};
  }

  addHead(task, buffer) {
    this.heads[task] = tensors(this.policy.heads[task], buffer);
  }

  has(task) {
    return task in this.heads;
  }

  /** The action for an observation in a task, in [-1, 1], float32. */
  act(observation, task) {
    const w = this.shared;
    const x = normalized(observation, w["obs.shift"], w["obs.scale"], this.policy.clip_sd);
    const features = layers(w, "trunk.", [0, 2], x, true);
    const y = layers(this.heads[task], "", [0, 2], features, false);
    return y.map((value, i) => Math.min(Math.max(w["act.shift"][i] + Math.fround(w["act.scale"][i] * value), -1), 1));
  }
}

/** From an observation without a clock to (sine, cosine) of the phase: `trainers.policies.phase_estimator`. */
export class PhaseEstimator {
  constructor(estimator, buffer) {
    this.clip = estimator.clip_sd;
    this.weights = tensors(estimator.weights, buffer);
  }

  /** (sine, cosine), of unit length. */
  estimate(observation) {
    const w = this.weights;
    const x = normalized(observation, w["normalizer.shift"], w["normalizer.scale"], this.clip);
    return unit(layers(w, "network.", [0, 2, 4], x, false));
  }
}

/** A vector of unit length in the same direction; (0, 1), phase 0, for a zero. */
export function unit([sine, cosine]) {
  const length = Math.hypot(sine, cosine);
  return length > 0 ? [Math.fround(sine / length), Math.fround(cosine / length)] : [0, 1];
}
