/** WebAssembly modules without some of their custom sections, such as debug information. */

const HEADER = 8, CUSTOM = 0;

/** An unsigned LEB128 integer, and where it ends. */
function integer(bytes, place) {
  let value = 0, factor = 1, byte;
  do {
    byte = bytes[place++];
    value += (byte & 127) * factor;
    factor *= 128;
  } while (byte & 128);
  return [value, place];
}

/**
 * The same module without the custom sections whose names match.
 *
 * @throws if the bytes are no module.
 */
export function withoutSections(bytes, names) {
  if (bytes.length < HEADER || String.fromCharCode(...bytes.subarray(0, 4)) !== "\0asm") throw new Error("a WebAssembly module was expected");
  const kept = [bytes.subarray(0, HEADER)];
  for (let place = HEADER; place < bytes.length; ) {
    const [size, body] = integer(bytes, place + 1), end = body + size;
    if (end > bytes.length) throw new Error("the WebAssembly module is cut off");
    if (bytes[place] !== CUSTOM || !names.test(nameOf(bytes, body))) kept.push(bytes.subarray(place, end));
    place = end;
  }
  return Buffer.concat(kept);
}

function nameOf(bytes, body) {
  const [length, start] = integer(bytes, body);
  return new TextDecoder().decode(bytes.subarray(start, start + length));
}
