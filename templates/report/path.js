"use strict";
// The page of a corrected program: its path in space, along the time, in its text and in its tables, all linked.

const JOINTS = ["--j1", "--j2", "--j3", "--j4", "--j5", "--j6"];

class Path {
  constructor(packed, found) {
    const { places, moves, largest: most } = packed, unpacked = (columns) => Object.fromEntries(Object.entries(columns).map(([name, column]) => [name, numbers(column)]));
    Object.assign(this, unpacked(places), { moves: unpacked(moves), most: unpacked(most), targets: packed.targets, sources: packed.sources, base: packed.base && numbers(packed.base), statements: found.statements });
    this.n = this.move.length;
    this.decimals = decimalsOf(found.tolerance_mm);
    this.rows = upTo(this.n);
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

  /** Choose the worst place of a statement. */
  chooseStatement(k, from) {
    const i = this.worst(this.rows.filter((each) => this.statement(each) === k));
    if (i < 0) announce("this statement moves nowhere that is known"); else this.chosen.set(i, from);
  }

  /** Places of the welds between two lines of a file, in their first run. */
  between({ path, line_from: low, line_to: high }) {
    const rows = this.rows.filter((i) => {
      const row = this.statements[this.statement(i)];
      return row?.path === path && row.line >= low && row.line <= high && this.welding(i);
    });
    return rows.filter((i, k) => i === rows[0] + k);
  }

  /** Places of the weld around one, those before and after it that are welded without a gap; all in the air. */
  weldAt(i) {
    if (!this.welding(i)) return this.rows;
    let [from, to] = [i, i];
    while (this.joined(from) && this.welding(from - 1)) from -= 1;
    while (to + 1 < this.n && this.joined(to + 1) && this.welding(to + 1)) to += 1;
    return this.rows.slice(from, to + 1);
  }

  points(rows) { return rows.flatMap((i) => [this.p[3 * i], this.p[3 * i + 1], this.p[3 * i + 2]]); }
}

/** Lines of the program, a file at a time; a bar tells how far off each was. */
class Listing {
  constructor(host, path) {
    Object.assign(this, { host, path, most: largest(path.most.before) || 1 });
    this.at = new Map(path.statements.map((row, k) => [`${row.path}:${row.line}`, k]));
    this.files = element("select", { "aria-label": "file", onchange: () => this.open(this.files.value) }, ...Object.keys(path.sources).map((name) => element("option", {}, name)));
    this.open(this.files.value);
  }

  open(file) {
    const { path, most } = this, rows = path.sources[file].map((text, k) => ({ text, k: this.at.get(`${file}:${k + 1}`), number: String(k + 1) }));
    const bar = (row, text) => element("span", { style: `--off: ${path.most.before[row.k] / most || 0}` }, text);
    this.files.value = file;
    this.host.replaceChildren(...(this.files.length > 1 ? [this.files] : []));
    this.table = new Table(this.host, [{ title: "line", value: (row) => row.number, mark: bar }, { title: "text", value: (row) => row.text }], rows,
      { label: "program text", kind: "listing", height: 20, bare: true, pick: (row) => (row.k === undefined ? announce("no motion statement") : path.chooseStatement(row.k, "text")) });
  }

