// The keyboard presses the page's own buttons: viser tells its server of clicks and of buttons that are held, and of no
// keys. `buttons` has the id of a button for each code of a key, `held` the ids of those that act as long as they are down.
(({ buttons, held }) => {
  window.go1Keys?.abort(); // the page was built anew
  const control = (window.go1Keys = new AbortController());
  const down = new Map(); // code -> the button that it holds
  const point = (button, kind) => button.dispatchEvent(new PointerEvent(kind, { bubbles: true, button: 0 }));
  const release = (code) => {
    const button = down.get(code);
    down.delete(code);
    if (button && ![...down.values()].includes(button)) {
      point(button, "pointerup");
      button.click();
    }
  };
  const writes = (target) => target.closest?.("input:not([type=range]), textarea, [contenteditable=true]");
  const listen = (target, kind, act) => target.addEventListener(kind, act, { capture: true, signal: control.signal });

  listen(window, "keydown", (event) => {
    const id = buttons[event.code];
    const button = id && document.getElementById(id);
    if (!button || writes(event.target) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopImmediatePropagation(); // the same keys move viser's camera
    if (event.repeat || down.has(event.code)) return;
    if (!held.includes(id)) return button.click();
    const already = [...down.values()].includes(button);
    down.set(event.code, button);
    if (!already) point(button, "pointerdown");
  });
  listen(window, "keyup", (event) => release(event.code));
  const releaseAll = () => [...down.keys()].forEach(release);
  listen(window, "blur", releaseAll);
  listen(document, "visibilitychange", releaseAll);
})(KEYS);
