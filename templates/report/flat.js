"use strict";
const mm = (x) => (Number.isFinite(x) ? `${x.toFixed(3)} mm` : "not known");
const STOPS = [[22, 138, 128], [222, 160, 20], [197, 34, 31]]; // small, middle, large: seen on white and on black
const SHADES = 24;

/** Colour of a size between 0 and 1. */
function shade(x) {
  const at = Math.min(Math.max(Number.isFinite(x) ? x : 0, 0), 1) * (STOPS.length - 1);
  const k = Math.min(Math.floor(at), STOPS.length - 2);
  const mixed = STOPS[k].map((c, i) => Math.round(c + (at - k) * (STOPS[k + 1][i] - c)));
  return `rgb(${mixed.join(",")})`;
}

function legend(most, unit) {
  const ramp = Array.from({ length: 9 }, (_, i) => shade(i / 8)).join(",");
  return element("span", { class: "legend" }, `0`, element("span", { class: "ramp", style: `background: linear-gradient(90deg, ${ramp})` }), `${short(most)} ${unit}`);
}

// A view in space that can be turned: by mouse, by touch, and by keys. What stands in it is drawn by its scene.

class Space {
  /** @param scene {draw(space, pen), near(space, x, y): {text, pick?}|null, box: [low, high], label} */
  constructor(host, scene) {
    Object.assign(this, { host, scene });
    this.yaw = -0.9; this.pitch = 0.5; this.zoom = 1; this.busy = 0;
    this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": `${scene.label} Arrow keys turn the view, plus and minus zoom.` });
    this.tip = element("div", { class: "tip", role: "tooltip", hidden: "" });
    host.append(this.canvas, this.tip);
    this.frame(scene.box);
    this.listen();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    drawAgain(() => this.draw());
  }

  /** Look at a box [[x, y, z], [x, y, z]]. */
  frame([low, high]) {
    this.center = low.map((x, i) => (x + high[i]) / 2);
    this.radius = Math.max(Math.hypot(...low.map((x, i) => high[i] - x)) / 2, 1e-3);
    this.zoom = 1;
    this.later();
  }

  look(yaw, pitch) { this.yaw = yaw; this.pitch = pitch; this.later(); }

