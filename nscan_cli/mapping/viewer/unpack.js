// The data of a viewer: gzip of a JSON header and the arrays that it lists, as viewer_data.py packs them.

const KINDS = { f4: Float32Array, i4: Int32Array, u1: Uint8Array };

async function unpack(element) {
  const text = element.querySelector("script").textContent.trim();
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = await new Response(stream).arrayBuffer();
  const length = new DataView(bytes).getUint32(0, true);
  const data = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  for (const [name, kind, place, count] of data.arrays) {
    data[name] = new KINDS[kind](bytes, 4 + length + place, count);
  }
  data.count = data.numbers.length;
  return data;
}

// The row in scanNodes of the scan that is nearest in order to a node; −1 if there are no scans.
function scanNear(data, node) {
  const nodes = data.scanNodes;
  if (!nodes.length) return -1;
  let low = 0, high = nodes.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (nodes[middle] < node) low = middle + 1; else high = middle;
  }
  return low > 0 && node - nodes[low - 1] <= nodes[low] - node ? low - 1 : low;
}

// The pose a time (s) after that of a node, between the nodes beside it.
function poseAfter({ poses, times, count }, node, delay) {
  if (!delay || count < 2) return poses.subarray(3 * node, 3 * node + 3);
  const time = times[node] + delay;
  let k = Math.min(node, count - 2);
  while (k < count - 2 && times[k + 1] < time) k++;
  while (k > 0 && times[k] > time) k--;
  const share = Math.min(1, Math.max(0, (time - times[k]) / (times[k + 1] - times[k] || 1)));
  const [from, to] = [poses.subarray(3 * k, 3 * k + 3), poses.subarray(3 * k + 3, 3 * k + 6)];
  const turn = to[2] - from[2], shorter = Math.atan2(Math.sin(turn), Math.cos(turn));
  return [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1]), from[2] + share * shorter];
}

// The end points of a scan's beams in the map: x, y, x, y, … (m).
function scanPoints(data, row) {
  const node = data.scanNodes[row], { beams, unit, mount } = data, half = data.ranges.length / 2;
  const [first, step] = data.beamAngles.subarray(2 * row, 2 * row + 2);
  // A laser that turns sees every beam from where it is then.
  const [delay, period] = data.beamTimes ? data.beamTimes.subarray(2 * row, 2 * row + 2) : [0, 0];
  const points = [];
  for (let beam = 0, range = 0; beam < beams; beam++) {
    // The difference to the beam before, with its sign in the lowest bit, in two bytes that stand apart.
    const coded = data.ranges[row * beams + beam] | (data.ranges[half + row * beams + beam] << 8);
    range = (range + ((coded >> 1) ^ -(coded & 1))) & 0xffff;
    if (!range) continue;
    const [x, y, heading] = poseAfter(data, node, delay + beam * period);
    const [c, s, angle] = [Math.cos(heading), Math.sin(heading), heading + mount[2] + first + beam * step];
    points.push(x + mount[0] * c - mount[1] * s + unit * range * Math.cos(angle),
      y + mount[0] * s + mount[1] * c + unit * range * Math.sin(angle));
  }
  return points;
}
