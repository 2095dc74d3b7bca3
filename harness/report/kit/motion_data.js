// Unpacks motion for the player: see `motion_player.py` for the format. Arrays are read when they are first needed.
const MotionData = (() => {
  "use strict";

  async function inflate(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).arrayBuffer();
  }

  function bytesOfBase64(text) {
    return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  }

  // One chunk -> { frames, columns, values }, the values row by row as integers.
  function decode(buffer) {
    const view = new DataView(buffer), frames = view.getUint32(0, true), columns = view.getUint32(4, true);
    const bytes = new Uint8Array(buffer, 8, frames * columns), values = new Int32Array(frames * columns);
    let escaped = 8 + frames * columns;
    for (let c = 0, at = 0; c < columns; c += 1) {
      for (let f = 0, sum = 0; f < frames; f += 1, at += 1) {
        let code = bytes[at];
        if (code === 255) {
          code = view.getUint32(escaped, true);
          escaped += 4;
        }
        sum += code & 1 ? -((code + 1) / 2) : code / 2;
        values[f * columns + c] = sum;
      }
    }
    return { frames, columns, values };
  }

  class Data {
    // `read` takes a chunk of the description to its compressed bytes.
    constructor(description, read) {
      Object.assign(this, description);
      this.read = read;
      this.loaded = new Map();
    }

    // The description of a clip; a server gives it on request.
    async clip(n) {
      const clip = this.clips[n];
      if (clip.href && !clip.tracks) Object.assign(clip, JSON.parse(new TextDecoder().decode(await this.read(clip.href))));
      return clip;
    }

    // All chunks of one array, joined: values times `scale`, in rows of `columns`. `progress` gets the share that is read.
    array(chunks, scale, progress = () => {}) {
      const key = chunks.join("|");
      if (!this.loaded.has(key)) this.loaded.set(key, this.#load(chunks, scale, progress));
      return this.loaded.get(key);
    }

    async #load(chunks, scale, progress) {
      let done = 0;
      const parts = await Promise.all(chunks.map(async (chunk) => {
        const part = decode(await inflate(await this.read(chunk)));
        progress((done += 1) / chunks.length);
        return part;
      }));
      const columns = parts[0].columns, out = new Float32Array(parts.reduce((n, p) => n + p.values.length, 0));
      let at = 0;
      for (const part of parts) for (const value of part.values) out[at++] = value * scale;
      return { columns, values: out };
    }

    // Joint centres [frame][joint][axis] in metres, from vectors that each joint has relative to the one before it.
    async joints(chunks, progress) {
      const key = `joints ${chunks.join("|")}`;
      if (!this.loaded.has(key)) {
        this.loaded.set(key, this.array(chunks, 0.001, progress).then(({ columns, values }) => {
          const joints = Float32Array.from(values);
          for (let row = 0; row < joints.length; row += columns) {
            for (const [from, to] of this.bones) for (let i = 0; i < 3; i += 1) joints[row + 3 * to + i] += joints[row + 3 * from + i];
          }
          return { columns, values: joints };
        }));
      }
      return this.loaded.get(key);
    }
  }

  // The data that a page holds itself.
  async function ofPage(id) {
    return new Data(JSON.parse(document.getElementById(id).textContent), async (chunk) => bytesOfBase64(chunk));
  }

  // The data that a server sends.
  async function ofServer(address) {
    const get = async (path) => {
      const answer = await fetch(path);
      if (!answer.ok) throw new Error((await answer.text()).trim() || `${path}: ${answer.status}`);
      return answer;
    };
    return new Data(await (await get(address)).json(), async (chunk) => (await get(chunk)).arrayBuffer());
  }
  return { ofPage, ofServer };
})();