  listen() {
    const touching = new Map();
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId);
      touching.set(e.pointerId, [e.clientX, e.clientY]);
      this.moved = 0;
    });
    canvas.addEventListener("pointermove", (e) => {
      const before = touching.get(e.pointerId);
      if (!before) return this.hover(e);
      const dx = e.clientX - before[0], dy = e.clientY - before[1];
      this.moved += Math.abs(dx) + Math.abs(dy);
      if (touching.size === 2) {
        const [a, b] = [...touching.values()];
        const old = Math.hypot(a[0] - b[0], a[1] - b[1]);
        touching.set(e.pointerId, [e.clientX, e.clientY]);
        const [c, d] = [...touching.values()];
        this.zoomBy(Math.hypot(c[0] - d[0], c[1] - d[1]) / (old || 1));
        this.pan(dx / 2, dy / 2);
      } else {
        touching.set(e.pointerId, [e.clientX, e.clientY]);
        if (e.shiftKey || e.buttons === 2 || e.buttons === 4) this.pan(dx, dy);
        else this.turn(-0.008 * dx, 0.008 * dy);
      }
    });
    const end = (e) => {
      if (touching.delete(e.pointerId) && this.moved < 6 && e.type === "pointerup") this.pick(e);
      this.settle();
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("pointerleave", () => { this.tip.hidden = true; });
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("wheel", (e) => { e.preventDefault(); this.zoomBy(Math.exp(-0.0015 * e.deltaY)); this.settle(); }, { passive: false });
    canvas.addEventListener("keydown", (e) => {
      const turn = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
      const zoom = { "+": 1.2, "=": 1.2, "-": 1 / 1.2 }[e.key];
      if (!turn && !zoom) return;
      e.preventDefault();
      if (turn) this.turn(...turn); else this.zoomBy(zoom);
      this.settle();
    });
  }

  turn(dyaw, dpitch) {
    this.yaw += dyaw;
    this.pitch = Math.min(Math.max(this.pitch + dpitch, -Math.PI / 2), Math.PI / 2);
    this.busy = 1;
    this.later();
  }

  zoomBy(factor) { this.zoom = Math.min(Math.max(this.zoom * factor, 0.1), 500); this.busy = 1; this.later(); }

  pan(dx, dy) {
    const scale = 1 / this.scale();
    const [right, up] = this.axes();
    this.center = this.center.map((c, i) => c - scale * (dx * right[i] - dy * up[i]));
    this.busy = 1;
    this.later();
  }

  /** Directions on the screen in space: to the right, up, towards the eye. */
  axes() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return [[-sy, cy, 0], [-sp * cy, -sp * sy, cp], [cp * cy, cp * sy, sp]];
  }

  /** Pixels of a metre. */
  scale() { return (this.zoom * 0.62 * Math.min(this.width, this.height)) / this.radius; }

  /** Function from a place to pixels. */
  projection() {
    const [r, u] = this.axes(), scale = this.scale(), [cx, cy, cz] = this.center;
    const w = this.width / 2, h = this.height / 2;
    return (x, y, z) => {
      x -= cx; y -= cy; z -= cz;
      return [w + scale * (r[0] * x + r[1] * y), h - scale * (u[0] * x + u[1] * y + u[2] * z)];
    };
  }

  later() {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => { this.pending = 0; this.draw(); });
  }

  settle() { clearTimeout(this.rest); this.rest = setTimeout(() => { this.busy = 0; this.later(); }, 120); }

  draw() {
    const ratio = onPaper() ? 2 : devicePixelRatio || 1;
    if (!this.canvas.clientWidth) return;
    this.width = onPaper() ? PAPER : this.canvas.clientWidth;
    this.height = onPaper() ? 420 : this.canvas.clientHeight;
    this.canvas.width = this.width * ratio; this.canvas.height = this.height * ratio;
    const pen = this.canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, this.width, this.height);
    pen.lineJoin = pen.lineCap = "round";
    this.scene.draw(this, pen);
    this.triad(pen);
  }

  /** The axes x, y, z in the corner. */
  triad(pen) {
    const [r, u] = this.axes(), at = [34, this.height - 34];
    pen.font = "12px system-ui, sans-serif"; pen.textAlign = "center"; pen.textBaseline = "middle";
    ["x", "y", "z"].forEach((name, i) => {
      const tip = [at[0] + 20 * r[i], at[1] - 20 * u[i]];
      pen.strokeStyle = pen.fillStyle = css("--faint"); pen.lineWidth = 1.5;
      pen.beginPath(); pen.moveTo(...at); pen.lineTo(...tip); pen.stroke();
      pen.fillText(name, at[0] + 29 * r[i], at[1] - 29 * u[i]);
    });
  }

  /** A grid of the floor z = 0 around what is seen. */
  floor(pen, step = 0.5) {
    const at = this.projection(), reach = 4;
    pen.strokeStyle = css("--grid"); pen.lineWidth = 1;
    pen.beginPath();
    for (let k = -reach; k <= reach; k++) {
      pen.moveTo(...at(step * k, -step * reach, 0)); pen.lineTo(...at(step * k, step * reach, 0));
      pen.moveTo(...at(-step * reach, step * k, 0)); pen.lineTo(...at(step * reach, step * k, 0));
    }
    pen.stroke();
  }

  hover(e) {
    const box = this.canvas.getBoundingClientRect();
    const found = this.scene.near(this, e.clientX - box.left, e.clientY - box.top);
    this.tip.hidden = !found;
    this.canvas.style.cursor = found && found.pick ? "pointer" : "grab";
    if (!found) return;
    this.tip.textContent = found.text;
    const x = e.clientX - box.left, right = x > this.width / 2;
    Object.assign(this.tip.style, { top: `${e.clientY - box.top + 14}px`, left: right ? "auto" : `${x + 10}px`, right: right ? `${this.width - x + 10}px` : "auto" });
  }

  pick(e) {
    const box = this.canvas.getBoundingClientRect();
    const found = this.scene.near(this, e.clientX - box.left, e.clientY - box.top);
    if (found && found.pick) found.pick();
  }
}

/** The smallest box round places x, y, z, x, y, z, .. */
function boxOf(places) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < places.length; i++) {
    if (places[i] < low[i % 3]) low[i % 3] = places[i];
    if (places[i] > high[i % 3]) high[i % 3] = places[i];
  }
  return [low, high];
}

/** The place of a list that is nearest to a pixel, not farther than so many pixels; -1 where there is none. */
function nearest(space, places, rows, x, y, reach = 14) {
  const at = space.projection();
  let best = -1, least = reach * reach;
  for (const i of rows) {
    const [px, py] = at(places[3 * i], places[3 * i + 1], places[3 * i + 2]);
    const square = (px - x) ** 2 + (py - y) ** 2;
    if (square < least) { least = square; best = i; }
  }
  return best;
}

/** A button for every way to look, for the tools of a view. */
function lookButtons(space, boxes) {
  const ways = { above: [-Math.PI / 2, Math.PI / 2], front: [0, 0], side: [-Math.PI / 2, 0], "3-D": [-0.9, 0.5] };
  const buttons = Object.entries(ways).map(([name, way]) =>
    element("button", { type: "button", onclick: () => space.look(...way) }, name === "3-D" ? name : `from ${name === "above" ? name : `the ${name}`}`));
  const fits = Object.entries(boxes).map(([name, box]) =>
    element("button", { type: "button", onclick: () => space.frame(typeof box === "function" ? box() : box) }, name));
  return element("span", { class: "buttons", role: "group", "aria-label": "view" }, ...buttons, ...fits);
}
