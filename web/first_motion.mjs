/** What the time until the first motion goes into, in Chromium with an empty cache: `npm run first-motion`. */
import { fileURLToPath } from "node:url";
import puppeteer from "puppeteer-core";

import { serve } from "./serve.mjs";
import { browserOptions } from "./tests/smoke/chromium.mjs";

const PATIENCE_MS = 600000;
const TASKS = ["ThreadControllerImpl::RunTask", "ThreadPool_RunTask"];
const BROWSERS_OWN = /Start$|End$|^dom[A-Z]|^(first|largest)[A-Z]|^markAs/;
const CATEGORIES = ["devtools.timeline", "blink.user_timing", "toplevel", "v8", "disabled-by-default-v8.compile", "v8.wasm"];

/** Load the page in a new browser; returns what `look` makes of it and of the time of the first motion [ms]. */
export async function atFirstMotion(server, look, before = async () => {}) {
  const browser = await puppeteer.launch({ ...browserOptions(), protocolTimeout: PATIENCE_MS });
  try {
    const page = await browser.newPage();
    await page.setViewport({ width: 1280, height: 800 });
    await before(page);
    await page.goto(`http://127.0.0.1:${server.address().port}/`, { timeout: PATIENCE_MS });
    await page.waitForFunction(() => performance.getEntriesByName("first motion").length > 0, { timeout: PATIENCE_MS, polling: 100 });
    return await look(page, await page.evaluate(() => performance.getEntriesByName("first motion")[0].startTime));
  } finally {
    await browser.close();
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [folder, runs = "1"] = process.argv.slice(2), server = await serve(0, folder || undefined);
  for (let run = 0; run < Number(runs); run++) {
    await atFirstMotion(
      server,
      async (page, firstMs) => {
        console.log(`first motion after ${(firstMs / 1000).toFixed(2)} s`);
        report(JSON.parse(Buffer.from(await page.tracing.stop()).toString()).traceEvents, firstMs);
      },
      (page) => page.tracing.start({ categories: CATEGORIES }),
    );
  }
  server.close();
}

/** Marks, and the CPU time of each thread and of what took longest, from the beginning to the first motion. */
function report(events, firstMs) {
  const isMark = ({ cat, ph }) => cat.includes("user_timing") && ["R", "I", "i"].includes(ph);
  const end = events.find((event) => isMark(event) && event.name === "first motion").ts, begin = end - 1000 * firstMs;
  const threads = new Map(events.filter(({ name }) => name === "thread_name").map(({ pid, tid, args }) => [`${pid} ${tid}`, args.name]));
  const busy = new Map(), kinds = new Map(), add = (sums, key, us) => sums.set(key, (sums.get(key) ?? 0) + us / 1000);
  for (const { ph, ts, pid, tid, name, tdur } of events) {
    if (ph !== "X" || ts < begin || ts > end || tdur === undefined) continue;
    const thread = threads.get(`${pid} ${tid}`) ?? "?";
    if (TASKS.includes(name)) add(busy, thread, tdur);
    else add(kinds, `${thread}: ${name}`, tdur);
  }
  const ours = events.filter((event) => isMark(event) && event.ts >= begin && event.ts <= end && !BROWSERS_OWN.test(event.name));
  for (const { name, ts } of ours.sort((first, second) => first.ts - second.ts)) console.log(line((ts - begin) / 1000, name));
  for (const [title, sums, count] of [["CPU time by thread", busy, 8], ["of it, with what it calls", kinds, 20]]) {
    console.log(title);
    for (const [name, ms] of [...sums].sort(([, first], [, second]) => second - first).slice(0, count)) console.log(line(ms, name));
  }
}

function line(ms, text) {
  return `${ms.toFixed(0).padStart(7)} ms  ${text}`;
}
