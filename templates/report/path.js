"use strict";
// The page of a corrected program: its path in space, along the time, in its text and in its tables, all linked.

const JOINTS = ["--j1", "--j2", "--j3", "--j4", "--j5", "--j6"];
const ARM = 1, LARGE = 2; // layers: what the corner shows, and what it is too small for
const LITTLE_MORE = 1.6; // times the size of a weld
const MOST_BOLD = 1000; // lines of welds that are drawn bold
const MOST_VECTORS = 400; // vectors of the deviation that are drawn of a program

class Path {
  constructor(packed, found) {
    const { places, moves, largest: most } = packed;
    for (const [name, column] of Object.entries(places)) this[name] = numbers(column);
    this.moves = Object.fromEntries(Object.entries(moves).map(([name, column]) => [name, numbers(column)]));
    this.most = { before: numbers(most.before), after: numbers(most.after) };
    Object.assign(this, { targets: packed.targets, sources: packed.sources, base: packed.base && numbers(packed.base), statements: found.statements });
    this.n = this.move.length;
    this.decimals = decimalsOf(found.tolerance_mm);
    this.rows = Array.from({ length: this.n }, (_, i) => i);
    this.size = { before: lengths(this.before), after: lengths(this.after) };
    this.goals = this.rows.filter((i) => i === this.n - 1 || this.move[i + 1] !== this.move[i]);
    this.chosen = new Choice(-1);
    this.seam = new Choice(null);
  }

  welding(i) { return this.moves.welding[this.move[i]] === 1; }
  space(i) { return this.moves.space[this.move[i]] === 1; }
  /** Whether the path leads from the place before to this one. */
  joined(i) { return i > 0 && !(this.moves.first[this.move[i]] && this.move[i] !== this.move[i - 1]); }
  statement(i) { return this.moves.statement[this.move[i]]; }

  label(i) {
    const k = this.statement(i), row = this.statements[k];
    if (!row) return "a file that is only read along";
    return `${row.instruction} ${this.targets[k]}, line ${row.line}${this.welding(i) ? ", weld" : ""}`;
  }

  mm(x) { return Number.isFinite(x) ? `${fixed(x, this.decimals)} mm` : "not known"; }
  deviation(i) { return `${this.mm(this.size.before[i])} before, ${this.mm(this.size.after[i])} in the model after`; }

  /** The place of those that is farthest off before correction, -1 without one. */
  worst(rows) { return rows.reduce((best, i) => (best < 0 || this.size.before[i] > this.size.before[best] ? i : best), -1); }
  ofStatement(k) { return this.rows.filter((i) => this.statement(i) === k); }

  /** Places of the welds between two lines of a file, in their first run. */
  between({ path, line_from: low, line_to: high }) {
    const rows = this.rows.filter((i) => {
      const row = this.statements[this.statement(i)];
      return row && row.path === path && row.line >= low && row.line <= high && this.welding(i);
    });
    return rows.filter((i, k) => i === rows[0] + k);
  }

  /** Places of the weld around one: those before and after it that are welded without a gap. */
  weldAt(i) {
    let [from, to] = [i, i];
    while (this.joined(from) && this.welding(from - 1)) from -= 1;
    while (to + 1 < this.n && this.joined(to + 1) && this.welding(to + 1)) to += 1;
    return this.rows.slice(from, to + 1);
  }

  /** Pairs of places of straight lines along those from the place before each to itself. */
  segments(rows) {
    const ends = [], way = (i, k) => [0, 1, 2].map((c) => this.p[3 * k + c] - this.p[3 * i + c]);
    let begin = -1;
    rows.forEach((i, k) => {
      if (begin < 0) begin = i - 1;
      const next = rows[k + 1] === i + 1 ? way(i, i + 1) : null, mine = way(begin, i);
      const straight = next && Math.hypot(...cross(mine, next)) <= 0.002 * Math.hypot(...mine) * Math.hypot(...next);
      if (straight && next.reduce((sum, x, c) => sum + x * mine[c], 0) >= 0) return;
      ends.push(...this.p.subarray(3 * begin, 3 * begin + 3), ...this.p.subarray(3 * i, 3 * i + 3));
      begin = -1;
    });
    return Float32Array.from(ends);
  }

  points(rows) { return rows.flatMap((i) => [this.p[3 * i], this.p[3 * i + 1], this.p[3 * i + 2]]); }
}

