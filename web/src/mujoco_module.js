/** MuJoCo's WebAssembly module; the page and the tests load it in the same way. */
import loadMujoco from "@mujoco/mujoco";

/** The module compiled while it comes, where its host says what it is. @param response to a request for "mujoco.wasm". */
export async function compileModule(response) {
  const isWasm = response.headers.get("content-type")?.startsWith("application/wasm");
  return isWasm ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
}

/** MuJoCo, ready for use. @param module "mujoco.wasm", compiled. */
export function loadModule(module) {
  return new Promise((resolve, reject) => {
    const instantiateWasm = (imports, received) => {
      WebAssembly.instantiate(module, imports).then((instance) => received(instance, module), reject);
      return {}; // its exports come later
    };
    loadMujoco({ instantiateWasm, print: () => {}, printErr: (text) => console.warn(text) }).then(resolve, reject);
  });
}
