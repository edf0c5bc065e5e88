// What payload.py and keyframes.py pack, unpacked.

function blocksOf(buffer) {
  const view = new DataView(buffer);
  const blocks = [];
  let at = 4;
  for (let n = view.getUint32(0, true); n > 0; n--) {
    const length = view.getUint32(at, true);
    blocks.push(new Uint8Array(buffer, at + 4, length));
    at += 4 + length;
  }
  return blocks;
}

// The inverse of keyframes.py: differences of 16 bit steps to values.
function animationsOf(block) {
  const copy = block.slice().buffer;
  const length = new DataView(copy).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(copy, 4, length)));
  const steps = new Uint16Array(copy, 4 + length);
  const n = head.frames;
  const times = Float32Array.from({length: n}, (_, i) => i * (head.end - head.start) / (n - 1));
  const clips = new Map();
  let at = 0;
  for (const track of head.tracks) {
    const size = track.low.length;
    const values = new Float32Array(n * size);
    for (let k = 0; k < size; k++) {
      let whole = 0;
      for (let i = 0; i < n; i++) {
        whole = (whole + steps[at++]) & 0xffff;
        values[i * size + k] = track.low[k] + track.step[k] * whole;
      }
    }
    if (!clips.has(track.path)) clips.set(track.path, []);
    clips.get(track.path).push({name: track.name, type: track.type, times, values});
  }
  return Array.from(clips, ([path, tracks]) => ({
    path: path.split("/").filter((step) => step),
    clip: {fps: 1, name: "run", tracks},
  }));
}

async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

async function fetched() {
  const answer = await fetch("scene");
  const buffer = await answer.arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, length));
  return [JSON.parse(text), buffer.slice(4 + length)];
}
