/** The sentence at the top of the page. */

/** Tell the visitor something; an empty sentence takes the last one away. After `fail` nothing else is said. */
export function say(text, isError = false) {
  const message = document.getElementById("message");
  if (message.classList.contains("final")) return;
  put(message, text);
  message.classList.toggle("error", isError);
}

/** Say what keeps the page from working, and what to do. */
export function fail(text) {
  say(text, true);
  document.getElementById("message").classList.add("final"); // not a variable: main.js and page.js are bundled apart
}

/** Text that is the same is left alone: what reads the page aloud would begin anew. */
export function put(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
