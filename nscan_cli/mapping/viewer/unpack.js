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

// The end points of a scan's beams in the map: x, y, x, y, … (m).
function scanPoints(data, row) {
  const node = data.scanNodes[row], { beams, unit, mount } = data, half = data.ranges.length / 2;
  const [x, y, heading] = data.poses.subarray(3 * node, 3 * node + 3);
  const laserX = x + mount[0] * Math.cos(heading) - mount[1] * Math.sin(heading);
  const laserY = y + mount[0] * Math.sin(heading) + mount[1] * Math.cos(heading);
  const first = heading + mount[2] + data.beamAngles[2 * row], step = data.beamAngles[2 * row + 1];
  const points = [];
  for (let beam = 0, range = 0; beam < beams; beam++) {
    // The difference to the beam before, with its sign in the lowest bit, in two bytes that stand apart.
    const coded = data.ranges[row * beams + beam] | (data.ranges[half + row * beams + beam] << 8);
    range = (range + ((coded >> 1) ^ -(coded & 1))) & 0xffff;
    const angle = first + beam * step;
    if (range) points.push(laserX + unit * range * Math.cos(angle), laserY + unit * range * Math.sin(angle));
  }
  return points;
}