const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];

/** The path in space: its lines, its deviation drawn larger than it is, and the arm where a place is chosen. */
class PathScene {
  constructor(host, path, packed) {
    this.path = path;
    const space = this.space = new Space(host, { label: "The path of the torch in space, with its deviation drawn larger than it is.", near: (x, y) => this.near(x, y) });
    if (!space.works) return;
    space.camera.layers.enable(LARGE);
    const pairs = (is) => path.rows.filter((i) => path.joined(i) && is(i));
    const known = (i) => path.space(i) && path.joined(i);
    const air = path.segments(pairs((i) => !path.welding(i))), welds = path.segments(pairs((i) => path.welding(i)));
    const bold = space.lines(welds, { color: "--ink", width: welds.length < 6 * MOST_BOLD ? 3 : 1 }), small = space.lines(welds, { color: "--ink" });
    bold.layers.set(LARGE);
    small.layers.set(ARM);
    space.scene.add(floor(space), space.lines(air, { color: "--faint", opacity: 0.7 }), bold, small);
    this.ribbons = { before: this.ribbon("before", "--before", pairs(known)), after: this.ribbon("after", "--after", pairs(known)) };
    [this.dot, this.tag] = [space.tag("dot"), space.tag()];
    space.scene.add(...Object.values(this.ribbons).map(({ group }) => group));
    if (packed.arm) {
      this.arm = new Arm(space, packed.arm);
      this.arm.layer(ARM);
      space.scene.add(this.arm.group);
      this.corner = element("button", { type: "button", hidden: "", class: "inset", "aria-label": "show the whole arm", onclick: () => this.show("whole arm") });
      host.append(this.corner);
      space.inset(this.corner, ARM, () => [...this.arm.places(), ...this.around]);
    }
    const reach = diagonal(path.p) || 1;
    this.usual = Number(((0.05 * reach * 1000) / Math.max(largest(path.size.before.filter((_, i) => path.space(i))), 1e-4)).toPrecision(1));
    this.magnify(address.number("times") || this.usual);
  }

  /** Area between the path and where the torch really goes, with its edge and vectors at even distances. */
  ribbon(name, color, rows) {
    const { path, space } = this, geometry = () => new THREE.BufferGeometry().setAttribute("position", places);
    const places = new THREE.BufferAttribute(new Float32Array(6 * path.n), 3), of = { transparent: true, depthTest: false };
    const index = (size, quads) => new THREE.BufferAttribute(Uint32Array.from(quads.flat()), size);
    const area = new THREE.Mesh(geometry().setIndex(index(1, rows.map((i) => [2 * i - 2, 2 * i, 2 * i + 1, 2 * i - 2, 2 * i + 1, 2 * i - 1]))),
      space.paint(new THREE.MeshBasicMaterial({ ...of, opacity: name === "before" ? 0.16 : 0.35, side: THREE.DoubleSide }), color));
    const edge = new THREE.LineSegments(geometry().setIndex(index(1, rows.map((i) => [2 * i - 1, 2 * i + 1]))), space.paint(new THREE.LineBasicMaterial(of), color));
    const s = path.s, step = (s[path.n - 1] - s[0]) / MOST_VECTORS || 1;
    const even = rows.filter((i) => Math.floor(s[i] / step) !== Math.floor(s[i - 1] / step) || path.move[i] !== path.move[i - 1]);
    const vectors = new THREE.LineSegments(geometry().setIndex(index(1, even.map((i) => [2 * i, 2 * i + 1]))), space.paint(new THREE.LineBasicMaterial({ ...of, opacity: 0.8 }), color));
    const group = new THREE.Group();
    group.add(area, edge, vectors);
    for (const part of group.children) {
      part.frustumCulled = false;
      part.layers.set(LARGE);
    }
    return { group, places, away: path[name] };
  }

  magnify(times) {
    this.times = times;
    if (!this.space.works) return;
    const { p } = this.path;
    for (const { places, away } of Object.values(this.ribbons)) {
      for (let i = 0; i < p.length / 3; i++)
        for (let c = 0; c < 3; c++) {
          places.array[6 * i + c] = p[3 * i + c];
          places.array[6 * i + 3 + c] = p[3 * i + c] + (times / 1000) * (away[3 * i + c] || 0);
        }
      places.needsUpdate = true;
    }
    this.space.later();
  }

