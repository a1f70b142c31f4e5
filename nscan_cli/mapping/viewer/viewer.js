// A viewer in an element: a stage with the map, the layers above it and a sheet for print, and its controls.

const NEAR = 24;
const NEAR_LOOP = 6;
const PAPER = 1000;
const COLOURS = ["ink", "ground", "loops", "refused", "nscan", "pairwise", "keyframes", "uncertainty", "scan",
  "robot", "notice", "notice-text"];

async function show(element) {
  const image = element.querySelector("img");
  const [data] = await Promise.all([unpack(element), image.decode()]);
  const embedded = element.hasAttribute("data-embedded");
  const layers = new Layers(data, image), camera = new Camera(data.bounds);
  const view = { shown: {}, time: data.count - 1, node: -1, loop: null, notice: -1, measured: [] };
  const [map, above, paper] = ["map", "above", "paper"].map((name) => make("canvas", { class: name }));
  const says = make("output", { class: "says" });
  const stage = make("div", { class: "stage", tabindex: 0, role: "application",
    "aria-label": "Map. Arrow keys move it, + and − zoom, 0 shows all." }, image, paper, map, above, says);
  const [left, bottom, right, top] = data.bounds;
  stage.style.setProperty("--aspect", (right - left) / (top - bottom));
  let waiting = false, later = 0;

  const sized = (canvas, width, height) => {
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  };
  const readColours = () => {
    const style = getComputedStyle(element);
    view.colours = {};
    for (const name of COLOURS) {
      const key = name.replace(/-(.)/, (_, letter) => letter.toUpperCase());
      view.colours[key] = style.getPropertyValue(`--${name}`).trim();
    }
    view.dark = style.getPropertyValue("--dark").trim() === "1";
  };
  const fill = () => {
    waiting = false;
    const { clientWidth: width, clientHeight: height } = stage, ratio = devicePixelRatio || 1;
    camera.resize(width, height);
    if (!width || !height) return;
    for (const canvas of [map, above]) sized(canvas, Math.round(width * ratio), Math.round(height * ratio));
    readColours();
    layers.drawMap(map, camera, ratio);
    layers.draw(above, camera, ratio, view);
  };
  // All of the map with light colours, ready before the page is printed: browsers print badly what is drawn
  // only then.
  const fillPaper = () => {
    const whole = new Camera(data.bounds), [wide, high] = [right - left, top - bottom];
    whole.resize(PAPER * Math.min(1, wide / high), PAPER * Math.min(1, high / wide));
    sized(paper, Math.round(2 * whole.width), Math.round(2 * whole.height));
    element.classList.add("printing");
    readColours();
    layers.draw(paper, whole, 2, view);
    element.classList.remove("printing");
  };
  const changed = () => {
    if (!waiting) requestAnimationFrame(fill);
    waiting = true;
    clearTimeout(later);
    later = setTimeout(fillPaper, 300);
  };

  const toolbar = make("div", { class: "tools" },
    button("+", "larger", () => { camera.zoom(1.6); changed(); }),
    button("−", "smaller", () => { camera.zoom(1 / 1.6); changed(); }),
    button("fit", "all of the map", () => { camera.fit(); changed(); }));
  const measure = button("measure", "measure a distance by two clicks", () => setMeasuring(!measuring));
  toolbar.append(measure);
  let measuring = false;
  const setMeasuring = (on) => {
    measuring = on;
    view.measured = [];
    measure.setAttribute("aria-pressed", on);
    stage.classList.toggle("measuring", on);
    changed();
  };

  // What is nearest to a pixel: a loop that is shown, or a node of the path.
  const under = (px, py) => {
    const place = camera.place(px, py);
    const loops = data.loops.filter((loop) => view.shown[loop.accepted ? "loops" : "refused"]);
    const near = NEAR_LOOP / camera.scale;
    const loop = loops.find(({ nodes }) => distanceToLine(place, ...nodes.map(layers.at)) < near);
    let node = -1, nearest = (NEAR / camera.scale) ** 2;
    for (let k = 0; k < data.count; k++) {
      const square = (data.poses[3 * k] - place[0]) ** 2 + (data.poses[3 * k + 1] - place[1]) ** 2;
      if (square < nearest) [node, nearest] = [k, square];
    }
    return { place, loop, node };
  };
  const tell = ({ place, loop, node }) => {
    const words = [`x ${place[0].toFixed(2)} m, y ${place[1].toFixed(2)} m`];
    if (view.measured.length === 1) {
      words.push(distanceText(Math.hypot(place[0] - view.measured[0][0], place[1] - view.measured[0][1])));
    }
    if (loop) words.push(`loop between ${loopText(data, loop)}`);
    if (node >= 0) {
      const k = data.keyframes.indexOf(node), sigma = k < 0 ? NaN : data.sigma[3 * k];
      words.push(`${k < 0 ? "scan" : "keyframe, scan"} ${data.numbers[node]}, ${clockText(data.times[node])}` +
        (Number.isFinite(sigma) ? `, sigma ${sigma.toPrecision(2)} m` : ""));
    }
    says.textContent = words.join("; ");
  };
  const time = timeline(data, view, changed);
  let chosen = -1;
  stage.addEventListener("pointermove", (event) => {
    if (event.pointerType !== "mouse" || event.buttons) return;
    const box = stage.getBoundingClientRect(), found = under(event.clientX - box.left, event.clientY - box.top);
    view.loop = found.loop ?? null;
    view.node = found.node >= 0 ? found.node : chosen;
    tell(found);
    changed();
  });
  stage.addEventListener("pointerleave", () => {
    view.node = chosen;
    view.loop = null;
    changed();
  });
  moveBy(stage, camera, embedded, changed, (px, py) => {
    const found = under(px, py);
    if (measuring) {
      view.measured = view.measured.length === 1 ? [...view.measured, found.place] : [found.place];
    } else {
      view.loop = found.loop ?? null;
      if (found.node >= 0) time.set(chosen = found.node);
    }
    tell(found);
    changed();
  });
  stage.addEventListener("keydown", (event) => {
    if (event.key === "Escape") setMeasuring(false);
  });
  time.row.addEventListener("input", () => { chosen = view.node; });

  const panel = make("div", { class: "panel" }, toolbar, time.row);
  element.replaceChildren(stage, panel);
  element.classList.add("live");
  camera.resize(stage.clientWidth, stage.clientHeight);
  camera.fit();
  view.factor = layers.enlargement(camera);
  panel.append(layerBoxes(data, view, view.factor, changed));
  if (!embedded) {
    const facts = data.facts.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]);
    panel.append(make("dl", {}, ...facts));
  }
  panel.append(...lists(data, view, camera, layers, changed));
  new ResizeObserver(changed).observe(stage);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
  fill();
  fillPaper();
  element.dispatchEvent(new CustomEvent("shown", { detail: { camera, view, data } }));
}

function distanceToLine([x, y], [ax, ay], [bx, by]) {
  const [dx, dy] = [bx - ax, by - ay], square = dx * dx + dy * dy;
  const share = square ? Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / square)) : 0;
  return Math.hypot(x - ax - share * dx, y - ay - share * dy);
}

for (const element of document.querySelectorAll(".viewer")) {
  show(element).catch((error) => {
    element.append(make("p", { class: "failed" }, `The map cannot be opened in this browser: ${error.message}`));
  });
}
