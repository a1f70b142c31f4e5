// What is drawn: the map on a canvas of its own, which is inverted in the dark, and the layers above it.

const PATH_PIECES = 48;
const SIGMAS = 3;
const LEAST_ELLIPSE = 12;

function lineThrough(places) {
  const line = new Path2D();
  places.forEach(([x, y], k) => (k ? line.lineTo(x, y) : line.moveTo(x, y)));
  return line;
}

// Halves of the map, each pixel as dark as the darkest of four, so that walls stay visible from afar.
function halvesOf(image) {
  const levels = [image];
  let [width, height] = [image.naturalWidth, image.naturalHeight];
  while (Math.max(width, height) > 400) {
    const canvas = document.createElement("canvas"), below = levels.at(-1);
    const [wide, high] = [width / 2, height / 2];
    [canvas.width, canvas.height] = [Math.ceil(wide), Math.ceil(high)];
    const context = canvas.getContext("2d");
    context.imageSmoothingEnabled = false;
    for (const [dx, dy] of [[0.25, 0.25], [-0.25, 0.25], [0.25, -0.25], [-0.25, -0.25]]) {
      context.drawImage(below, dx, dy, wide, high);
      context.globalCompositeOperation = "darken";
    }
    levels.push(canvas);
    [width, height] = [wide, high];
  }
  return levels;
}

class Layers {
  constructor(data, image) {
    this.data = data;
    this.levels = halvesOf(image);
    const { poses, count } = data;
    this.at = (node) => [poses[3 * node], poses[3 * node + 1]];
    const pairs = (list) => {
      const lines = new Path2D();
      for (let k = 0; k + 1 < list.length; k += 2) {
        lines.moveTo(...this.at(list[k]));
        lines.lineTo(...this.at(list[k + 1]));
      }
      return lines;
    };
    const loops = (accepted) => data.loops.filter((loop) => loop.accepted === accepted)
      .flatMap((loop) => loop.nodes);
    this.lines = { nscan: pairs(data.nscan), pairwise: pairs(data.pairwise),
      loops: pairs(loops(true)), refused: pairs(loops(false)) };
    const size = Math.max(1, Math.ceil((count - 1) / PATH_PIECES));
    this.pieces = [];
    for (let first = 0; first < count - 1; first += size) {
      this.pieces.push([first, Math.min(first + size, count - 1)]);
    }
    this.paths = this.pieces.map((piece) => this.path(...piece));
  }

  path(first, last) {
    return lineThrough(Array.from({ length: last - first + 1 }, (_, k) => this.at(first + k)));
  }

  // The factor by which ellipses are enlarged: 1, 2, 5, 10, … so that they are seen in the whole map.
  enlargement(camera) {
    const { sigma } = this.data;
    let largest = 0;
    for (let k = 0; k < sigma.length; k += 3) largest = Math.max(largest, sigma[k]);
    const wanted = LEAST_ELLIPSE / (camera.fittingScale * SIGMAS * largest);
    if (!(wanted > 1)) return 1;
    const unit = 10 ** Math.floor(Math.log10(wanted));
    return Math.min(1000, unit * [1, 2, 5, 10].find((step) => step * unit >= wanted));
  }

  drawMap(canvas, camera, ratio) {
    const context = canvas.getContext("2d"), { bounds } = this.data;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = "rgb(226, 226, 226)";
    context.fillRect(0, 0, canvas.width, canvas.height);
    const [left, top] = camera.pixel(bounds[0], bounds[3]);
    const [right, bottom] = camera.pixel(bounds[2], bounds[1]);
    const wide = ratio * (right - left);
    const level = Math.floor(Math.log2(this.levels[0].naturalWidth / wide));
    context.imageSmoothingEnabled = wide < 1.5 * this.levels[0].naturalWidth;
    context.imageSmoothingQuality = "high";
    const image = this.levels[Math.min(Math.max(level, 0), this.levels.length - 1)];
    context.drawImage(image, ratio * left, ratio * top, wide, ratio * (bottom - top));
  }

  draw(canvas, camera, ratio, view) {
    const context = canvas.getContext("2d"), { shown, colours } = view, thick = 1 / camera.scale;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    camera.apply(context, ratio);
    context.lineJoin = "round";
    const stroke = (line, colour, width, dashes = []) => {
      Object.assign(context, { strokeStyle: colour, lineWidth: width * thick });
      context.setLineDash(dashes.map((dash) => dash * thick));
      context.stroke(line);
    };
    if (shown.relations) {
      stroke(this.lines.nscan, colours.nscan, 1);
      stroke(this.lines.pairwise, colours.pairwise, 1);
    }
    if (shown.refused) stroke(this.lines.refused, colours.refused, 1.5, [5, 4]);
    if (shown.loops) stroke(this.lines.loops, colours.loops, 1.75);
    if (shown.notices) this.drawStretches(context, view, stroke);
    if (shown.path) this.drawPath(context, view, stroke);
    if (shown.uncertainty) this.drawEllipses(context, view, stroke);
    if (shown.keyframes) this.drawDots(context, this.data.keyframes, 2.5 * thick, colours.keyframes);
    if (view.loop) stroke(lineThrough(view.loop.nodes.map(this.at)), colours.ink, 4);
    if (view.node >= 0) this.drawRobot(context, view, thick);
    this.drawMeasure(context, view, thick, stroke);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawLabels(context, camera, view);
  }