  only(name) {
    if (!this.space.works) return;
    for (const [one, { group }] of Object.entries(this.ribbons)) group.visible = name === "both" || name === one;
    this.space.later();
  }

  /** Show a place: the arm stands there, its deviation is written beside it. */
  choose(i) {
    const { space, path } = this;
    if (!space.works || i < 0) return;
    this.arm?.pose(path.q, i, path.move[i], path.base && path.base.subarray(12 * i, 12 * i + 12));
    const at = [...path.p.subarray(3 * i, 3 * i + 3)];
    Object.assign(this.dot, { at, shown: true });
    Object.assign(this.tag, { at, shown: true, text: `${path.targets[path.statement(i)] || ""} ${path.mm(path.size.before[i])}` });
    space.later();
  }

  /** Frame a weld with the torch, the path, or the arm; rows: of the weld. */
  show(what, rows = this.rows) {
    this.rows = rows;
    if (!this.space.works) return;
    const few = Math.ceil(rows.length / 1000);
    this.around = this.path.points(rows.filter((_, k) => k % few === 0 || k === rows.length - 1));
    this.plane?.removeFromParent();
    this.plane = workPlane(this.space, this.path, rows, this.arm);
    if (this.plane) this.space.scene.add(this.plane);
    const whole = what === "whole arm";
    this.space.camera?.layers[whole ? "enable" : "disable"](ARM);
    if (this.corner) this.corner.hidden = whole;
    this.space.frame(...this.view(what));
  }

  view(what) {
    const { path } = this;
    const tips = (rows) => rows.flatMap((i) => [0, 1, 2].map((c) => this.ribbons.before.places.array[6 * i + 3 + c])).map((x) => x || 0);
    const torch = this.arm ? this.arm.places().slice(-6) : [], all = [...path.p, ...tips(path.rows), ...torch];
    // A path that is hardly longer than its weld is shown whole.
    const places = { weld: () => (diagonal(path.p) < LITTLE_MORE * diagonal([...this.around, ...torch]) ? all : [...this.around, ...tips(this.rows), ...torch]),
      "whole path": () => all, "whole arm": () => [...this.arm.places(), ...this.around] }[what]();
    return [places, this.direction()];
  }

  /** Direction towards the eye from which the arm hides least of the weld, and most of its length and deviation is seen. */
  direction() {
    const { path, rows, arm } = this, sample = rows.filter((_, k) => k % Math.ceil(rows.length / 12) === 0);
    const vector = (values, i) => new THREE.Vector3().fromArray(values, 3 * i);
    const along = vector(path.p, rows[rows.length - 1]).sub(vector(path.p, rows[0])).normalize();
    const away = vector(path.before, path.worst(rows)).normalize();
    const bones = arm ? arm.places() : [], bone = (j) => new THREE.Line3(vector(bones, j), vector(bones, j + 1));
    const links = Array.from({ length: Math.max(bones.length / 3 - 1, 0) }, (_, j) => bone(j)), radius = 0.1;
    const behind = (at, eye) => links.some((link) => { // the arm stands between a place and the eye
      const near = new THREE.Vector3();
      return [0.15, 0.3, 0.5, 0.75, 1, 1.4].some((far) => { const on = at.clone().addScaledVector(eye, far); return link.closestPointToPoint(on, true, near).distanceTo(on) < radius; });
    });
    let best = null, most = -Infinity;
    for (const rise of [0.35, 0.6])
      for (let k = 0; k < 16; k++) {
        const yaw = (k * Math.PI) / 8, eye = new THREE.Vector3(Math.cos(rise) * Math.cos(yaw), Math.cos(rise) * Math.sin(yaw), Math.sin(rise));
        const hidden = sample.filter((i) => behind(vector(path.p, i), eye)).length / sample.length;
        const score = -8 * hidden + 1.5 * Math.sqrt(1 - along.dot(eye) ** 2) + Math.sqrt(1 - away.dot(eye) ** 2) + (arm ? 0.5 * eye.x : 0);
        if (score > most) [best, most] = [eye.toArray(), score];
      }
    return best;
  }

  near(x, y) {
    const { path, space } = this, few = Math.ceil(path.n / 4000);
    let i = space.nearest(path.p, path.goals, x, y);
    if (i < 0) i = space.nearest(path.p, path.rows.filter((k) => k % few === 0), x, y);
    return i < 0 ? null : { text: `${path.label(i)}\n${path.deviation(i)}`, pick: () => path.chosen.set(i, "space") };
  }
}

