/** The Chromium that the page is tried in; the variable CHROMIUM names another. */
import { existsSync } from "node:fs";

const PLACES = ["/usr/bin/chromium", "/usr/bin/google-chrome", "/usr/bin/chromium-browser"];
const SOFTWARE_OPENGL = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];

/** Path of it; undefined if there is none. */
export const chromium = process.env.CHROMIUM ?? PLACES.find(existsSync);

/** How puppeteer starts it. */
export const browserOptions = () => ({ executablePath: chromium, headless: true, args: ["--no-sandbox", ...SOFTWARE_OPENGL] });
