// What part of the map is in view: metres to pixels of the stage and back.

const MOST_PIXELS_A_METRE = 2000;

class Camera {
  constructor([left, bottom, right, top]) {
    Object.assign(this, { left, bottom, right, top, width: 1, height: 1 });
    this.fit();
  }

  resize(width, height) {
    const fitted = this.isFitted;
    Object.assign(this, { width, height });
    if (fitted) this.fit();
  }

  get fittingScale() {
    return Math.min(this.width / (this.right - this.left), this.height / (this.top - this.bottom));
  }

  fit() {
    this.scale = this.fittingScale;
    this.x = (this.left + this.right) / 2;
    this.y = (this.bottom + this.top) / 2;
    this.isFitted = true;
  }

  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = this.place(px, py);
    const wanted = Math.max(this.scale * factor, this.fittingScale / 2);
    this.scale = Math.min(wanted, MOST_PIXELS_A_METRE);
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
    this.isFitted = false;
  }

  pan(dx, dy) {
    this.x = Math.min(Math.max(this.x - dx / this.scale, this.left), this.right);
    this.y = Math.min(Math.max(this.y + dy / this.scale, this.bottom), this.top);
    this.isFitted = false;
  }

  show(x, y, reach) {
    Object.assign(this, { x, y, isFitted: false });
    this.scale = Math.min(this.width, this.height) / (2 * Math.max(reach, 5));
  }

  // The place (m) of a pixel, and the pixel of a place.
  place(px, py) {
    return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
  }

  pixel(x, y) {
    return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale];
  }

  // Sets a context to metres.
  apply(context, ratio) {
    const [px, py] = this.pixel(0, 0);
    context.setTransform(ratio * this.scale, 0, 0, -ratio * this.scale, ratio * px, ratio * py);
  }
}

// Lets the mouse, fingers, the wheel and keys move a camera. In a page that scrolls, the wheel zooms with
// Ctrl, and one finger scrolls. `tapped` is called with a pixel.
function moveBy(stage, camera, embedded, changed, tapped) {
  const pointers = new Map();
  let moved = false, spread = 0;
  const at = (event) => {
    const box = stage.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  stage.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    pointers.set(event.pointerId, at(event));
    [moved, spread] = [pointers.size > 1, 0];
  });
  stage.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = at(event);
    if (!moved && Math.hypot(now[0] - before[0], now[1] - before[1]) < 4) return;
    if (!moved) stage.setPointerCapture(event.pointerId);
    moved = true;
    pointers.set(event.pointerId, now);
    camera.pan((now[0] - before[0]) / pointers.size, (now[1] - before[1]) / pointers.size);
    if (pointers.size === 2) {
      const [[ax, ay], [bx, by]] = pointers.values(), apart = Math.hypot(ax - bx, ay - by);
      if (spread) camera.zoom(apart / spread, (ax + bx) / 2, (ay + by) / 2);
      spread = apart;
    }
    changed();
  });
  const lift = (event) => {
    if (pointers.delete(event.pointerId) && !moved && event.type === "pointerup") tapped(...at(event), event);
    spread = 0;
  };
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) stage.addEventListener(name, lift);
  stage.addEventListener("wheel", (event) => {
    if (embedded && !event.ctrlKey) return;
    event.preventDefault();
    camera.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.002)), ...at(event));
    changed();
  }, { passive: false });
  stage.addEventListener("keydown", (event) => {
    const steps = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] };
    if (event.key in steps) camera.pan(...steps[event.key]);
    else if (event.key === "+" || event.key === "=") camera.zoom(1.5);
    else if (event.key === "-") camera.zoom(1 / 1.5);
    else if (event.key === "0") camera.fit();
    else return;
    event.preventDefault();
    changed();
  });
}