  show({ path, line }) {
    if (path !== this.files.value) this.open(path);
    this.table.show(line - 1);
  }
}

function statementTable(host, path) {
  const rows = path.statements.map((row, k) => ({ ...row, k, target: path.targets[k], before: path.most.before[k], after: path.most.after[k],
    result: [row.status, row.reason].filter(Boolean).join(": ") }));
  const column = (title, key = title) => ({ title, value: (row) => row[key], number: key === "line" });
  const length = (title, key = title) => ({ title: `${title} [mm]`, number: true, value: (row) => row[key], shown: (row) => (Number.isFinite(row[key]) ? fixed(row[key], path.decimals) : "") });
  const several = (title, key) => (new Set(rows.map((row) => row[key])).size > 1 ? [column(title, key)] : []);
  return new Table(host, [...several("file", "path"), column("line"), column("instruction"), column("target"), length("before"), length("after"),
    length("moved", "shift_mm"), column("result"), ...several("routine", "routine")], rows, { label: "motion statements", pick: (row) => path.chooseStatement(row.k, "table") });
}

function seamTable(host, path, seams) {
  const length = (title, key, decimals = path.decimals) => ({ title, number: true, value: (s) => s[key], shown: (s) => (s[key] == null ? "" : fixed(s[key], decimals)) });
  const several = (title, key, least) => (seams.some((s) => s[key] > least) ? [{ title, number: true, value: (s) => s[key] }] : []);
  return new Table(host, [
    { title: "seam", value: (s) => s.name }, { title: "lines", value: (s) => s.line_from, shown: (s) => `${s.line_from} to ${s.line_to}` },
    ...several("runs", "runs", 1), length("length", "length_mm", 0), length("before", "before_mm"), length("after", "after_mm"),
    length("sideways", "sideways_after_mm"), length("stick-out", "stick_out_after_mm"), length("along", "along_after_mm"),
    { title: "in the model", value: (s) => (s.after_mm === null ? "not known" : s.kept ? "kept" : "exceeded"), mark: (s, text) => element("span", { class: text === "kept" && !s.left ? "good" : "bad" }, text) },
    ...several("targets added", "added_targets", 0), ...several("statements left", "left", 0),
  ], seams, { label: "seams", pick: (s) => path.seam.set(s) });
}

/** Charts of deviation, joints and torques along the path. */
function pathCharts(path, deviation, joints) {
  const across = (name) => path.size[name].map((x, i) => (path.space(i) ? x : NaN)), welding = (i) => path.welding(i), limits = Float32Array.from(path.move, (m) => path.moves.tolerance[m]);
  const after = { name: "in the model after", values: across("after"), color: "--after" }, limit = { name: "tolerance", values: limits, color: "--faint", dash: [4, 3] };
  const six = (values) => JOINTS.map((color, k) => ({ name: `J${k + 1}`, color, values: values.filter((_, i) => i % 6 === k) }));
  const welds = path.rows.filter(welding), most = welds.length ? welds.reduce((high, i) => Math.max(high, limits[i] || 0, after.values[i] || 0), 0) : undefined;
  const shared = { axes: [{ name: "time", unit: "s", values: path.t }, { name: "length", unit: "m", values: path.s }], shaded: welding, pick: (i) => path.chosen.set(i, "chart") };
  const charts = new Courses(shared, [
    { host: deviation, title: "Deviation before and in the model after", unit: "mm", height: 120, decimals: path.decimals, series: [{ name: "before", values: across("before"), color: "--before" }, after] },
    { host: deviation, title: "In the model after, against the tolerance", unit: "mm", height: 96, decimals: path.decimals, most, series: [after, limit] },
    { host: joints, title: "Speed of the joints, share of the limit", unit: "%", height: 140, series: six(path.speed) },
    { host: joints, title: "Torque of the motors", unit: "N m", height: 140, signed: true, series: six(path.torque) },
    { host: joints, title: "Correction of the joints", unit: "deg", height: 140, signed: true, series: six(path.correction) },
  ]);
  deviation.prepend(charts.tools());
  return charts;
}

function showPath() {
  const found = data("document"), packed = data("path");
  if (!packed) return;
  document.documentElement.classList.toggle("measured", Boolean(found.expected_accuracy));
  document.documentElement.classList.toggle("kept", found.verdict === "kept"); // shown on the arm itself
  const path = new Path(packed, found), place = (name) => document.querySelector(`[data-path="${name}"]`);
  const scene = new PathScene(place("space"), path, packed), listing = new Listing(place("text"), path), table = statementTable(place("statements"), path);
  if (place("seams")) seamTable(place("seams"), path, found.welds);
  const charts = pathCharts(path, place("deviation"), place("joints"));
  controls(place("controls"), place("legend"), path, scene);
  path.chosen.listen((i, from) => {
    const k = path.statement(i);
    charts.choose(i);
    scene.choose(i);
    if (from !== "text" && path.statements[k]) listing.show(path.statements[k]);
    if (from !== "table") table.show(k);
    announce(`${path.label(i)}: ${path.deviation(i)}`);
    if (from !== "start") address.set("place", i);
  });
  path.seam.listen((seam) => {
    const rows = path.between(seam);
    if (!rows.length) return announce("nothing of this seam could be measured");
    path.chosen.set(path.worst(rows), "seam");
    charts.show(rows[0], rows.at(-1));
    scene.show("weld", rows);
  });
  const known = path.rows.filter((i) => path.space(i)), welds = known.filter((i) => path.welding(i)), asked = address.number("place");
  path.chosen.set(path.rows[asked ?? -1] ?? path.worst([welds, known, path.rows].find((rows) => rows.length)), "start");
  scene.show("weld", path.weldAt(path.chosen.value));
  scene.space.recall();
}

/** Magnification, what is shown, the place along the program, and ways to look. */
function controls(host, legend, path, scene) {
  const at = element("input", { type: "range", min: "0", max: String(path.n - 1), "aria-label": "place along the program", oninput: () => path.chosen.set(Number(at.value), "slider") });
  path.chosen.listen((i) => { at.value = i; });
  const run = button("run", () => play(path, run), { "aria-pressed": "false" }), place = element("label", {}, element("span", {}, "place"), at, run);
  if (!scene.space.works) { host.append(place); legend.remove(); return; }
  const looks = ["weld", "whole path", ...(scene.arm ? ["whole arm"] : [])].map((name) => [name, () => scene.show(name)]);
  host.append(scene.space.buttons(Object.fromEntries(looks)), switchOf("what is drawn", ["before", "after", "both"], "both", (name) => scene.only(name)), place);
  legend.append(magnifier("Deviation drawn", "deviation is", scene.usual, (times) => scene.magnify(times)),
    entry("before", "before"), entry("after", "in the model after"), entry("weld", "weld"), entry("air", "in the air, or not known"));
}

/** Run the program in at most half a minute, from the chosen place on. */
function play(path, pressed) {
  const on = pressed.textContent === "run", { t, n } = path, fast = Math.max(1, (t[n - 1] - t[0]) / 30), start = performance.now();
  const tell = (is) => { pressed.setAttribute("aria-pressed", is); pressed.textContent = is ? "stop" : "run"; };
  let i = path.chosen.value >= n - 1 ? 0 : path.chosen.value;
  const from = t[i], step = (now) => {
    if (pressed.textContent === "run") return;
    while (i < n - 1 && t[i] < from + (fast * (now - start)) / 1000) i++;
    path.chosen.set(i, "run");
    if (i < n - 1) requestAnimationFrame(step); else tell(false);
  };
  tell(on);
  if (on) requestAnimationFrame(step);
}

showPath();