/** Diagonal of the box around places. */
function diagonal(places) {
  const box = new THREE.Box3().setFromArray(places);
  return box.max.distanceTo(box.min);
}

/** The plane of a weld: through its places, at right angles to the torch as far as the weld leaves that open. */
function workPlane(space, path, rows, arm) {
  if (!arm || rows.length < 2) return null;
  const at = (i) => new THREE.Vector3().fromArray(path.p, 3 * i), first = at(rows[0]);
  const far = rows.map(at).reduce((a, b) => (b.distanceTo(first) > a.distanceTo(first) ? b : a));
  const along = far.clone().sub(first).normalize(), torch = arm.aim().negate();
  let normal = torch.addScaledVector(along, -torch.dot(along));
  const side = rows.map(at).map((p) => p.sub(first)).map((d) => d.addScaledVector(along, -d.dot(along))).reduce((a, b) => (b.length() > a.length() ? b : a));
  if (side.length() > 0.02 * far.distanceTo(first)) normal = new THREE.Vector3().crossVectors(along, side).multiplyScalar(Math.sign(new THREE.Vector3().crossVectors(along, side).dot(normal)) || 1);
  normal.normalize();
  const across = new THREE.Vector3().crossVectors(normal, along);
  const sides = [along, across].map((way) => rows.map((i) => at(i).sub(first).dot(way))).map((x) => [Math.min(...x), Math.max(...x)]);
  const spare = 0.12 * Math.max(...sides.map(([a, b]) => b - a));
  const [[a, b], [c, d]] = sides.map(([low, high]) => [low - spare, high + spare]);
  const made = new THREE.Mesh(new THREE.PlaneGeometry(b - a, d - c), space.paint(new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.55, side: THREE.DoubleSide, depthWrite: false }), "--plane"));
  made.matrixAutoUpdate = false;
  made.matrix.makeBasis(along, across, normal).setPosition(first.addScaledVector(along, (a + b) / 2).addScaledVector(across, (c + d) / 2).addScaledVector(normal, -0.001));
  made.renderOrder = -1;
  return made;
}

/** Lines of the program, of which only those that are seen are in the document; a bar tells how far off each was. */
class Listing {
  constructor(host, path) {
    Object.assign(this, { host, path, most: largest(path.most.before) || 1 });
    this.file = Object.keys(path.sources)[0];
    this.at = new Map(path.statements.map((row, k) => [`${row.path}:${row.line}`, k]));
    this.box = element("div", { class: "listing", tabindex: "0", role: "region", "aria-label": "program text", onscroll: () => this.draw() });
    const files = Object.keys(path.sources);
    if (files.length > 1) host.append(element("select", { "aria-label": "file", onchange: (e) => { this.file = e.target.value; this.box.scrollTop = 0; this.draw(); } },
      ...files.map((name) => element("option", { value: name }, name))));
    host.append(this.box);
    new ResizeObserver(() => this.draw()).observe(this.box);
    this.draw();
  }

  draw() {
    const lines = this.path.sources[this.file], high = 20;
    const first = Math.max(0, Math.floor(this.box.scrollTop / high) - 10);
    const last = Math.min(lines.length, first + Math.ceil((this.box.clientHeight || 400) / high) + 20);
    const rows = [element("div", { style: `height: ${first * high}px` })];
    for (let k = first; k < last; k++) {
      const s = this.at.get(`${this.file}:${k + 1}`), known = s !== undefined;
      const row = element(known ? "button" : "div", { class: known && s === this.chosen ? "code here" : "code", type: known ? "button" : null, tabindex: known ? "-1" : null });
      const size = known ? this.path.most.before[s] : NaN;
      row.append(element("i", { style: Number.isFinite(size) ? `opacity: ${0.15 + (0.85 * size) / this.most}` : "opacity: 0" }),
        element("span", {}, String(k + 1)), lines[k]);
      if (known) row.addEventListener("click", () => { const i = this.path.worst(this.path.ofStatement(s)); if (i >= 0) this.path.chosen.set(i, "text"); else announce("this statement moves nowhere that is known"); });
      rows.push(row);
    }
    rows.push(element("div", { style: `height: ${(lines.length - last) * high}px` }));
    this.box.replaceChildren(...rows);
  }

