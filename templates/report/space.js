"use strict";
// A view in space, drawn by three.js: turned by mouse, touch and keys, and framed so that nothing is cut off.

const MARGIN = 0.86; // share of the view that what is framed fills
const CORNER_MARGIN = 0.74; // the same of a corner, where links are as thick as a part of it
const WAYS = { above: [0, -1e-3, 1], front: [1, 0, 0], side: [0, -1, 0] }; // towards the eye

class Space {
  /**
   * @param host element that the view fills
   * @param options {label, near(x, y): {text, pick?}|null}: what it shows, and what is near a pixel
   */
  constructor(host, { label, near }) {
    Object.assign(this, { host, near, scene: new THREE.Scene(), painted: [], tags: [], frames: 0 });
    const canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": `${label} Arrow keys turn the view, plus and minus zoom.` });
    const context = canvas.getContext("webgl2", { antialias: !drawnByProcessor() });
    if (!context) {
      host.replaceChildren(element("p", { class: "note" }, "This browser draws nothing in space (it has no WebGL): the charts and tables show the same figures."));
      host.classList.add("blank");
      return;
    }
    this.canvas = canvas;
    this.tip = element("div", { class: "tip", role: "tooltip", hidden: "" });
    this.axes = element("div", { class: "axes", "aria-hidden": "true" }, ..."xyz".split("").flatMap((name) => [element("i"), element("span", {}, name)]));
    host.append(canvas, this.axes, this.tip);
    this.gl = new THREE.WebGLRenderer({ canvas, context });
    this.gl.autoClear = false;
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, -100, 100);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("change", () => this.later());
    this.controls.addEventListener("end", () => this.remember());
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a929a, 2.2));
    this.sun = new THREE.DirectionalLight(0xffffff, 1.6);
    this.scene.add(this.sun);
    this.listen();
    new ResizeObserver(() => this.resize()).observe(host);
    drawAgain(() => this.resize());
  }

  /** Whether this browser can draw in space. */
  get works() { return Boolean(this.gl); }

  /** Let a material have a colour of the style sheet, by its name, also when the colours change. */
  paint(material, name) {
    this.painted.push([material, name]);
    material.color.set(css(name));
    return material;
  }

  /**
   * Lines between pairs of places.
   * @param places Float32Array x y z, x y z of each pair
   * @param options {color: name in the style sheet, width: pixels, opacity, dashed}
   */
  lines(places, { color, width = 1, opacity = 1 }) {
    const of = { transparent: opacity < 1, opacity, depthTest: false };
    let made;
    if (width > 1) {
      const geometry = new THREE.LineSegmentsGeometry();
      geometry.setPositions(places);
      made = new THREE.LineSegments2(geometry, this.paint(new THREE.LineMaterial({ linewidth: width, ...of }), color));
    } else {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(places, 3));
      made = new THREE.LineSegments(geometry, this.paint(new THREE.LineBasicMaterial(of), color));
    }
    made.frustumCulled = false;
    return made;
  }

  /** Let a text stand beside a place [x, y, z], or a dot in it. @return {at, text, shown}, to change before later(). */
  tag(kind = "") {
    const made = { at: [0, 0, 0], shown: false, element: element("div", { class: `tag ${kind}`, hidden: "" }) };
    this.host.append(made.element);
    this.tags.push(made);
    return made;
  }

  /**
   * Show places x, y, z, x, y, z, .. whole, from a direction towards the eye; from where it is without one.
   */
  frame(places, direction = null) {
    this.framed = [places, direction];
    if (!this.works || !this.width) return;
    const { camera, controls } = this;
    const eye = direction ? new THREE.Vector3(...direction).normalize() : camera.position.clone().sub(controls.target).normalize();
    [camera.position.copy(eye), controls.target.set(0, 0, 0), camera.zoom = 1];
    camera.lookAt(0, 0, 0);
    const [low, high] = extent(places, camera);
    const middle = new THREE.Vector3().addVectors(low, high).multiplyScalar(0.5).applyQuaternion(camera.quaternion);
    controls.target.copy(middle);
    camera.position.copy(middle).add(eye);
    // Beside a corner with another camera there is room on its left, or below it.
    const corner = this.small?.host.hidden === false ? this.small.host : null, part = (used, of) => (corner ? 1 - (used + 8) / of : 1);
    const rooms = [[part(corner?.offsetWidth, this.width), 1], [1, part(corner?.offsetHeight, this.height)]];
    const zooms = rooms.map(([wide, tall]) => MARGIN / Math.max((high.x - low.x) / 2 / this.aspect / wide, (high.y - low.y) / 2 / tall, 1e-3));
    const k = zooms[0] > zooms[1] ? 0 : 1, [wide, tall] = rooms[k];
    camera.zoom = zooms[k];
    const shift = new THREE.Vector3((1 - wide) * this.aspect, (1 - tall), 0).divideScalar(camera.zoom).applyQuaternion(camera.quaternion);
    controls.target.add(shift);
    camera.position.add(shift);
    camera.updateProjectionMatrix();
    controls.update();
    this.later();
  }

  /** Look from a direction at what is in the middle. */
  look(direction) { if (this.framed) this.frame(this.framed[0], direction); this.remember(); }

  /** Let another camera show one more layer where an element of the host stands, unless that is hidden: places() are whole in it. */
  inset(host, layer, places) { this.small = { host, places, camera: new THREE.OrthographicCamera(-1, 1, 1, -1, -100, 100) }; this.small.camera.layers.enable(layer); }

  /** The view as text for the address: middle, eye, zoom. */
  remember() {
    const { target } = this.controls, view = [...target.toArray(), ...this.camera.position.clone().sub(target).toArray(), this.camera.zoom];
    address.set("view", view.map((x) => Number(x.toPrecision(7))).join(","));
    this.framed = null;
  }

  /** Take the view that the address says. @return whether it says one */
  recall() {
    const view = (address.values.get("view") || "").split(",").map(Number);
    if (!this.works || view.length !== 7 || view.some(Number.isNaN)) return false;
    this.controls.target.fromArray(view);
    this.camera.position.fromArray(view, 3).add(this.controls.target);
    this.camera.zoom = view[6];
    this.framed = null;
    this.resize();
    this.controls.update();
    return true;
  }

  resize() {
    if (!this.works || !this.host.clientWidth) return;
    for (const [material, name] of this.painted) material.color.set(css(name));
    this.width = onPaper() ? PAPER : this.host.clientWidth;
    this.height = onPaper() ? 420 : this.host.clientHeight;
    this.aspect = this.width / this.height;
    this.gl.setPixelRatio(onPaper() ? 2 : Math.min(devicePixelRatio || 1, 2));
    this.gl.setSize(this.width, this.height, false);
    [this.camera.left, this.camera.right] = [-this.aspect, this.aspect];
    this.camera.updateProjectionMatrix();
    if (this.framed) this.frame(...this.framed);
    if (onPaper()) this.draw(); else this.later();
  }

  later() {
    if (!this.works || this.pending) return;
    this.pending = requestAnimationFrame(() => { this.pending = 0; this.draw(); });
  }

  draw() {
    if (!this.width) return;
    const { gl, camera, scene } = this;
    gl.setClearColor(css("--paper"));
    gl.clear();
    this.sun.position.copy(camera.position).sub(this.controls.target).add(new THREE.Vector3(0.3, -0.4, 0.8));
    gl.render(scene, camera);
    if (this.small && !onPaper()) this.corner();
    for (const { element: tag, at, shown, text } of this.tags) {
      tag.hidden = !shown;
      if (!shown) continue;
      tag.textContent = text;
      const [x, y] = this.pixel(...at);
      if (!text) { tag.style.translate = `${x}px ${y}px`; continue; }
      tag.style.left = `${Math.max(4, Math.min(x + 12, this.width - tag.offsetWidth - 4))}px`;
      tag.style.top = `${Math.max(4, Math.min(y - 12 - tag.offsetHeight, this.height - tag.offsetHeight - 4))}px`;
    }
    [..."xyz"].forEach((_, k) => {
      const [line, name] = [this.axes.children[2 * k], this.axes.children[2 * k + 1]], tip = new THREE.Vector3().setComponent(k, 1).applyQuaternion(camera.quaternion.clone().invert());
      line.style.width = `${20 * Math.hypot(tip.x, tip.y)}px`;
      line.style.transform = `rotate(${Math.atan2(-tip.y, tip.x)}rad)`;
      name.style.transform = `translate(${28 * tip.x}px, ${-28 * tip.y}px)`;
    });
    this.frames += 1;
  }

  corner() {
    const { gl, small: { host, places, camera } } = this, box = host.getBoundingClientRect(), mine = this.canvas.getBoundingClientRect();
    if (!box.width) return;
    camera.quaternion.copy(this.camera.quaternion);
    const [low, high] = extent(places(), camera), wide = box.width / box.height;
    const half = Math.max((high.x - low.x) / wide, high.y - low.y) / 2 / CORNER_MARGIN;
    const [x, y] = [(low.x + high.x) / 2, (low.y + high.y) / 2];
    Object.assign(camera, { left: x - half * wide, right: x + half * wide, top: y + half, bottom: y - half });
    camera.updateProjectionMatrix();
    const at = [box.left - mine.left, mine.bottom - box.bottom, box.width, box.height];
    gl.setScissorTest(true);
    gl.setScissor(...at); gl.setViewport(...at);
    gl.setClearColor(css("--panel"));
    gl.clear();
    gl.render(this.scene, camera);
    gl.setScissorTest(false);
    gl.setViewport(0, 0, this.width, this.height);
  }

  /** Pixel of a place. */
  pixel(x, y, z) {
    const at = new THREE.Vector3(x, y, z).project(this.camera);
    return [((at.x + 1) / 2) * this.width, ((1 - at.y) / 2) * this.height];
  }

  /** The row, of a list, of the place that is nearest to a pixel and not farther than so many; -1 without one. */
  nearest(places, rows, x, y, reach = 14) {
    const e = new THREE.Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse).elements;
    const [w, h] = [this.width / 2, this.height / 2];
    let best = -1, least = reach * reach;
    for (const i of rows) {
      const [a, b, c] = [places[3 * i], places[3 * i + 1], places[3 * i + 2]];
      const dx = w * (1 + e[0] * a + e[4] * b + e[8] * c + e[12]) - x, dy = h * (1 - e[1] * a - e[5] * b - e[9] * c - e[13]) - y;
      const square = dx * dx + dy * dy;
      if (square < least) { least = square; best = i; }
    }
    return best;
  }

  listen() {
    const { canvas } = this, at = (e) => { const box = canvas.getBoundingClientRect(); return [e.clientX - box.left, e.clientY - box.top]; };
    let pressed = null;
    canvas.addEventListener("pointerdown", (e) => { pressed = at(e); });
    canvas.addEventListener("pointerup", (e) => {
      const [x, y] = at(e);
      if (pressed && Math.hypot(x - pressed[0], y - pressed[1]) < 5) this.near?.(x, y)?.pick?.();
      pressed = null;
    });
    canvas.addEventListener("pointermove", (e) => { if (!pressed) this.hover(...at(e)); });
    canvas.addEventListener("pointerleave", () => { this.tip.hidden = true; });
    canvas.addEventListener("keydown", (e) => {
      const turn = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[e.key];
      const zoom = { "+": 1.2, "=": 1.2, "-": 1 / 1.2 }[e.key];
      if (!turn && !zoom) return;
      e.preventDefault();
      if (zoom) this.camera.zoom *= zoom;
      else {
        const { target } = this.controls, eye = this.camera.position.clone().sub(target), r = eye.length();
        const yaw = Math.atan2(eye.y, eye.x) - turn[0], rise = Math.min(Math.max(Math.asin(eye.z / r) - turn[1], -1.55), 1.55);
        this.camera.position.set(Math.cos(rise) * Math.cos(yaw), Math.cos(rise) * Math.sin(yaw), Math.sin(rise)).multiplyScalar(r).add(target);
      }
      this.camera.updateProjectionMatrix();
      this.controls.update();
      this.remember();
      this.later();
    });
  }

  hover(x, y) {
    const found = this.near?.(x, y);
    this.tip.hidden = !found;
    this.canvas.style.cursor = found?.pick ? "pointer" : "grab";
    if (!found) return;
    this.tip.textContent = found.text;
    const right = x > this.width / 2;
    Object.assign(this.tip.style, { top: `${y + 14}px`, left: right ? "auto" : `${x + 10}px`, right: right ? `${this.width - x + 10}px` : "auto" });
  }

  /** Buttons for ways to look. @param views more of them: {name: () => [places, direction]} */
  buttons(views) {
    const made = Object.entries(WAYS).map(([name, way]) => button(`from ${name === "above" ? name : `the ${name}`}`, () => this.look(way)));
    const more = Object.entries(views).map(([name, view]) => button(name, () => { this.frame(...view()); this.remember(); }));
    return element("span", { class: "buttons", role: "group", "aria-label": "view" }, ...more, ...made);
  }
}

/** Whether WebGL is drawn without a graphics card, which is slow with smooth edges. */
function drawnByProcessor() {
  const gl = document.createElement("canvas").getContext("webgl2"), known = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = known ? gl.getParameter(known.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

/** Least and largest coordinates of places on the axes of a camera. */
function extent(places, camera) {
  const back = camera.quaternion.clone().invert(), low = new THREE.Vector3(Infinity, Infinity, Infinity), high = low.clone().negate(), at = new THREE.Vector3();
  for (let i = 0; i + 2 < places.length; i += 3) {
    at.fromArray(places, i).applyQuaternion(back);
    low.min(at);
    high.max(at);
  }
  return [low, high];
}

/** A grid of the floor, half a metre wide. */
function floor(space) {
  const lines = [], reach = 3;
  for (let k = -reach; k <= reach; k += 0.5) lines.push(k, -reach, 0, k, reach, 0, -reach, k, 0, reach, k, 0);
  const made = space.lines(Float32Array.from(lines), { color: "--grid" });
  made.material.depthTest = true;
  made.renderOrder = -1;
  return made;
}
