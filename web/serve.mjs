/** Serves build/site on this machine, compressed as a public host does: `npm run serve`. */
import { createReadStream, existsSync, statSync } from "node:fs";
import { createServer } from "node:http";
import { dirname, extname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { createGzip } from "node:zlib";

const TYPES = {
  ".html": "text/html; charset=utf-8", ".css": "text/css", ".js": "text/javascript", ".json": "application/json",
  ".wasm": "application/wasm", ".xml": "text/xml", ".svg": "image/svg+xml", ".txt": "text/plain; charset=utf-8", ".md": "text/plain",
};
/** The built site. */
export const SITE = join(dirname(fileURLToPath(import.meta.url)), "build", "site");

/** A server of a folder on the loopback interface; port 0 is any free one. */
export function serve(port = 0, folder = SITE) {
  const server = createServer((request, response) => {
    const path = asked(request.url);
    if (path === null) {
      response.writeHead(400).end("no address");
      return;
    }
    const file = join(folder, path.endsWith("/") ? join(path, "index.html") : path);
    if (!file.startsWith(folder) || !existsSync(file) || !statSync(file).isFile()) {
      response.writeHead(404).end("not found");
      return;
    }
    response.writeHead(200, { "content-type": TYPES[extname(file)] ?? "application/octet-stream", "content-encoding": "gzip" });
    createReadStream(file).pipe(createGzip({ level: 1 })).pipe(response);
  });
  return new Promise((resolve) => server.listen(port, "127.0.0.1", () => resolve(server)));
}

/** The path that a request asks for; null if there is none in it. */
function asked(address) {
  try {
    const path = normalize(decodeURIComponent(new URL(address, "http://localhost").pathname));
    return path.includes("\0") ? null : path;
  } catch {
    return null;
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  if (!existsSync(SITE)) {
    console.error("build/site is missing: run `make web` in the repository's root first");
    process.exit(1);
  }
  const server = await serve(Number(process.argv[2] ?? 8080));
  console.log(`http://localhost:${server.address().port}/   (Ctrl-C ends it)`);
}
