/** The robot dragged by a pointer: a string between the point that was taken and where the pointer is. */

export class Dragging {
  /**
   * @param view that knows what a pointer hits.
   * @param canvas of the view.
   * @param letGo called when the robot is let go.
   */
  constructor(view, canvas, letGo) {
    Object.assign(this, { view, canvas, letGo, grabbed: null });
    canvas.addEventListener("pointerdown", (event) => this.#take(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.#move(event));
    for (const kind of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(kind, ({ pointerId }) => this.grabbed?.id === pointerId && this.end());
    }
  }

  /** Point of the trunk and where it is pulled to [mm], or null. */
  get pull() {
    if (this.grabbed === null) return null;
    const { point, at } = this.grabbed, target = this.view.pointAt(...at, point);
    return [point, target].flatMap((vector) => vector.toArray().map((value) => Math.round(1000 * value)));
  }

  /** Let go. */
  end() {
    if (this.grabbed === null) return;
    this.grabbed = null;
    this.canvas.classList.remove("pulling");
    this.letGo();
  }

  #take(event) {
    const point = event.button === 0 ? this.view.grab(...inPicture(event)) : null;
    if (point === null) return;
    event.stopImmediatePropagation(); // the camera stays
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.classList.add("pulling");
    this.grabbed = { point, at: inPicture(event), id: event.pointerId };
  }

  #move(event) {
    if (this.grabbed?.id === event.pointerId) this.grabbed.at = inPicture(event);
    else if (event.pointerType === "mouse" && event.buttons === 0) {
      this.canvas.classList.toggle("on-robot", this.view.grab(...inPicture(event)) !== null);
    }
  }
}

/** Place of a pointer in the picture: (right, up) in [-1, 1]. */
const inPicture = ({ clientX, clientY }) => [(2 * clientX) / window.innerWidth - 1, 1 - (2 * clientY) / window.innerHeight];
