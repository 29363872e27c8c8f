"use strict";
// Two programs: both paths over each other, and every statement of both beside each other.

/** One path: places, and the vectors to them from the nearest places of the first path. */
class OnePath {
  constructor({ p, away, ...others }) { Object.assign(this, { ...others, p: numbers(p), away: away && numbers(away), rows: upTo(others.row.length) }); }

  /** Whether a place is that of a target whose distance is known. */
  known(i) { return this.stop[i] !== this.stop[i + 1] && Number.isFinite(this.away[3 * i]); }

  /** Ends of the lines that lead to some places. */
  lines(places, to) { return linesTo(places, this.rows.filter((i) => i && this.joined[i] && to(i))); }
}

class TwoPaths {
  constructor(host, packed, chosen, words) {
    const a = new OnePath(packed.a), b = new OnePath(packed.b), every = [...a.p, ...b.p], far = Math.max(...lengths(b.away).filter(Number.isFinite), 1e-9);
    Object.assign(this, { a, b, chosen, words, places: b.p });
    const space = this.space = new Space(host, { label: "Both paths in space, their distance drawn larger than it is.", near: (x, y) => this.near(x, y) });
    if (!space.works) return;
    this.usual = far > 1e-8 ? Math.max(1, oneDigit((0.05 * diagonal(every)) / far)) : 1;
    const bundle = (color, width, opacity = 1) => space.lines(new Float32Array(6), { color, width, opacity });
    moveLines(bundle("--joint", 2), a.lines(a.p, () => true));
    [this.between, this.second] = [bundle("--accent", 1.1, 0.6), bundle("--accent", 2)];
    [this.dot, this.tag] = [space.tag("dot"), space.tag()];
    space.frame(every, [0.6, -0.8, 0.7]);
    space.recall();
  }

  magnify(times) {
    const { b } = this, places = this.places = b.p.map((x, k) => (Number.isFinite(b.away[k]) ? x + (times - 1) * b.away[k] : x));
    const ends = b.rows.filter((i) => b.known(i) && b.row[i] >= 0).flatMap((i) => [0, 1, 2, 3, 4, 5].map((k) => (k < 3 ? b.p[3 * i + k] - b.away[3 * i + k] : places[3 * i + k - 3])));
    moveLines(this.between, Float32Array.from(ends));
    moveLines(this.second, b.lines(places, (i) => b.row[i] >= 0 || b.row[i - 1] >= 0));
    this.show(this.chosen.value);
  }

  /** Ring where a difference is: in the second program, else in the first. */
  show(row) {
    if (!this.space.works) return;
    const [i, places] = [[this.b, this.places], [this.a, this.a.p]].map(([path, at]) => [path.row.lastIndexOf(row), at]).find(([k]) => k >= 0 && row >= 0) || [-1];
    const at = i < 0 ? null : [...places.subarray(3 * i, 3 * i + 3)];
    this.dot(at);
    this.tag(at, at ? this.words(row) : "");
    this.space.later();
  }

  near(x, y) {
    for (const [path, places] of [[this.b, this.places], [this.a, this.a.p]]) {
      const row = path.row[this.space.nearest(places, path.rows.filter((k) => path.row[k] >= 0), x, y)];
      if (row !== undefined) return { text: this.words(row), pick: () => this.chosen.set(row, "space") };
    }
    return null;
  }

  controls(host, legend, unknown) {
    if (!this.space.works) { legend.remove(); return; }
    host.append(this.space.buttons({ "both paths": () => this.space.frame([...this.a.p, ...this.places]) }), magnifier("distance", "distance is", this.usual, (times) => this.magnify(times), 1));
    legend.append(entry("first", "first program"), entry("second", "second program, where it differs"),
      ...(unknown ? [element("span", {}, `${unknown} targets are joint angles, or known at run time only: they are not drawn.`)] : []));
  }
}

/** Words of a text, those set apart that another text has not. */
function marked(text, other) {
  const words = (all) => all.split(/([,:\s\[\]]+)/), others = words(other);
  return words(text).map((word) => {
    const k = others.indexOf(word);
    if (k >= 0) others.splice(k, 1);
    return k >= 0 || !/\w/.test(word) ? word : element("mark", {}, word);
  });
}

