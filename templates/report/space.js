"use strict";
// A view in space, drawn by three.js where something changed: turned by mouse, touch and keys, framed so that nothing is cut off.

const MARGIN = 0.86; // share of the view that what is framed fills
const CORNER_MARGIN = 0.74; // the same of a corner, where links are as thick as a part of it
const WAYS = { "from above": [0, -1e-3, 1], "from the front": [1, 0, 0], "from the side": [0, -1, 0] }; // towards the eye
const SUN = new THREE.Vector3(0.3, -0.4, 0.8); // beside the eye
const [LOW, HIGH, AT] = [0, 1, 2].map(() => new THREE.Vector3()), BACK = new THREE.Quaternion(); // no frame makes new ones

class Space {
  /**
   * @param host element that the view fills
   * @param options {label, near(x, y): {text, pick?}|null}: what it shows, and what is near a pixel
   */
  constructor(host, { label, near }) {
    Object.assign(this, { host, near, scene: new THREE.Scene(), painted: [], tags: [] });
    const canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": `${label} Arrow keys turn the view, plus and minus zoom.` });
    // Without a graphics card smooth edges are slow.
    const context = canvas.getContext("webgl2", { antialias: true, failIfMajorPerformanceCaveat: true }) || canvas.getContext("webgl2", { antialias: false });
    if (!context) {
      host.replaceChildren(element("p", { class: "note" }, "This browser draws nothing in space (it has no WebGL): the charts and tables show the same figures."));
      host.classList.add("blank");
      return;
    }
    this.canvas = canvas;
    this.tip = element("div", { class: "tip", role: "tooltip", hidden: "" });
    this.axes = [..."xyz"].map((name) => [element("i"), element("span", {}, name)]);
    host.append(canvas, element("div", { class: "axes", "aria-hidden": "true" }, ...this.axes.flat()), this.tip);
    this.gl = new THREE.WebGLRenderer({ canvas, context });
    this.gl.autoClear = false;
    this.camera = orthographic();
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("change", () => this.later());
    this.controls.addEventListener("end", () => this.remember());
    this.sun = new THREE.DirectionalLight(0xffffff, 1.6);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8a929a, 2.2), this.sun);
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
   * @param options {color: name in the style sheet, width: pixels, opacity}
   */
  lines(places, { color, width = 1, opacity = 1 }) {
    const look = { transparent: opacity < 1, opacity, depthTest: false };
    const made = width > 1
      ? new THREE.LineSegments2(new THREE.LineSegmentsGeometry().setPositions(places), this.paint(new THREE.LineMaterial({ linewidth: width, ...look }), color))
      : new THREE.LineSegments(new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(places, 3)), this.paint(new THREE.LineBasicMaterial(look), color));
    made.frustumCulled = false;
    this.scene.add(made);
    return made;
  }

  /** A text beside a place, or a dot in it. @return show(at: [x, y, z], text), hidden where at is null */
  tag(kind = "") {
    const tag = element("div", { class: `tag ${kind}`, hidden: "" }), made = { tag, at: new THREE.Vector3() };
    this.host.append(tag);
    this.tags.push(made);
    return (at, text = "") => {
      tag.hidden = !at;
      tag.textContent = text;
      if (at) made.at.fromArray(at);
      made.size = text ? [tag.offsetWidth, tag.offsetHeight] : null;
      this.later();
    };
  }

  /** Show places x, y, z, x, y, z, .. whole, from a direction towards the eye; from where it is without one. */
  frame(places, direction = null) {
    [this.framed, this.places] = [[places, direction], places];
    if (!this.works || !this.width) return;
    const { camera, controls } = this;
    const eye = direction ? new THREE.Vector3(...direction).normalize() : camera.position.clone().sub(controls.target).normalize();
    [camera.position.copy(eye), controls.target.set(0, 0, 0), camera.zoom = 1];
    camera.lookAt(0, 0, 0);
    extent(places, camera);
    const middle = LOW.clone().add(HIGH).multiplyScalar(0.5);
    // Beside a corner with another camera there is room on its left, or below it.
    const corner = this.small && !this.small.host.hidden ? this.small.host : null, part = (used, of) => (corner ? 1 - (used + 8) / of : 1);
    const rooms = [[part(corner?.offsetWidth, this.width), 1], [1, part(corner?.offsetHeight, this.height)]].map(([wide, tall]) =>
      ({ wide, tall, zoom: MARGIN / Math.max((HIGH.x - LOW.x) / 2 / this.aspect / wide, (HIGH.y - LOW.y) / 2 / tall, 1e-3) }));
    const { wide, tall, zoom } = rooms[0].zoom > rooms[1].zoom ? rooms[0] : rooms[1];
    middle.add(AT.set((1 - wide) * this.aspect, 1 - tall, 0).divideScalar(zoom)).applyQuaternion(camera.quaternion);
    controls.target.copy(middle);
    camera.position.copy(middle).add(eye);
    camera.zoom = zoom;
    camera.updateProjectionMatrix();
    controls.update();
    this.later();
  }

  /** Let another camera show one more layer where an element of the host stands, unless that is hidden; its places are whole in it. */
  inset(host, layer) {
    this.small = { host, camera: orthographic(), places: [] };
    this.small.camera.layers.enable(layer);
  }

  /** The view as text for the address: middle, eye, zoom. */
  remember() {
    const { target } = this.controls, view = [...target.toArray(), ...this.camera.position.clone().sub(target).toArray(), this.camera.zoom];
    address.set("view", view.map((x) => Number(x.toPrecision(7))).join(","));
    this.framed = null;
  }

  /** Take the view that the address says, if it says one. */
  recall() {
    const view = (address.values.get("view") || "").split(",").map(Number);
    if (!this.works || view.length !== 7 || view.some(Number.isNaN)) return;
    this.controls.target.fromArray(view);
    this.camera.position.fromArray(view, 3).add(this.controls.target);
    this.camera.zoom = view[6];
    this.framed = null;
    this.resize();
    this.controls.update();
  }

  resize() {
    if (!this.works || !this.host.clientWidth) return;
    for (const [material, name] of this.painted) material.color.set(css(name));
    this.colors = ["--paper", "--panel"].map((name) => new THREE.Color(css(name)));
    [this.width, this.height] = onPaper() ? [PAPER, 420] : [this.host.clientWidth, this.host.clientHeight];
    this.aspect = this.width / this.height;
    this.gl.setPixelRatio(onPaper() ? 2 : Math.min(devicePixelRatio || 1, 2));
    this.gl.setSize(this.width, this.height, false);
    [this.camera.left, this.camera.right] = [-this.aspect, this.aspect];
    this.camera.updateProjectionMatrix();
    if (this.framed) this.frame(...this.framed);
    if (onPaper()) this.draw(); else this.later();
  }

  later() {
    if (this.works) this.pending ||= requestAnimationFrame(() => { this.pending = 0; this.draw(); });
  }

  draw() {
    if (!this.width) return;
    const { gl, camera, width, height } = this;
    gl.setClearColor(this.colors[0]);
    gl.clear();
    this.sun.position.copy(camera.position).sub(this.controls.target).add(SUN);
    gl.render(this.scene, camera);
    if (this.small && !onPaper()) this.corner();
    for (const { tag, at, size } of this.tags) {
      if (tag.hidden) continue;
      AT.copy(at).project(camera);
      let [x, y] = [((AT.x + 1) / 2) * width, ((1 - AT.y) / 2) * height];
      if (size) [x, y] = [Math.max(4, Math.min(x + 12, width - size[0] - 4)), Math.max(4, Math.min(y - 12 - size[1], height - size[1] - 4))];
      tag.style.translate = `${x}px ${y}px`;
    }
    BACK.copy(camera.quaternion).invert();
    this.axes.forEach(([line, name], k) => {
      const { x, y } = AT.set(0, 0, 0).setComponent(k, 1).applyQuaternion(BACK);
      line.style.width = `${20 * Math.hypot(x, y)}px`;
      line.style.rotate = `${Math.atan2(-y, x)}rad`;
      name.style.translate = `${28 * x}px ${-28 * y}px`;
    });
  }

  corner() {
    const { gl, small: { host, places, camera } } = this, { offsetLeft: left, offsetTop: top, offsetWidth: width, offsetHeight: height } = host, wide = width / height;
    if (!width) return;
    camera.quaternion.copy(this.camera.quaternion);
    extent(places, camera);
    const half = Math.max((HIGH.x - LOW.x) / wide, HIGH.y - LOW.y) / 2 / CORNER_MARGIN, x = (LOW.x + HIGH.x) / 2, y = (LOW.y + HIGH.y) / 2;
    Object.assign(camera, { left: x - half * wide, right: x + half * wide, top: y + half, bottom: y - half });
    camera.updateProjectionMatrix();
    gl.setScissorTest(true);
    for (const put of ["setScissor", "setViewport"]) gl[put](left, this.height - top - height, width, height);
    gl.setClearColor(this.colors[1]);
    gl.clear();
    gl.render(this.scene, camera);
    gl.setScissorTest(false);
    gl.setViewport(0, 0, this.width, this.height);
  }

  /** The row, of a list, of the place that is nearest to a pixel and not farther than so many; -1 without one. */
  nearest(places, rows, x, y, reach = 14) {
    let best = -1, least = reach;
    for (const i of rows) {
      AT.fromArray(places, 3 * i).project(this.camera);
      const far = Math.hypot(((AT.x + 1) / 2) * this.width - x, ((1 - AT.y) / 2) * this.height - y);
      if (far < least) [best, least] = [i, far];
    }
    return best;
  }

  listen() {
    const { canvas, camera, controls } = this;
    let pressed = null;
    canvas.addEventListener("pointerdown", (e) => { pressed = e; });
    canvas.addEventListener("pointerup", (e) => {
      if (pressed && Math.hypot(e.clientX - pressed.clientX, e.clientY - pressed.clientY) < 5) this.near(e.offsetX, e.offsetY)?.pick?.();
      pressed = null;
    });
    canvas.addEventListener("pointermove", (e) => { if (!pressed) this.hover(e.offsetX, e.offsetY); });
    canvas.addEventListener("pointerleave", () => { this.tip.hidden = true; });
    // Arrow keys turn, as they do with Shift in OrbitControls.
    controls.listenToKeyEvents({ addEventListener: (_, turn) => canvas.addEventListener("keydown", (e) => {
      controls.keyRotateSpeed = this.height / 60;
      turn({ code: e.code, shiftKey: true, preventDefault: () => e.preventDefault() });
      camera.zoom *= { "+": 1.2, "=": 1.2, "-": 1 / 1.2 }[e.key] || 1;
      camera.updateProjectionMatrix();
      if (/^Arrow|[-+=]/.test(e.key)) this.remember();
      this.later();
    }) });
  }

  hover(x, y) {
    const found = this.near(x, y), right = x > this.width / 2;
    this.tip.hidden = !found;
    this.canvas.style.cursor = found?.pick ? "pointer" : "grab";
    if (!found) return;
    this.tip.textContent = found.text;
    Object.assign(this.tip.style, { top: `${y + 14}px`, left: right ? "auto" : `${x + 10}px`, right: right ? `${this.width - x + 10}px` : "auto" });
  }

  /** Buttons for ways to look. @param views more of them: {name: () => show it} */
  buttons(views) {
    const ways = Object.entries(WAYS).map(([name, way]) => [name, () => this.frame(this.places, way)]);
    return element("span", { class: "buttons", role: "group", "aria-label": "view" },
      ...[...Object.entries(views), ...ways].map(([name, show]) => button(name, () => { show(); this.remember(); })));
  }
}

