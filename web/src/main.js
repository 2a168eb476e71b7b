/** Starts what takes longest, the worker with the physics, before the page that draws and listens; says what does not start. */
import { fail } from "./message.js";

const AGAIN = "Check the connection and load the page again.";
let loading = true;

/** Whatever goes wrong before the robot is there, and nobody has an answer to. */
for (const kind of ["error", "unhandledrejection"]) {
  window.addEventListener(kind, ({ message, reason }) => {
    if (loading) fail(`This page could not start: ${reason?.message ?? message ?? kind}. Load it again, or try another browser.`);
  });
}

/** The worker with the physics. */
function startWorker() {
  const worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
  worker.onerror = ({ message }) => {
    if (message) fail(`The physics has stopped (${message}). Load the page again.`);
    else fail(`The physics could not start: worker.js did not come, or this browser is too old for it. ${AGAIN}`);
  };
  return worker;
}

/** The page's second part. */
async function loadPage() {
  try {
    return (await import("./page.js")).Page;
  } catch (error) {
    throw new Error(`Half of this page is missing: page.js could not be loaded. ${AGAIN}`, { cause: error });
  }
}

let worker;
try {
  worker = startWorker();
  const Page = await loadPage();
  new Page(worker, () => (loading = false));
} catch (error) {
  worker?.terminate();
  fail(error.message);
  console.warn(error.cause ?? error);
}