  drawPath(context, { time, dark }, stroke) {
    this.pieces.forEach(([first, last], k) => {
      const share = first / Math.max(1, this.data.count - 1);
      const colour = `hsl(${225 + 165 * share} 75% ${dark ? 68 : 45}%)`;
      context.globalAlpha = first >= time ? 0.22 : 1;
      if (first < time && time < last) {
        stroke(this.path(first, time), colour, 2);
        context.globalAlpha = 0.22;
        stroke(this.path(time, last), colour, 2);
      } else stroke(this.paths[k], colour, 2);
      context.globalAlpha = 1;
    });
  }

  drawEllipses(context, { colours, factor }, stroke) {
    const { keyframes, sigma } = this.data, ellipses = new Path2D();
    keyframes.forEach((node, k) => {
      const [long, short, angle] = sigma.subarray(3 * k, 3 * k + 3), [x, y] = this.at(node);
      if (!Number.isFinite(long)) return;
      const [a, b] = [SIGMAS * factor * long, SIGMAS * factor * short];
      ellipses.moveTo(x + a * Math.cos(angle), y + a * Math.sin(angle));
      ellipses.ellipse(x, y, a, b, angle, 0, 2 * Math.PI);
    });
    stroke(ellipses, colours.uncertainty, 1.25);
  }

  drawDots(context, nodes, radius, colour) {
    const dots = new Path2D();
    for (const node of nodes) {
      const [x, y] = this.at(node);
      dots.moveTo(x + radius, y);
      dots.arc(x, y, radius, 0, 2 * Math.PI);
    }
    context.fillStyle = colour;
    context.fill(dots);
  }

  // The stretches of notices, as broad bands below the path; that of the chosen notice is broader.
  drawStretches(context, { colours, notice }, stroke) {
    context.globalAlpha = 0.55;
    this.data.notices.forEach(({ places }, k) => {
      for (const [first, last] of places) stroke(this.path(first, last), colours.notice, k === notice ? 14 : 8);
    });
    context.globalAlpha = 1;
  }

  drawRobot(context, { node, colours, shown }, thick) {
    const row = shown.scan ? scanNear(this.data, node) : -1;
    if (row >= 0) {
      const points = scanPoints(this.data, row), dots = new Path2D(), side = 3 * thick;
      for (let k = 0; k < points.length; k += 2) {
        dots.rect(points[k] - side / 2, points[k + 1] - side / 2, side, side);
      }
      context.fillStyle = colours.scan;
      context.fill(dots);
    }
    const [x, y] = this.at(node), heading = this.data.poses[3 * node + 2];
    const corner = (angle, size) =>
      [x + size * thick * Math.cos(heading + angle), y + size * thick * Math.sin(heading + angle)];
    const robot = lineThrough([corner(0, 13), corner(2.5, 10), corner(-2.5, 10)]);
    robot.closePath();
    context.fillStyle = colours.robot;
    context.fill(robot);
    Object.assign(context, { strokeStyle: colours.ground, lineWidth: 1.5 * thick });
    context.setLineDash([]);
    context.stroke(robot);
  }

  drawMeasure(context, { measured, colours }, thick, stroke) {
    if (measured.length > 1) stroke(lineThrough(measured), colours.ink, 2);
    for (const [x, y] of measured) {
      context.beginPath();
      context.arc(x, y, 4 * thick, 0, 2 * Math.PI);
      context.fillStyle = colours.ink;
      context.fill();
    }
  }

  // Text in pixels: numbers of notices, the measured distance, and the scale.
  drawLabels(context, camera, { colours, shown, measured }) {
    Object.assign(context, { textAlign: "center", textBaseline: "middle", font: "600 12px system-ui, sans-serif" });
    context.setLineDash([]);
    const written = (text, x, y, colour, ground) => {
      Object.assign(context, { strokeStyle: ground, lineWidth: 4, fillStyle: colour });
      context.strokeText(text, x, y);
      context.fillText(text, x, y);
    };
    if (shown.notices) {
      this.data.notices.forEach(({ places }, k) => {
        for (const [first, last] of places) {
          const [x, y] = camera.pixel(...this.at((first + last) >> 1));
          context.fillStyle = colours.notice;
          context.beginPath();
          context.arc(x, y, 9, 0, 2 * Math.PI);
          context.fill();
          context.fillStyle = colours.noticeText;
          context.fillText(`${k + 1}`, x, y);
        }
      });
    }
    if (measured.length > 1) {
      const [[ax, ay], [bx, by]] = measured, [x, y] = camera.pixel((ax + bx) / 2, (ay + by) / 2);
      written(distanceText(Math.hypot(ax - bx, ay - by)), x, y - 14, colours.ink, colours.ground);
    }
    const length = scaleLength(camera), [left, low] = [14, camera.height - 14];
    context.beginPath();
    context.moveTo(left, low - 6);
    context.lineTo(left, low);
    context.lineTo(left + length * camera.scale, low);
    context.lineTo(left + length * camera.scale, low - 6);
    for (const [colour, width] of [[colours.ground, 5], [colours.ink, 2]]) {
      Object.assign(context, { strokeStyle: colour, lineWidth: width });
      context.stroke();
    }
    written(`${length} m`, left + (length * camera.scale) / 2, low - 12, colours.ink, colours.ground);
  }
}

function distanceText(metres) {
  return `${metres.toFixed(metres < 100 ? 2 : 1)} m`;
}

// A round length of about a fifth of the width, at most 200 pixels, in m.
function scaleLength(camera) {
  const most = Math.min(200, camera.width / 4) / camera.scale, unit = 10 ** Math.floor(Math.log10(most));
  return Number((unit * [5, 2, 1].find((step) => step * unit <= most)).toPrecision(3));
}
