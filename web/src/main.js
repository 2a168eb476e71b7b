/** Starts what takes longest, the worker with the physics, before the page that draws and listens. */
const worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
const { Page } = await import("./page.js");
new Page(worker);
