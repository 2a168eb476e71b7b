/** A stick for fingers. */

const REACH_PX = 34; // of the knob

/**
 * Make an element a stick.
 *
 * @param element with a knob in it; `data-axes="x"` lets it go right and left alone.
 * @param moved called with (right, up) in [-1, 1]; (0, 0) when it is let go.
 */
export function touchStick(element, moved) {
  const knob = element.querySelector(".knob"), sidewaysOnly = element.dataset.axes === "x";
  let finger = null;
  const put = (right, up) => {
    knob.style.transform = `translate(${right * REACH_PX}px, ${-up * REACH_PX}px)`;
    moved(right, up);
  };
  const follow = (event) => {
    const box = element.getBoundingClientRect(), radius = box.width / 2;
    const right = (event.clientX - box.left) / radius - 1;
    const up = sidewaysOnly ? 0 : 1 - (event.clientY - box.top) / radius;
    const scale = 1 / Math.max(1, Math.hypot(right, up));
    put(right * scale, up * scale);
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