const orthographic = () => {
  const made = new THREE.OrthographicCamera(-1, 1, 1, -1, -100, 100);
  made.up.set(0, 0, 1);
  return made;
};

/** Put least and largest coordinates of places, on the axes of a camera, into LOW and HIGH. */
function extent(places, camera) {
  BACK.copy(camera.quaternion).invert();
  LOW.setScalar(Infinity);
  HIGH.setScalar(-Infinity);
  for (let i = 0; i + 2 < places.length; i += 3) {
    AT.fromArray(places, i).applyQuaternion(BACK);
    LOW.min(AT);
    HIGH.max(AT);
  }
}

/** Let wide lines lead between other places, in the same memory where they are as many. */
function moveLines(lines, ends) {
  const known = lines.geometry.attributes.instanceStart.data;
  lines.visible = ends.length > 0;
  if (known.array.length === ends.length) {
    known.array.set(ends);
    known.needsUpdate = true;
  } else if (ends.length) {
    lines.geometry.dispose();
    lines.geometry = new THREE.LineSegmentsGeometry().setPositions(ends);
  }
}

/** Diagonal of the box around places. */
function diagonal(places) {
  const box = new THREE.Box3().setFromArray(places);
  return box.max.distanceTo(box.min) || 1;
}

/** A grid of the floor, half a metre wide. */
function floor(space) {
  const lines = [], reach = 3;
  for (let k = -reach; k <= reach; k += 0.5) lines.push(k, -reach, 0, k, reach, 0, -reach, k, 0, reach, k, 0);
  const made = space.lines(Float32Array.from(lines), { color: "--grid" });
  made.material.depthTest = true;
  made.renderOrder = -1;
}
