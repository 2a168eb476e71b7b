import assert from "node:assert/strict";
import { request } from "node:http";
import test from "node:test";
import { fileURLToPath } from "node:url";

import { serve } from "../serve.mjs";

/** Status of the answer to a path that is sent as it is. */
const status = (port, path) => new Promise((resolve, reject) => {
  request({ port, path, host: "127.0.0.1" }, (response) => resolve(response.resume().statusCode)).on("error", reject).end();
});

test("an address that is none is answered, and the server goes on", async () => {
  const server = await serve(0, fileURLToPath(new URL(".", import.meta.url)));
  const { port } = server.address();
  assert.equal(await status(port, "/%"), 400);
  assert.equal(await status(port, "/%00"), 400);
  assert.equal(await status(port, "/../package.json"), 404);
  assert.equal(await status(port, "/serve.test.mjs"), 200);
  server.close();
});
