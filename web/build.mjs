/** Builds the page into build/site: bundles, MuJoCo without its debug sections, what Python wrote, licenses. */
import { cpSync, existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

import { sizes, total } from "./sizes.mjs";
import { withoutSections } from "./wasm_sections.mjs";

const root = dirname(fileURLToPath(import.meta.url));
const site = join(root, "build", "site"), data = join(root, "build", "data");
const resolve = createRequire(import.meta.url).resolve;

if (!existsSync(join(data, "constants.json"))) {
  console.error("build/data is missing: run `python -m web.export` from the repository's root first, or `make web`");
  process.exit(1);
}
rmSync(site, { recursive: true, force: true });
mkdirSync(site, { recursive: true });
await build({
  entryPoints: ["main", "page", "worker"].map((name) => join(root, "src", `${name}.js`)),
  outdir: site,
  bundle: true,
  format: "esm",
  minify: true,
  target: "es2022",
  legalComments: "none",
  external: ["./page.js", "module", "node:*", "fs", "path", "url"], // the page's second part; what MuJoCo's loader asks for in node alone
  logLevel: "warning",
});
for (const name of ["index.html", "style.css", "icon.svg"]) cpSync(join(root, name), join(site, name));
cpSync(data, site, { recursive: true });
const wasm = readFileSync(resolve("@mujoco/mujoco/mujoco.wasm"));
writeFileSync(join(site, "mujoco.wasm"), withoutSections(wasm, /^(name|producers|\.debug_.*|sourceMappingURL|external_debug_info)$/));
writeFileSync(join(site, "constants.json"), JSON.stringify(JSON.parse(readFileSync(join(data, "constants.json"), "utf8"))));
writeFileSync(join(site, "licenses.txt"), licenses());
writeFileSync(join(site, ".nojekyll"), "");
report();

/** The licenses of everything that is shipped. */
function licenses() {
  const text = (path) => readFileSync(path, "utf8").trim();
  const parts = [
    ["go1-mtl-gym: this page, the policy and the robot's model", text(join(root, "..", "LICENSE"))],
    ["The robot's model: sources of its figures", text(join(root, "..", "go1_mtl_gym", "assets", "NOTICE.md"))],
    ["three.js", text(join(dirname(resolve("three")), "..", "LICENSE"))],
    ["MuJoCo (npm package @mujoco/mujoco, which holds no copy of its license), Copyright DeepMind Technologies Limited", text(join(root, "licenses", "Apache-2.0.txt"))],
    ["Libraries inside MuJoCo", text(join(root, "licenses", "MUJOCO_PARTS.txt"))],
  ];
  return parts.map(([title, body]) => `${title}\n${"=".repeat(title.length)}\n\n${body}\n`).join("\n\n");
}

/** Sizes, as they are sent with compression. */
function report() {
  const files = sizes(site), line = ({ bytes, gzipped }) => `${(bytes / 1e6).toFixed(3).padStart(8)} MB ${(gzipped / 1e6).toFixed(3).padStart(8)} MB gzipped`;
  for (const file of files) console.log(`${line(file)}  ${file.name}`);
  console.log(`${line(total(files.filter(({ first }) => first)))}  before the first motion\n${line(total(files))}  in all`);
}
