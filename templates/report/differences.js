"use strict";
// Two programs: both paths over each other, and every statement of both beside each other.

/** One path: places, and the vectors to them from the nearest places of the first path. */
class OnePath {
  constructor({ p, away, row, joined, stop }) {
    Object.assign(this, { p: numbers(p), away: away ? numbers(away) : null, row, joined, stop, rows: row.map((_, i) => i) });
  }

  /** Whether a place is that of a target whose distance is known. */
  known(i) { return this.stop[i] !== this.stop[i + 1] && Number.isFinite(this.away[3 * i]); }

  /** Places with the vectors from the first path drawn so many times as large. */
  drawn(times) { return this.p.map((x, k) => (Number.isFinite(this.away[k]) ? x + (times - 1) * this.away[k] : x)); }

  /** Ends of the lines that lead to some places. */
  lines(places, to) { return Float32Array.from(this.rows.filter((i) => i && this.joined[i] && to(i)).flatMap((i) => [...places.subarray(3 * i - 3, 3 * i + 3)])); }
}

class TwoPaths {
  constructor(host, packed, chosen, words) {
    Object.assign(this, { a: new OnePath(packed.a), b: new OnePath(packed.b), chosen, words });
    const space = this.space = new Space(host, { label: "Both paths in space, their distance drawn larger than it is.", near: (x, y) => this.near(x, y) });
    if (!space.works) return;
    const far = Math.max(...lengths(this.b.away).filter(Number.isFinite), 1e-9), every = [...this.a.p, ...this.b.p];
    const side = (k) => every.filter((_, i) => i % 3 === k), reach = Math.hypot(...[0, 1, 2].map((k) => Math.max(...side(k)) - Math.min(...side(k)))) || 1;
    this.usual = far > 1e-8 ? Math.max(1, Number(((0.05 * reach) / far).toPrecision(1))) : 1;
    const bundle = (color, width, opacity = 1) => { const made = space.lines(new Float32Array(6), { color, width, opacity }); space.scene.add(made); return made; };
    this.drawn = { a: bundle("--joint", 2), between: bundle("--accent", 1.1, 0.6), b: bundle("--accent", 2) };
    [this.dot, this.tag] = [space.tag("dot"), space.tag()];
    this.magnify(address.number("times") || this.usual);
    space.frame(every, [0.6, -0.8, 0.7]);
    space.recall();
  }

  magnify(times) {
    this.times = times;
    const { a, b } = this, places = this.places = b.drawn(times), differ = (path) => (i) => path.row[i] >= 0 || path.row[i - 1] >= 0;
    const between = b.rows.filter((i) => b.known(i) && b.row[i] >= 0).flatMap((i) => [0, 1, 2, 3, 4, 5].map((k) => (k < 3 ? b.p[3 * i + k] - b.away[3 * i + k] : places[3 * i + k - 3])));
    this.put("a", a.lines(a.p, () => true));
    this.put("between", Float32Array.from(between));
    this.put("b", b.lines(places, differ(b)));
    this.show(this.chosen.value);
  }

  put(name, ends) {
    const line = this.drawn[name], geometry = line.geometry.constructor;
    line.visible = ends.length > 0;
    if (!ends.length) return;
    line.geometry.dispose();
    line.geometry = new geometry();
    line.geometry.setPositions(ends);
  }

  /** Ring where a difference is: in the second program, else in the first. */
  show(row) {
    if (!this.space.works) return;
    let i = this.b.row.lastIndexOf(row), at = this.places;
    if (i < 0) [i, at] = [this.a.row.lastIndexOf(row), this.a.p];
    const known = row >= 0 && i >= 0;
    for (const mark of [this.dot, this.tag]) Object.assign(mark, { shown: known, at: known ? [...at.subarray(3 * i, 3 * i + 3)] : [0, 0, 0] });
    this.tag.text = known ? this.words(row) : "";
    this.space.later();
  }

  near(x, y) {
    const { a, b, space } = this;
    let i = space.nearest(this.places, b.rows.filter((k) => b.row[k] >= 0), x, y), row = b.row[i];
    if (i < 0) { i = space.nearest(a.p, a.rows.filter((k) => a.row[k] >= 0), x, y); row = a.row[i]; }
    return i < 0 ? null : { text: this.words(row), pick: () => this.chosen.set(row, "space") };
  }
}

/** Words of a text, those set apart that another text has not. */
function marked(text, other) {
  const words = (all) => all.split(/([,:\s\[\]]+)/), theirs = new Map();
  for (const word of words(other)) theirs.set(word, (theirs.get(word) || 0) + 1);
  return words(text).map((word) => {
    const left = theirs.get(word) || 0;
    theirs.set(word, left - 1);
    return left > 0 || !/\w/.test(word) ? word : element("mark", {}, word);
  });
}

/** What stands in one of the two programs: the statement, and where its target is if that is another place. */
function sideOf(d, side) {
  const [mine, other] = side ? ["text_b", "text_a"] : ["text_a", "text_b"], value = (of) => (of === "text_a" ? "a" : "b");
  const first = d.arguments[0], text = d.what === "motion" ? d[mine] : d.kind === "changed" && first ? first[value(mine)] : (d.kind === "added") === Boolean(side) ? d.name : "";
  const beside = d.what === "motion" ? d[other] : first ? first[value(other)] : "";
  const at = (k) => d.position_mm && d.distance_mm > 0 ? `[${d.position_mm[k].map((x) => x.toFixed(3)).join(", ")}]` : "";
  return { text, other: beside, at: at(side), otherAt: at(1 - side) };
}

