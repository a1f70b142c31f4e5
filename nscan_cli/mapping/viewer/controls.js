// The controls of a viewer: buttons, layers, the slider of time, and lists to choose from.

// An element with attributes, and children that are elements or text.
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

function button(text, label, pressed) {
  const made = make("button", { type: "button", title: label, "aria-label": label }, text);
  made.addEventListener("click", pressed);
  return made;
}

const LAYERS = [
  ["path", "path", true],
  ["loops", "loops", true],
  ["refused", "refused loops", false],
  ["relations", "relations", false],
  ["keyframes", "keyframes", false],
  ["uncertainty", "uncertainty", false],
  ["scan", "scan under the pointer", true],
  ["notices", "notices", true],
];

// Whether the data has something of a layer.
function hasLayer(data, layer) {
  return {
    loops: data.loops.some((loop) => loop.accepted),
    refused: data.loops.some((loop) => !loop.accepted),
    relations: data.nscan.length + data.pairwise.length > 0,
    uncertainty: data.sigma.some((value, k) => k % 3 === 0 && value > 0),
    scan: data.scanNodes.length > 0,
    notices: data.notices.some((notice) => notice.places.length),
  }[layer] ?? true;
}

function layerBoxes(data, view, factor, changed) {
  const boxes = make("div", { class: "layers" });
  for (const [layer, text, on] of LAYERS) {
    view.shown[layer] = on && hasLayer(data, layer);
    if (!hasLayer(data, layer)) continue;
    const box = make("input", { type: "checkbox", "data-layer": layer });
    box.checked = on;
    box.addEventListener("change", () => {
      view.shown[layer] = box.checked;
      changed();
    });
    const words = layer === "uncertainty" ? `3 sigma${factor > 1 ? `, enlarged ${factor} times` : ""}` : text;
    boxes.append(make("label", {}, box, make("span", { class: `key ${layer}` }), words));
  }
  return boxes;
}

// The slider over the nodes, and a button that lets time run; all of it takes half a minute.
function timeline(data, view, changed) {
  const last = data.count - 1, words = make("output", {});
  const slider = make("input", { type: "range", min: 0, max: last, value: last, "aria-label": "time" });
  let running = null;
  const set = (node) => {
    view.time = view.node = node;
    slider.value = node;
    words.textContent = `scan ${data.numbers[node]}, ${clockText(data.times[node])}`;
    changed();
  };
  const stop = () => {
    cancelAnimationFrame(running);
    running = null;
    play.textContent = "▶";
  };
  const play = button("▶", "play", () => {
    if (running !== null) return stop();
    play.textContent = "❚❚";
    const from = view.time >= last ? 0 : view.time;
    let began = null;
    const step = (now) => {
      began ??= now;
      const node = Math.min(last, from + Math.round(((now - began) / 30000) * last));
      set(node);
      if (node < last) running = requestAnimationFrame(step); else stop();
    };
    running = requestAnimationFrame(step);
  });
  slider.addEventListener("input", () => {
    stop();
    set(Number(slider.value));
  });
  const row = make("div", { class: "time" }, play, slider, words);
  words.textContent = `${data.count.toLocaleString("en")} scans, ${clockText(data.times[last])}`;
  return { row, set: (node) => { stop(); set(node); } };
}

// Minutes and seconds since the first scan.
function clockText(seconds) {
  return `${Math.floor(seconds / 60)}:${(seconds % 60).toFixed(1).padStart(4, "0")} min`;
}

function loopText(data, loop) {
  const [a, b] = loop.nodes.map((node) => data.numbers[node]);
  const verdict = loop.accepted ? "accepted" : "refused";
  return `scans ${a} and ${b}: ${verdict}${loop.reason ? `: ${loop.reason}` : ""}, score ${loop.score.toPrecision(2)}`;
}

// The numbered notices and the refused loops; a click goes to the place.
function lists(data, view, camera, layers, changed) {
  const go = (nodes) => {
    const places = nodes.map(layers.at), xs = places.map(([x]) => x), ys = places.map(([, y]) => y);
    const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    camera.show((left + right) / 2, (low + high) / 2, 0.7 * Math.max(right - left, high - low));
  };
  const found = [];
  if (data.notices.length) {
    const items = data.notices.map(({ text, places }, k) => {
      if (!places.length) return make("li", {}, text);
      const choose = () => {
        view.notice = k;
        go(places.flatMap(([first, last]) => [first, (first + last) >> 1, last]));
        changed();
      };
      const shown = make("button", { type: "button" }, text);
      shown.addEventListener("click", choose);
      return make("li", {}, shown);
    });
    found.push(make("h2", {}, "Notices"), make("ol", { class: "notices" }, ...items));
  }
  const refused = data.loops.filter((loop) => !loop.accepted);
  if (refused.length) {
    const items = refused.map((loop) => {
      const shown = make("button", { type: "button" }, loopText(data, loop));
      shown.addEventListener("click", () => {
        view.loop = loop;
        go(loop.nodes);
        changed();
      });
      return make("li", {}, shown);
    });
    const count = `${refused.length.toLocaleString("en")} refused loop${refused.length > 1 ? "s" : ""}`;
    found.push(make("details", {}, make("summary", {}, count), make("ul", {}, ...items)));
  }
  return found;
}
