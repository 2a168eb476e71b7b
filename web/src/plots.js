/** The strip of foot contacts and the plot of velocities, drawn on two canvases. */

const STRIP_S = 2, PLOT_S = 6;
const COLORS = { contact: "#e8590c", plan: "#adb5bd", wanted: "#868e96", measured: "#1971c2", text: "#495057", grid: "#dee2e6" };
const FONT = "11px system-ui, sans-serif";

/** Canvas of crisp lines: its size in pixels follows its size on the page. */
function prepared(canvas) {
  const ratio = window.devicePixelRatio || 1, { clientWidth: width, clientHeight: height } = canvas;
  if (canvas.width !== Math.round(width * ratio)) Object.assign(canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = FONT;
  return { context, width, height };
}

/** Where samples fulfil a condition: pairs [first, one after the last]. */
function runs(samples, condition) {
  const pairs = [];
  samples.forEach((sample, i) => {
    if (!condition(sample)) return;
    if (pairs.at(-1)?.[1] === i) pairs.at(-1)[1] = i + 1;
    else pairs.push([i, i + 1]);
  });
  return pairs;
}

export class Plots {
  /**
   * @param strip canvas of the contacts.
   * @param plot canvas of the velocities.
   * @param legs their names.
   * @param controlHz control periods per second.
   */
  constructor(strip, plot, legs, controlHz) {
    Object.assign(this, { strip, plot, legs, controlHz, samples: [] });
  }

  clear() {
    this.samples = [];
  }

  /** Take a sample {contacts, planned, command, velocity}; `planned` are contacts to compare with. */
  add(sample) {
    this.samples.push(sample);
    if (this.samples.length > PLOT_S * this.controlHz) this.samples.shift();
  }

  draw() {
    this.#drawStrip();
    if (this.plot.clientWidth > 0) this.#drawPlot(); // small screens have no room for it
  }

  #drawStrip() {
    const { context, width, height } = prepared(this.strip), left = 24, columns = STRIP_S * this.controlHz;
    const shown = this.samples.slice(-columns), step = (width - left) / columns, row = height / this.legs.length;
    context.textBaseline = "middle";
    for (const [leg, name] of this.legs.entries()) {
      const top = row * leg + 2, tall = row - 5;
      context.fillStyle = COLORS.text;
      context.fillText(name, 0, top + tall / 2);
      const first = left + (columns - shown.length) * step;
      const bars = (color, isDown, y, high) => {
        context.fillStyle = color;
        for (const [from, to] of runs(shown, isDown)) context.fillRect(first + from * step, y, (to - from) * step, high);
      };
      bars(COLORS.contact, ({ contacts }) => contacts[leg], top, tall - 3);
      bars(COLORS.plan, ({ planned }) => planned[leg], top + tall - 2, 2.5);
    }
  }

  #drawPlot() {
    const { context, width, height } = prepared(this.plot), left = 24, columns = PLOT_S * this.controlHz;
    const reach = Math.max(0.6, ...this.samples.flatMap(({ command, velocity }) => [Math.abs(command[0]), Math.abs(velocity[0])])) * 1.1;
    const y = (value) => height / 2 - (value / reach) * (height / 2 - 4);
    const x = (i) => left + ((columns - this.samples.length + i) * (width - left)) / columns;
    context.textBaseline = "middle";
    const tick = reach > 1.1 ? 1 : 0.5;
    for (const level of [-tick, 0, tick]) {
      context.strokeStyle = COLORS.grid;
      context.strokeRect(left, y(level), width, 0);
      context.fillStyle = COLORS.text;
      context.fillText(String(level).replace("-", "−"), 0, y(level));
    }
    const line = (value, color, wide) => {
      context.strokeStyle = color;
      context.lineWidth = wide;
      context.beginPath();
      this.samples.forEach((sample, i) => context.lineTo(x(i), y(value(sample))));
      context.stroke();
      context.lineWidth = 1;
    };
    line(({ velocity }) => velocity[0], COLORS.measured, 1.5);
    line(({ command }) => command[0], COLORS.wanted, 1.5);
  }
}