function showDifferences() {
  const host = document.querySelector('[data-differences="table"]'), found = data("document"), packed = data("differences");
  if (!host) return;
  const every = found.differences || found.files.flatMap((file) => file.differences.map((d) => ({ ...d, file: file.path })));
  const chosen = new Choice(-1), most = Math.max(...every.map((d) => d.distance_mm || 0), 1e-9);
  const line = (d) => [d.line_a, d.line_b].filter((x, k) => x !== null && (k === 0 || x !== d.line_a)).join(" \u2192 ");
  const what = (d) => (d.what === "motion" ? d.kind : `${d.kind} ${d.what}`);
  const fixed = (x, digits) => (x === null || x === undefined ? "" : x.toFixed(digits));
  const bar = (d) => {
    const made = element("div", { class: "amount" }, element("i", { style: `width: ${(100 * d.distance_mm) / most}%` }), element("span", {}, fixed(d.distance_mm, 3)));
    if (d.shift_mm) made.title = `dx ${fixed(d.shift_mm[0], 3)}, dy ${fixed(d.shift_mm[1], 3)}, dz ${fixed(d.shift_mm[2], 3)} mm${d.at_circle_point ? ", at the circle point" : ""}`;
    return made;
  };
  const also = (d) => [...(d.conf ? [`confdata [${d.conf[0]}] \u2192 [${d.conf[1]}]`] : []), ...(d.speed_mm_s ? [`speed ${d.speed_mm_s.join(" \u2192 ")} mm/s`] : []),
    ...(d.what === "motion" ? d.arguments.map((one) => `${one.role}: ${one.a || "-"} \u2192 ${one.b || "-"}`) : [])].join("; ");
  const statement = (side) => ({
    title: side ? "in the second" : "in the first", value: (d) => { const { text, at } = sideOf(d, side); return `${text} ${at}`.trim(); },
    mark: (d) => {
      const { text, other, at, otherAt } = sideOf(d, side);
      return element("span", { class: "statement" }, ...marked(text, other), ...(at ? [" ", element("span", { class: "at" }, ...marked(at, otherAt))] : []));
    },
  });
  const some = (get) => every.some((d) => get(d));
  const table = new Table(host, [
    ...(some((d) => d.file) ? [{ title: "file", value: (d) => d.file }] : []),
    { title: "line", value: (d) => d.line_b ?? d.line_a, shown: (d) => `${line(d)} ${what(d)} ${d.place}`, mark: (d) => element("span", {}, line(d), " ", element("span", { class: "place" }, what(d), " ", d.place)) },
    ...(some((d) => d.distance_mm) ? [{ title: "moved by [mm]", number: true, value: (d) => d.distance_mm, shown: (d) => fixed(d.distance_mm, 3), mark: bar }] : []),
    statement(0), statement(1),
    ...(some((d) => d.angle_deg) ? [{ title: "turned by [deg]", number: true, value: (d) => d.angle_deg, shown: (d) => fixed(d.angle_deg, 3) }] : []),
    ...(some(also) ? [{ title: "else", value: also }] : []),
  ], every, { label: "differences", pick: (d, k) => chosen.set(k, "table") });
  table.table.classList.add("differences");
  const words = (k) => `line ${line(every[k])}: ${every[k].distance_mm === null ? every[k].kind : `${fixed(every[k].distance_mm, 3)} mm`}`;
  const place = (name) => document.querySelector(`[data-differences="${name}"]`);
  const paths = place("space") && new TwoPaths(place("space"), packed, chosen, words);
  chosen.listen((k, from) => {
    paths?.show(k);
    if (from !== "table") table.show(k);
    announce(words(k));
    if (from !== "start") address.set("place", k);
  });
  if (!every.length) return;
  if (paths) magnification(place("controls"), place("legend"), paths, packed);
  const asked = address.number("place"), worst = every.reduce((best, d, k) => ((d.distance_mm || 0) > (every[best].distance_mm || 0) ? k : best), 0);
  chosen.set(asked !== null && every[asked] ? asked : worst, "start");
}

function magnification(host, legend, paths, packed) {
  if (!paths.space.works) { legend.remove(); return; }
  const out = element("output", {}), times = element("input", { type: "range", min: "0", max: "100", "aria-label": "how many times as large the distance is drawn" });
  times.value = 50 + 25 * Math.log10(paths.times / paths.usual);
  const tell = () => { out.textContent = paths.times === 1 ? "as it is" : `${thousands(paths.times)} times as large`; };
  times.addEventListener("input", () => {
    paths.magnify(Math.max(1, Number((paths.usual * 10 ** ((times.value - 50) / 25)).toPrecision(1))));
    address.set("times", paths.times);
    tell();
  });
  tell();
  host.append(paths.space.buttons({ "both paths": () => [[...paths.a.p, ...paths.places], null] }), element("label", {}, "distance", times, out));
  const key = (name, text) => element("span", {}, element("i", { class: name }), text), unknown = packed.a.unknown + packed.b.unknown;
  legend.append(key("first", "first program"), key("second", "second program, where it differs"),
    ...(unknown ? [element("span", {}, `${unknown} targets are joint angles, or known at run time only: they are not drawn.`)] : []));
}

showDifferences();
