/** MuJoCo's WebAssembly module; the page and the tests load it in the same way. */
import loadMujoco from "@mujoco/mujoco";

/** @param wasmBinary bytes of "mujoco.wasm". */
export function loadModule(wasmBinary) {
  return loadMujoco({ wasmBinary, print: () => {}, printErr: (text) => console.warn(text) });
}
