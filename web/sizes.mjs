/** What a built site weighs, as it is and compressed as hosts send it. */
import { readdirSync, readFileSync, statSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";

/** {name, bytes, gzipped, first: whether it comes before the first motion} of every file. */
export function sizes(site) {
  const later = comesLater(JSON.parse(readFileSync(join(site, "constants.json"), "utf8")));
  const files = readdirSync(site, { recursive: true }).filter((name) => statSync(join(site, name)).isFile());
  return files.sort().map((name) => {
    const bytes = readFileSync(join(site, name));
    return { name, bytes: bytes.length, gzipped: gzipSync(bytes, { level: 9 }).length, first: !later.has(name) };
  });
}

/** Sums of "bytes" and "gzipped" over files. */
export function total(files) {
  const sum = (key) => files.reduce((before, file) => before + file[key], 0);
  return { bytes: sum("bytes"), gzipped: sum("gzipped") };
}

/** Files that the first motion does not wait for: other gaits, other policies, licenses. */
function comesLater({ policies }) {
  const { shared, heads } = policies.multi_head, names = (parts) => Object.values(parts).map(({ file }) => file);
  const later = new Set(["licenses.txt", ...names(heads).slice(1)]);
  for (const { estimator, student } of Object.values(policies)) {
    if (estimator) [estimator.weights.file, student.shared.file, ...names(student.heads)].forEach((file) => later.add(file));
  }
  for (const file of [shared.file, names(heads)[0]]) later.delete(file);
  return later;
}
