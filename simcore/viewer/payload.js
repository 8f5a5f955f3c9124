// Blocks of data in the page → arrays. A block is gzip, in base64: the length of a JSON header, the header, the arrays.
(() => {
  "use strict";
  const replay = (window.simcoreReplay = window.simcoreReplay || {});
  const TYPES = { u1: Uint8Array, u2: Uint16Array, u4: Uint32Array, i2: Int16Array, f4: Float32Array };
  const blocks = new Map();

  /** Return the header of a block with its arrays beside it; a block is unpacked once. */
  replay.unpack = (id) => {
    if (!blocks.has(id)) blocks.set(id, unpack(id));
    return blocks.get(id);
  };

  async function unpack(id) {
    const text = atob(document.getElementById(`replay-${id}`).textContent.trim());
    const packed = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) packed[i] = text.charCodeAt(i);
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const buffer = await new Response(stream).arrayBuffer();
    const length = new DataView(buffer).getUint32(0, true);
    const block = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    const start = Math.ceil((4 + length) / 4) * 4;
    for (const [name, { type, offset, count }] of Object.entries(block.arrays))
      block[name] = new TYPES[type](buffer, start + offset, count);
    if (block.kind === "run") decode(block);
    return block;
  }

  function decode(run) {
    const frames = run.time.length;
    run.pressure = undoPressure(run.pressure, frames, run.touched.length);
    if (run.sheet) run.shapes = undoShapes(run.sheet_low, run.sheet_high, frames, run.sheet.vertices);
  }

  /** Shares of the scale, stored a vertex after another as steps in time → a frame after another. */
  function undoPressure(steps, frames, count) {
    const shares = new Uint8Array(frames * count);
    for (let vertex = 0; vertex < count; vertex++)
      for (let frame = 0, value = 0; frame < frames; frame++) {
        value = (value + steps[vertex * frames + frame]) & 255;
        shares[frame * count + vertex] = value;
      }
    return shares;
  }

  /** Positions in quanta, stored axis by axis as steps in time, low bytes and high → frame, vertex, axis. */
  function undoShapes(low, high, frames, count) {
    const shapes = new Int16Array(frames * count * 3);
    for (let axis = 0; axis < 3; axis++)
      for (let frame = 0; frame < frames; frame++)
        for (let vertex = 0; vertex < count; vertex++) {
          const from = (axis * frames + frame) * count + vertex;
          const to = (frame * count + vertex) * 3 + axis;
          const folded = low[from] | (high[from] << 8); // 0, −1, 1, −2 … as 0, 1, 2, 3 …
          const step = (folded >>> 1) ^ -(folded & 1);
          shapes[to] = step + (frame ? shapes[to - 3 * count] : 0); // wraps round at 16 bits, as it was packed
        }
    return shapes;
  }
})();
