// A person at the page of `play --web`: keys, clicks and a held button. Arguments: link, Chromium, where the picture goes.
import { createRequire } from "node:module";

const puppeteer = createRequire(import.meta.url)(process.env.PUPPETEER);
const [link, executablePath, picture] = process.argv.slice(2);
const timeout = 1000 * Number(process.env.PATIENCE_S);
const args = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];

const browser = await puppeteer.launch({ executablePath, headless: true, args, protocolTimeout: 3 * timeout });
try {
  const page = await browser.newPage();
  const errors = [];
  page.on("pageerror", (error) => errors.push(error.message));
  await page.setViewport({ width: 1100, height: 720 });
  await page.goto(link, { timeout });
  const said = (words) =>
    page.waitForFunction((words) => document.body.innerText.includes(words), { timeout, polling: 100 }, words);
  const button = async (label) => {
    const find = (label) => [...document.querySelectorAll("button")].find((each) => each.textContent === label);
    const handle = await page.waitForFunction(find, { timeout, polling: 100 }, label);
    return handle.asElement();
  };
  const walks = (gait) => // the report's first word
    page.waitForFunction((gait) => document.querySelector("b")?.textContent === gait, { timeout, polling: 100 }, gait);
  const pause = (ms) => new Promise((done) => setTimeout(done, ms));

  await said("student drives");
  await button("Stand up"); // the page is complete
  await page.keyboard.down("KeyW");
  await page.keyboard.down("ArrowLeft");
  await said("phase");
  await pause(1500);
  await page.screenshot({ path: picture });
  await page.keyboard.up("KeyW");
  await page.keyboard.up("ArrowLeft");

  await page.keyboard.press("Digit2");
  await walks("bound");
  await (await button("5 pace")).click();
  await walks("pace");
  await (await button("Expert")).click();
  await said("expert drives");
  await page.keyboard.press("KeyT");
  await said("student drives");

  const pad = await (await button("S ▼")).boundingBox();
  await page.mouse.move(pad.x + pad.width / 2, pad.y + pad.height / 2);
  await page.mouse.down();
  await pause(1500);
  await page.mouse.up();
  await page.keyboard.press("Space");
  await said("paused");
  await page.keyboard.press("Space");
  await page.waitForFunction(() => !document.body.innerText.includes("paused"), { timeout, polling: 100 });
  await page.keyboard.down("KeyQ"); // and goes away with the key down
  await pause(1500);
  if (errors.length) throw new Error(errors.join("\n"));
} finally {
  await browser.close();
}