/** What stands in one of the two programs: the statement, and where its target is if that is another place. */
function sideOf(d, side) {
  const [first] = d.arguments, moved = d.what === "motion", here = (k) => (moved ? [d.text_a, d.text_b][k] : first ? [first.a, first.b][k] : "");
  const at = (k) => (d.position_mm && d.distance_mm > 0 ? `[${d.position_mm[k].map((x) => x.toFixed(3)).join(", ")}]` : "");
  const text = moved || (d.kind === "changed" && first) ? here(side) : (d.kind === "added") === Boolean(side) ? d.name : "";
  return { text, other: here(1 - side), at: at(side), otherAt: at(1 - side) };
}

function differenceTable(host, every, line, pick) {
  const figure = (x, digits) => (x === null || x === undefined ? "" : fixed(x, digits)), some = (get) => every.some((d) => get(d)), most = Math.max(...every.map((d) => d.distance_mm || 0), 1e-9);
  const what = (d) => (d.what === "motion" ? d.kind : `${d.kind} ${d.what}`);
  const bar = (d, text) => element("div", { class: "amount", title: d.shift_mm && `${["dx", "dy", "dz"].map((name, k) => `${name} ${figure(d.shift_mm[k], 3)}`).join(", ")} mm${d.at_circle_point ? ", at the circle point" : ""}` },
    element("i", { style: `width: ${(100 * d.distance_mm) / most}%` }), element("span", {}, text));
  const also = (d) => [...(d.conf ? [`confdata [${d.conf[0]}] \u2192 [${d.conf[1]}]`] : []), ...(d.speed_mm_s ? [`speed ${d.speed_mm_s.join(" \u2192 ")} mm/s`] : []),
    ...(d.what === "motion" ? d.arguments.map((one) => `${one.role}: ${one.a || "-"} \u2192 ${one.b || "-"}`) : [])].join("; ");
  const statement = (side) => ({
    title: side ? "in the second" : "in the first", value: (d) => { const { text, at } = sideOf(d, side); return `${text} ${at}`.trim(); },
    mark: (d) => {
      const { text, other, at, otherAt } = sideOf(d, side);
      return element("span", { class: "statement" }, ...marked(text, other), ...(at ? [" ", element("span", { class: "at" }, ...marked(at, otherAt))] : []));
    },
  });
  const amount = (title, key, mark) => (some((d) => d[key]) ? [{ title, number: true, value: (d) => d[key], shown: (d) => figure(d[key], 3), mark }] : []);
  return new Table(host, [
    ...(some((d) => d.file) ? [{ title: "file", value: (d) => d.file }] : []),
    { title: "line", value: (d) => d.line_b ?? d.line_a, shown: (d) => `${line(d)} ${what(d)} ${d.place}`, mark: (d) => element("span", {}, line(d), " ", element("span", { class: "place" }, what(d), " ", d.place)) },
    ...amount("moved by [mm]", "distance_mm", bar), statement(0), statement(1), ...amount("turned by [deg]", "angle_deg"),
    ...(some(also) ? [{ title: "else", value: also }] : []),
  ], every, { label: "differences", kind: "differences", pick });
}

function showDifferences() {
  const place = (name) => document.querySelector(`[data-differences="${name}"]`), found = data("document"), packed = data("differences");
  if (!place("table")) return;
  const every = found.differences || found.files.flatMap((file) => file.differences.map((d) => ({ ...d, file: file.path }))), chosen = new Choice(-1);
  const line = (d) => [...new Set([d.line_a, d.line_b])].filter((x) => x !== null).join(" \u2192 ");
  const words = (k) => `line ${line(every[k])}: ${every[k].distance_mm === null ? every[k].kind : `${fixed(every[k].distance_mm, 3)} mm`}`;
  const table = differenceTable(place("table"), every, line, (d, k) => chosen.set(k, "table"));
  const paths = place("space") && new TwoPaths(place("space"), packed, chosen, words);
  paths?.controls(place("controls"), place("legend"), packed.a.unknown + packed.b.unknown);
  chosen.listen((k, from) => {
    paths?.show(k);
    if (from !== "table") table.show(k);
    announce(words(k));
    if (from !== "start") address.set("place", k);
  });
  const asked = address.number("place"), worst = every.reduce((best, d, k) => ((d.distance_mm || 0) > (every[best].distance_mm || 0) ? k : best), 0);
  if (every.length) chosen.set(every[asked ?? -1] ? asked : worst, "start");
}

showDifferences();