  show(s) {
    const row = this.path.statements[s];
    this.chosen = s;
    if (row) {
      this.file = row.path;
      const top = (row.line - 1) * 20;
      if (top < this.box.scrollTop + 20 || top > this.box.scrollTop + this.box.clientHeight - 40) this.box.scrollTop = Math.max(0, top - this.box.clientHeight / 2);
    }
    this.draw();
  }
}

function statementTable(host, path) {
  const rows = path.statements.map((row, k) => ({ ...row, k, target: path.targets[k], before: path.most.before[k], after: path.most.after[k],
    result: [row.status, row.reason].filter(Boolean).join(": ") }));
  const figure = (x) => (Number.isFinite(x) ? fixed(x, path.decimals) : "");
  const column = (title, key, number = false) => ({ title, number, value: (row) => row[key], shown: number && key !== "line" ? (row) => figure(row[key]) : null });
  const several = (key) => new Set(rows.map((row) => row[key])).size > 1;
  return new Table(host, [...(several("path") ? [column("file", "path")] : []), column("line", "line", true), column("instruction", "instruction"), column("target", "target"),
    column("before [mm]", "before", true), column("after [mm]", "after", true), column("moved [mm]", "shift_mm", true), column("result", "result"),
    ...(several("routine") ? [column("routine", "routine")] : [])], rows, {
    label: "motion statements",
    pick: (row) => { const i = path.worst(path.ofStatement(row.k)); if (i >= 0) path.chosen.set(i, "table"); else announce("where this statement leads is not known"); },
  });
}

function seamTable(host, path, seams) {
  const length = (title, key, decimals = path.decimals) => ({ title, number: true, value: (s) => s[key], shown: (s) => (s[key] == null ? "" : fixed(s[key], decimals)) });
  const several = (title, key, least) => (seams.some((s) => s[key] > least) ? [{ title, number: true, value: (s) => s[key] }] : []);
  new Table(host, [
    { title: "seam", value: (s) => s.name }, { title: "lines", value: (s) => s.line_from, shown: (s) => `${s.line_from} to ${s.line_to}` },
    ...several("runs", "runs", 1), length("length", "length_mm", 0), length("before", "before_mm"), length("after", "after_mm"),
    length("sideways", "sideways_after_mm"), length("stick-out", "stick_out_after_mm"), length("along", "along_after_mm"),
    { title: "in the model", value: (s) => (s.after_mm === null ? "not known" : s.kept ? "kept" : "exceeded"), mark: (s, text) => element("span", { class: text === "exceeded" ? "bad" : "good" }, text) },
    ...several("targets added", "added_targets", 0), ...several("statements left", "left", 0),
  ], seams, { label: "seams", pick: (s) => path.seam.set(s) });
}

