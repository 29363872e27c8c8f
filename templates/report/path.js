"use strict";
// The page of a corrected program: its path in space, along the time, in its text and in its tables, all linked.

const JOINTS = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#d55e00", "#56b4e9"];

class Path {
  constructor(packed, found) {
    const { places, moves, largest: most } = packed;
    for (const [name, column] of Object.entries(places)) this[name] = numbers(column);
    this.moves = Object.fromEntries(Object.entries(moves).map(([name, column]) => [name, numbers(column)]));
    this.most = { before: numbers(most.before), after: numbers(most.after) };
    Object.assign(this, { targets: packed.targets, sources: packed.sources, arm: packed.arm && new Arm(packed.arm), base: packed.base && numbers(packed.base), statements: found.statements });
    this.n = this.move.length;
    this.size = { before: lengths(this.before), after: lengths(this.after) };
    this.goals = [];
    for (let i = 0; i < this.n; i++) if (i === this.n - 1 || this.move[i + 1] !== this.move[i]) this.goals.push(i);
    this.chosen = new Choice(-1);
    this.scale = Math.max(largest(this.size.before.filter((_, i) => this.space(i))), largest(this.size.before) / 4, 1e-4);
    this.tolerance = found.tolerance_mm;
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

  /** The place of a statement that is farthest off. */
  worst(k) {
    let best = -1, least = -1;
    for (let i = 0; i < this.n; i++)
      if (this.statement(i) === k && this.size.before[i] > least) { best = i; least = this.size.before[i]; }
    return best;
  }

  /** First and last place of the welds between two lines of a file. */
  between({ path, line_from: low, line_to: high }) {
    const rows = [];
    for (let i = 0; i < this.n; i++) {
      const row = this.statements[this.statement(i)];
      if (row && row.path === path && row.line >= low && row.line <= high && this.welding(i)) rows.push(i);
    }
    let last = 0; // of the first run
    while (last + 1 < rows.length && rows[last + 1] === rows[last] + 1) last++;
    return rows.length ? [rows[0], rows[last]] : null;
  }

  /** Places of the arm in the frame of the work, which a track or a positioner may move. */
  joints(i) {
    const places = this.arm.joints(this.q, i, this.move[i]), T = this.base && this.base.subarray(12 * i, 12 * i + 12);
    return T ? places.map(([x, y, z]) => [0, 4, 8].map((k) => T[k] * x + T[k + 1] * y + T[k + 2] * z + T[k + 3])) : places;
  }

  boxOf([from, to]) { return boxOf(this.p.subarray(3 * from, 3 * to + 3)); }
}

/** Whether two pixels are so near that a line between them would not be seen. */
const near = (a, b) => Math.abs(a[0] - b[0]) + Math.abs(a[1] - b[1]) < 1;

class PathScene {
  constructor(path) {
    this.path = path;
    this.box = boxOf(path.p);
    this.shown = "both";
    this.label = "The path of the torch in space, with its deviation drawn larger than it is.";
    this.tip = new Float32Array(path.p.length);
    const reach = Math.hypot(...this.box[0].map((x, i) => this.box[1][i] - x)) || 1;
    this.usual = (0.06 * reach * 1000) / path.scale;
    this.times = Number(this.usual.toPrecision(1));
  }

  draw(space, pen) {
    space.floor(pen);
    const { path } = this, stride = space.busy ? Math.ceil(path.n / 2500) : Math.ceil(path.n / 60000);
    if (path.arm && path.chosen.value >= 0) path.arm.draw(space, pen, path.joints(path.chosen.value));
    this.nominal(space, pen, stride);
    if (this.shown !== "after") this.deviation(space, pen, "before", stride);
    if (this.shown !== "before") this.deviation(space, pen, "after", stride);
    this.marks(space, pen);
  }