function showPath() {
  const found = data("document"), packed = data("path");
  if (!packed) return;
  document.documentElement.classList.toggle("measured", Boolean(found.expected_accuracy));
  document.documentElement.classList.toggle("kept", found.verdict === "kept"); // shown on the arm itself
  const path = new Path(packed, found), place = (name) => document.querySelector(`[data-path="${name}"]`);
  const scene = new PathScene(place("space"), path, packed), listing = place("text") && new Listing(place("text"), path);
  const table = statementTable(place("statements"), path);
  if (place("seams")) seamTable(place("seams"), path, found.welds);
  const across = (name) => path.size[name].map((x, i) => (path.space(i) ? x : NaN));
  const limit = { name: "tolerance", values: Float32Array.from(path.move, (m) => path.moves.tolerance[m]), color: "--faint", dash: [4, 3] };
  const six = (values) => JOINTS.map((color, k) => ({ name: `J${k + 1}`, color, values: component(values, 6, k) }));
  const after = { name: "in the model after", values: across("after"), color: "--after" }, welding = (i) => path.welding(i);
  const shared = { axes: [{ name: "time", unit: "s", values: path.t }, { name: "length", unit: "m", values: path.s }],
    shaded: welding, label: (i) => path.label(i), pick: (i) => path.chosen.set(i, "chart") };
  const courses = new Courses([place("deviation"), place("deviation"), place("joints")], shared, [
    { title: "Deviation before and in the model after", unit: "mm", height: 120, decimals: path.decimals, series: [{ name: "before", values: across("before"), color: "--before" }, after] },
    { title: "In the model after, against the tolerance", unit: "mm", height: 96, decimals: path.decimals, focus: welding, series: [after, limit] },
    { title: "Speed of the joints, share of the limit", unit: "%", height: 140, series: six(path.speed) },
    { title: "Torque of the motors", unit: "N m", height: 140, signed: true, series: six(path.torque) },
    { title: "Correction of the joints", unit: "deg", height: 140, signed: true, series: six(path.correction) },
  ]);
  place("deviation").prepend(courses.tools());
  controls(place("controls"), path, scene);
  const weld = (i) => (path.welding(i) ? path.weldAt(i) : path.rows);
  path.chosen.listen((i, from) => {
    courses.choose(i);
    scene.choose(i);
    listing?.show(path.statement(i));
    if (from !== "table") table.show(path.statement(i));
    announce(`${path.label(i)}: ${path.deviation(i)}`);
    if (from !== "start") address.set("place", i);
  });
  path.seam.listen((seam) => {
    const rows = path.between(seam);
    if (!rows.length) return announce("nothing of this seam could be measured");
    path.chosen.set(path.worst(rows), "seam");
    courses.show(rows[0], rows[rows.length - 1]);
    scene.show("weld", rows);
  });
  const welds = path.rows.filter((i) => path.welding(i) && path.space(i)), lines = path.rows.filter((i) => path.space(i));
  const asked = address.number("place"), first = path.worst(welds.length ? welds : lines.length ? lines : path.rows);
  path.chosen.set(asked >= 0 && asked < path.n && asked !== null ? Math.round(asked) : first, "start");
  scene.show("weld", weld(path.chosen.value));
  scene.space.recall();
}

/** Magnification, what is shown, the place along the program, and ways to look. */
function controls(host, path, scene) {
  const at = element("input", { type: "range", min: "0", max: String(path.n - 1), "aria-label": "place along the program" });
  at.addEventListener("input", () => path.chosen.set(Number(at.value), "slider"));
  path.chosen.listen((i) => { at.value = i; });
  const run = button("run", () => play(path, run), { "aria-pressed": "false" });
  const place = element("label", {}, element("span", {}, "place"), at, run), legend = document.querySelector('[data-path="legend"]');
  if (!scene.space.works) { host.append(place); legend.remove(); return; }
  const out = element("output", {}), times = element("input", { type: "range", min: "0", max: "100", "aria-label": "how many times as large the deviation is drawn" });
  times.value = 50 + 25 * Math.log10(scene.times / scene.usual);
  const tell = () => { out.textContent = `${thousands(scene.times)} times as large`; };
  times.addEventListener("input", () => {
    scene.magnify(Number((scene.usual * 10 ** ((times.value - 50) / 25)).toPrecision(1)));
    address.set("times", scene.times);
    tell();
  });
  tell();
  const looks = ["weld", "whole path", ...(scene.arm ? ["whole arm"] : [])].map((name) => button(name, () => { scene.show(name); scene.space.remember(); }));
  const views = scene.space.buttons({});
  views.prepend(...looks);
  host.append(views, switchOf("what is drawn", ["before", "after", "both"], "both", (name) => scene.only(name)), place);
  const key = (name, text) => element("span", {}, element("i", { class: name }), text);
  legend.append(element("label", {}, "Deviation drawn", times, out), key("before", "before"), key("after", "in the model after"), key("weld", "weld"), key("air", "in the air, or not known"));
}

/** Run the program in at most half a minute, from the chosen place on. */
function play(path, pressed) {
  const on = pressed.getAttribute("aria-pressed") !== "true", t = path.t, whole = t[path.n - 1] - t[0];
  const tell = (is) => { pressed.setAttribute("aria-pressed", is); pressed.textContent = is ? "stop" : "run"; };
  tell(on);
  if (!on) return;
  const fast = Math.max(1, whole / 30), start = performance.now(), from = path.chosen.value >= path.n - 1 ? 0 : path.chosen.value;
  let i = from;
  const step = (now) => {
    if (pressed.getAttribute("aria-pressed") !== "true") return;
    const moment = t[from] + (fast * (now - start)) / 1000;
    while (i < path.n - 1 && t[i] < moment) i++;
    path.chosen.set(i, "run");
    if (i < path.n - 1) requestAnimationFrame(step); else tell(false);
  };
  requestAnimationFrame(step);
}

showPath();