  /** The programmed path: welds thick, air thin and dashed. */
  nominal(space, pen, stride) {
    const { path } = this, at = space.projection();
    for (const weld of [false, true]) {
      pen.strokeStyle = css(weld ? "--ink" : "--faint");
      pen.lineWidth = weld ? 2 : 1;
      pen.setLineDash(weld || space.busy || path.n > 20000 ? [] : [3, 3]);
      pen.beginPath();
      let last = null, drawn = null;
      for (let i = 0; i < path.n; i += stride) {
        const place = at(path.p[3 * i], path.p[3 * i + 1], path.p[3 * i + 2]);
        if (last && path.welding(i) === weld && path.joined(i)) {
          if (drawn !== last) pen.moveTo(...last);
          else if (near(last, place)) continue;
          pen.lineTo(...place);
          drawn = place;
        }
        last = place;
      }
      pen.stroke();
    }
    pen.setLineDash([]);
  }

  /** Where the torch really goes, its distance from the programmed path so many times as large, coloured by size. */
  deviation(space, pen, name, stride) {
    const { path } = this, at = space.projection(), away = path[name], size = path.size[name];
    const k = this.times / 1000, lines = Array.from({ length: 2 * SHADES }, () => []);
    const whisker = Math.max(stride, Math.ceil(path.n / 1500));
    let last = null;
    for (let i = 0; i < path.n; i += stride) {
      const [x, y, z] = [path.p[3 * i], path.p[3 * i + 1], path.p[3 * i + 2]];
      const tip = at(x + k * away[3 * i], y + k * away[3 * i + 1], z + k * away[3 * i + 2]);
      const bin = Math.min(SHADES - 1, Math.floor(SHADES * Math.min(size[i] / path.scale, 1)) || 0);
      if (!space.busy && i % whisker < stride && name === "before") lines[SHADES + bin].push(at(x, y, z), tip);
      const joined = last && path.joined(i);
      if (joined && near(last, tip)) continue;
      if (joined) lines[bin].push(last, tip);
      last = tip;
    }
    lines.forEach((ends, b) => {
      if (!ends.length) return;
      pen.strokeStyle = shade((b % SHADES) / (SHADES - 1));
      pen.lineWidth = b >= SHADES ? 0.8 : name === "before" ? 2 : 2.5;
      pen.globalAlpha = b < SHADES ? 1 : 0.55;
      pen.beginPath();
      for (let j = 0; j < ends.length; j += 2) {
        if (ends[j] !== ends[j - 1]) pen.moveTo(...ends[j]);
        pen.lineTo(...ends[j + 1]);
      }
      pen.stroke();
    });
    pen.globalAlpha = 1;
  }

  marks(space, pen) {
    const { path } = this, at = space.projection();
    const seen = path.goals.map((i) => at(path.p[3 * i], path.p[3 * i + 1], path.p[3 * i + 2]))
      .filter(([x, y]) => x > 0 && y > 0 && x < space.width && y < space.height);
    if (seen.length < 2000) {
      const r = seen.length > 300 ? 1.2 : 2.4;
      pen.fillStyle = css("--ink");
      for (const [x, y] of seen) pen.fillRect(x - r, y - r, 2 * r, 2 * r);
    }
    const i = path.chosen.value;
    if (i < 0) return;
    const [x, y] = at(path.p[3 * i], path.p[3 * i + 1], path.p[3 * i + 2]);
    pen.strokeStyle = css("--accent"); pen.lineWidth = 2.5;
    pen.beginPath(); pen.arc(x, y, 8, 0, 7); pen.stroke();
    pen.font = "600 13px system-ui, sans-serif"; pen.textBaseline = "bottom";
    const name = path.targets[path.statement(i)] || "", wide = pen.measureText(name).width;
    const left = Math.max(4, Math.min(x + 12, space.width - wide - 4)); // the whole name is in the picture
    pen.textAlign = "left";
    pen.lineWidth = 4; pen.strokeStyle = css("--paper");
    pen.strokeText(name, left, y - 8);
    pen.fillStyle = css("--accent");
    pen.fillText(name, left, y - 8);
  }

  near(space, x, y) {
    const { path } = this;
    let i = nearest(space, path.p, path.goals, x, y);
    if (i < 0) {
      const stride = Math.ceil(path.n / 4000), rows = [];
      for (let k = 0; k < path.n; k += stride) rows.push(k);
      i = nearest(space, path.p, rows, x, y);
    }
    if (i < 0) return null;
    return { text: `${path.label(i)}\n${mm(path.size.before[i])} before, ${mm(path.size.after[i])} after`, pick: () => path.chosen.set(i, "space") };
  }

  armBox() {
    const joints = this.path.joints(Math.max(this.path.chosen.value, 0));
    return boxOf([...joints.flat(), ...this.box[0], ...this.box[1]]);
  }
}

/** Lines of the program, of which only those that are seen are in the document; a bar tells how far off each is. */
class Listing {
  constructor(host, path) {
    Object.assign(this, { host, path });
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
      row.append(element("i", { style: Number.isFinite(size) ? `background: ${shade(size / this.path.scale)}` : null }),
        element("span", {}, String(k + 1)), lines[k]);
      if (known) row.addEventListener("click", () => { const i = this.path.worst(s); if (i >= 0) this.path.chosen.set(i, "text"); else announce("this statement moves nowhere that is known"); });
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
  const rows = path.statements.map((row, k) => ({ ...row, k, target: path.targets[k], before: path.most.before[k], after: path.most.after[k] }));
  const figure = (x) => (Number.isFinite(x) ? x.toFixed(3) : "");
  const column = (title, key, number = false) => ({ title, number, value: (row) => row[key], shown: number && key !== "line" ? (row) => figure(row[key]) : null });
  const files = new Set(rows.map((row) => row.path)).size > 1 ? [column("file", "path")] : [];
  return new Table(host, [...files, column("line", "line", true), column("routine", "routine"), column("instruction", "instruction"),
    column("target", "target"), column("result", "status"), column("before [mm]", "before", true), column("after [mm]", "after", true),
    column("moved by [mm]", "shift_mm", true), column("left uncorrected, because", "reason")], rows, {
    label: "motion statements",
    pick: (row) => { const i = path.worst(row.k); if (i >= 0) path.chosen.set(i, "table"); else announce("where this statement leads is not known"); },
  });
}

function seamTable(host, path, seams) {
  const figure = (x) => (x === null ? "" : x.toFixed(3)), within = path.tolerance;
  new Table(host, [
    { title: "seam", value: (s) => s.name }, { title: "lines", value: (s) => s.line_from, shown: (s) => `${s.line_from} to ${s.line_to}`, number: true },
    { title: "length [mm]", value: (s) => s.length_mm, shown: (s) => s.length_mm.toFixed(0), number: true },
    { title: "before [mm]", value: (s) => s.before_mm, shown: (s) => figure(s.before_mm), number: true },
    { title: "after [mm]", value: (s) => s.after_mm, shown: (s) => figure(s.after_mm), number: true },
    { title: "tolerance", value: (s) => (s.after_mm === null ? "not measured" : s.after_mm <= within ? "kept" : "exceeded"),
      mark: (s, text) => element("span", { class: text === "kept" ? "good" : "bad" }, text) },
    { title: "targets added", value: (s) => s.added_targets, number: true }, { title: "statements left", value: (s) => s.left, number: true },
  ], seams, { label: "seams", pick: (s) => path.seam.set(s) });
}

function showPath() {
  const found = data("document"), packed = data("path");
  if (!packed) return;
  const path = new Path(packed, found), place = (name) => document.querySelector(`[data-path="${name}"]`);
  path.seam = new Choice(null);
  const scene = new PathScene(path), space = new Space(place("space"), scene), listing = new Listing(place("text"), path);
  const table = statementTable(place("statements"), path);
  if (place("seams")) seamTable(place("seams"), path, found.welds);
  const across = (name) => path.size[name].map((x, i) => (path.space(i) ? x : NaN));
  const limit = Float32Array.from({ length: path.n }, (_, i) => path.moves.tolerance[path.move[i]]);
  const six = (values) => JOINTS.map((color, k) => ({ name: `J${k + 1}`, color, values: component(values, 6, k) }));
  const [before, after] = [across("before"), across("after")];
  const shared = { axes: [{ name: "time", unit: "s", values: path.t }, { name: "length", unit: "m", values: path.s }],
    shaded: (i) => path.welding(i), joined: (i) => path.joined(i), label: (i) => path.label(i), pick: (i) => path.chosen.set(i, "chart") };
  const charts = [new Courses(place("deviation"), shared, [
    { title: "Deviation as programmed and as corrected", unit: "mm", height: 190, limit, series: [{ name: "before", values: before, color: "var(--before)" }, { name: "after", values: after, color: "var(--after)" }] },
    { title: found.welds.length ? "As corrected, against the tolerance of the welds" : "As corrected, against the tolerance", unit: "mm", height: 130, limit, told: false, weldsFill: true, series: [{ name: "after", values: after, color: "var(--after)" }] },
  ]), new Courses(place("joints"), shared, [
    { title: "Speed of the joints, share of the limit", unit: "%", height: 140, series: six(path.speed) },
    { title: "Torque of the motors", unit: "N m", height: 140, signed: true, series: six(path.torque) },
    { title: "Correction of the joints", unit: "deg", height: 140, signed: true, series: six(path.correction) },
  ])];
  place("legend").append(legend(path.scale, "mm", path.tolerance));
  controls(place("controls"), path, scene, space);
  path.chosen.listen((i, from) => {
    for (const chart of charts) chart.choose(i);
    space.later();
    listing.show(path.statement(i));
    if (from !== "table") table.show(path.statement(i));
    announce(`${path.label(i)}: ${mm(path.size.before[i])} before, ${mm(path.size.after[i])} after`);
  });
  path.seam.listen((seam) => {
    const rows = path.between(seam);
    if (!rows) return announce("nothing of this seam could be measured");
    for (const chart of charts) chart.show(...rows);
    space.frame(path.boxOf(rows));
    path.chosen.set(Math.round((rows[0] + rows[1]) / 2), "seam");
  });
  let first = 0;
  for (let i = 0; i < path.n; i++) if (path.space(i) && path.size.before[i] > path.size.before[first]) first = i;
  path.chosen.set(first, "start");
}

/** Slider of the magnification, what is shown, the place along the program, and ways to look. */
function controls(host, path, scene, space) {
  const out = element("output", {}), times = element("input", { type: "range", min: "0", max: "100", value: "50", "aria-label": "how many times as large the deviation is drawn" });
  const set = () => {
    scene.times = Number((scene.usual * 10 ** ((times.value - 50) / 25)).toPrecision(1));
    out.textContent = `${scene.times.toLocaleString("en")} times as large`;
    space.later();
  };
  times.addEventListener("input", set);
  set();
  const shown = element("span", { class: "buttons", role: "group", "aria-label": "what is drawn" }, ...["before", "after", "both"].map((name) =>
    element("button", { type: "button", "aria-pressed": name === "both", onclick: (e) => {
      scene.shown = name;
      for (const b of shown.children) b.setAttribute("aria-pressed", b === e.currentTarget);
      space.later();
    } }, name)));
  const at = element("input", { type: "range", min: "0", max: String(path.n - 1), "aria-label": "place along the program" });
  at.addEventListener("input", () => path.chosen.set(Number(at.value), "slider"));
  path.chosen.listen((i) => { at.value = i; });
  const run = element("button", { type: "button", "aria-pressed": "false" }, "run");
  run.addEventListener("click", () => play(path, run));
  host.append(
    element("label", {}, element("span", {}, "deviation"), times, out), shown,
    element("label", {}, element("span", {}, "place"), at, run),
    lookButtons(space, { "whole path": scene.box, ...(path.arm ? { "with the arm": () => scene.armBox() } : {}) }));
}

/** Run the program in at most half a minute, from the chosen place on. */
function play(path, button) {
  const on = button.getAttribute("aria-pressed") !== "true", t = path.t, whole = t[path.n - 1] - t[0];
  button.setAttribute("aria-pressed", on);
  button.textContent = on ? "stop" : "run";
  if (!on) return;
  const fast = Math.max(1, whole / 30), start = performance.now(), from = path.chosen.value >= path.n - 1 ? 0 : path.chosen.value;
  let i = from;
  const step = (now) => {
    if (button.getAttribute("aria-pressed") !== "true") return;
    const moment = t[from] + (fast * (now - start)) / 1000;
    while (i < path.n - 1 && t[i] < moment) i++;
    path.chosen.set(i, "run");
    if (i < path.n - 1) requestAnimationFrame(step);
    else { button.setAttribute("aria-pressed", "false"); button.textContent = "run"; }
  };
  requestAnimationFrame(step);
}

showPath();
