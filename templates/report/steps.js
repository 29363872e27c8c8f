"use strict";
// A model step by step: as it came, with each effect that was found, or the first and the last beside each other.

const FALL = 450; // milliseconds that the residuals take from one step to the next
const BOTH = -1; // the step at which the first and the last are shown beside each other

/** Residuals at the drawn poses, for every step, in space, and the arm at the chosen pose. */
class ResidualScene {
  constructor(host, packed) {
    const { steps, label } = packed, p = numbers(packed.p), unpacked = (one) => ({ ...one, wrench: numbers(one.wrench) });
    Object.assign(this, { label, p, q: numbers(packed.q), rows: upTo(label.length), last: steps.length - 1, chosen: new Choice(-1), step: 0 });
    this.away = steps.map((step) => numbers(step.away));
    this.forces = steps.map((step) => step.forces.map(unpacked));
    this.strongest = Math.max(1e-9, ...this.forces.flat().map(({ wrench }) => largest(lengths(wrench.filter((_, k) => k % 6 < 3)))));
    const sorted = lengths(this.away[0]).sort(); // the base decides, so that a fall is seen
    this.usual = oneDigit((70 * diagonal(p)) / (sorted[Math.floor(0.98 * (label.length - 1))] || 1e-3));
    const space = this.space = new Space(host, { label: "Residuals where they were measured, drawn larger than they are.", near: (x, y) => this.near(x, y) });
    if (!space.works) return;
    floor(space);
    this.ends = new Float32Array(2 * p.length);
    [this.came, this.found, this.pulls] = [["--before", 1.8], ["--ink", 1.8], ["--ink", 3]].map(([color, width]) => space.lines(this.ends.slice(), { color, width }));
    this.dot = space.tag("dot");
    this.names = upTo(4).map(() => space.tag());
    this.arm = new Arm(space, packed.arm);
    this.arm.group.visible = this.pulls.visible = false;
    this.now = Float32Array.from(this.away[0]);
    space.frame(p, [0.7, -0.7, 0.5]);
    space.recall();
  }

  /** Draw vectors of some residuals [mm]. */
  draw(lines, away) {
    const { p, ends, times } = this;
    for (let i = 0; i < p.length; i += 3) {
      ends.set(p.subarray(i, i + 3), 2 * i);
      for (let c = 0; c < 3; c++) ends[2 * i + 3 + c] = p[i + c] + (times / 1000) * (away[i + c] || 0);
    }
    const { visible } = lines;
    moveLines(lines, ends);
    lines.visible = visible;
    this.space.later();
  }

  magnify(times) {
    this.times = times;
    this.draw(this.came, this.away[0]);
    this.draw(this.found, this.now);
  }

  show(step, slowly) {
    this.step = step;
    if (!this.space.works) return;
    this.came.visible = step === BOTH || step === 0;
    this.found.visible = step !== 0;
    this.choose(this.chosen.value);
    const to = this.away[step === BOTH ? this.last : step], from = Float32Array.from(this.now), start = performance.now();
    const time = slowly && !matchMedia("(prefers-reduced-motion: reduce)").matches ? FALL : 1;
    const go = (now) => {
      if (this.step !== step) return;
      const x = Math.min((now - start) / time, 1), part = x * x * (3 - 2 * x);
      for (let i = 0; i < to.length; i++) this.now[i] = from[i] + part * (to[i] - from[i]);
      this.draw(this.found, this.now);
      if (x < 1) requestAnimationFrame(go);
    };
    go(time === 1 ? Infinity : start);
  }

  /** The arm at a pose, and the forces on its bodies along their lines of action, each where that is nearest to its body. */
  choose(i) {
    const { space, arm } = this, ends = [], pulls = new Map();
    if (!space.works) return;
    arm.group.visible = i >= 0;
    this.dot(i < 0 ? null : [...this.p.subarray(3 * i, 3 * i + 3)]);
    if (i >= 0) arm.pose(this.q, i, 0);
    const places = i < 0 ? [] : arm.places();
    for (const { name, body, wrench } of i < 0 ? [] : this.forces[this.step === BOTH ? this.last : this.step]) {
      const [f, moment] = [6 * i, 6 * i + 3].map((k) => new THREE.Vector3().fromArray(wrench, k)), size = f.length();
      if (size < 1e-3 * this.strongest) continue;
      const at = new THREE.Vector3().fromArray(places, 3 * Math.min(body, 7)), m = moment.sub(at.clone().cross(f)); // about the body
      at.addScaledVector(f.clone().cross(m), 1 / size ** 2);
      const tip = at.clone().addScaledVector(f, 0.45 / this.strongest).toArray();
      ends.push(...at.toArray(), ...tip);
      if (!pulls.has(name)) pulls.set(name, [tip, `${name}: ${short(Math.round(size))} N`]); // a pull between two bodies is named once
    }
    moveLines(this.pulls, Float32Array.from(ends));
    this.names.forEach((tag, k) => tag(...([...pulls.values()][k] || [null])));
    space.later();
  }

  near(x, y) {
    const i = this.space.nearest(this.p, this.rows, x, y), size = (k) => `${Math.hypot(...this.away[k].subarray(3 * i, 3 * i + 3)).toFixed(3)} mm`;
    return i < 0 ? null : { text: `${this.label[i]}\n${this.last ? `${size(0)} off as it came, ${size(this.last)} with what was found` : `${size(0)} off`}`, pick: () => this.chosen.set(i, "space") };
  }

  controls(host, legend, { drawn, of }) {
    if (!this.space.works) return;
    host.append(this.space.buttons({ "all poses": () => this.space.frame(this.p), "with the arm": () => this.space.frame([...this.p, ...(this.chosen.value < 0 ? [0, 0, 0] : this.arm.places())]) }),
      magnifier("residual", "residuals are", this.usual, (times) => this.magnify(times)));
    legend.append(entry("before", this.last ? "residual as it came" : "residual"), ...(this.last ? [entry("after", "with what was found")] : []),
      element("span", {}, `From the predicted position along measured minus predicted; a click shows the arm there.${drawn < of ? ` ${thousands(drawn)} of ${thousands(of)} poses, the worst among them.` : ""}`));
  }
}

function showSteps() {
  const packed = data("steps");
  if (!packed) return;
  const place = (name) => document.querySelector(`[data-steps="${name}"]`), { steps, unit } = packed, last = steps.length - 1, step = new Choice(null);
  const scene = place("space") && new ResidualScene(place("space"), packed);
  scene?.controls(place("view"), place("legend"), packed);
  scene?.chosen.listen((i) => { scene.choose(i); announce(packed.label[i]); });
  const pictures = (list) => list.filter(([svg]) => svg).map(([svg, i]) => `<div class="${i ? "found" : "came"}">${svg}</div>`).join("");
  const error = (k) => (k === BOTH ? `${steps[0].error.toFixed(3)} \u2192 ${steps[last].error.toFixed(3)} ${unit}` : `${steps[k].error.toFixed(3)} ${unit}`);
  const bars = [...document.querySelectorAll(".bars [data-step]")], [charts, evidence, program] = ["charts", "evidence", "program"].map(place);
  step.listen((k, from) => {
    const both = k === BOTH ? [0, last] : [k], shown = both.at(-1), { laws } = steps[shown];
    if (charts) charts.innerHTML = pictures(steps[0].charts.flatMap((_, c) => both.map((i) => [steps[i].charts[c], i]))) || "<p>No channel stands out.</p>";
    if (evidence) evidence.innerHTML = pictures([k === BOTH ? packed.distances : steps[k].distances, ...laws].map((svg) => [svg, shown]));
    program?.replaceChildren(...sampleProgram(steps, shown));
    scene?.show(k, from !== "start");
    for (const bar of bars) bar.classList.toggle("here", both.includes(Number(bar.dataset.step)));
    if (from !== "start") { address.set("step", k); announce(error(k)); }
  });
  for (const bar of bars) bar.addEventListener("click", () => step.set(Number(bar.dataset.step), "bar"));
  if (last && place("controls")) stepControls(place("controls"), step, steps, error);
  const asked = address.number("step");
  step.set([BOTH, ...steps.keys()].includes(asked) && last ? asked : last ? BOTH : 0, "start");
  worstTable(packed, scene);
}

function stepControls(host, step, steps, error) {
  const last = steps.length - 1, order = [0, BOTH, ...upTo(steps.length).slice(1)], name = (k) => (k === BOTH ? "both" : k ? steps[k].name : "as it came");
  const group = element("span", { class: "buttons", role: "group", "aria-label": "step of the model" }, ...order.map((k) => button(name(k), () => step.set(k, "button"), { "data-shows": k })));
  const shown = element("output", {});
  step.listen((k) => {
    for (const one of group.children) one.setAttribute("aria-pressed", Number(one.dataset.shows) === k);
    shown.textContent = error(k);
    shown.className = `step ${k === BOTH ? "" : k ? "found" : "came"}`;
  });
  addEventListener("keydown", (e) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
    if (by && e.target === document.body) step.set(order[Math.min(Math.max(order.indexOf(step.value) + by, 0), order.length - 1)], "key");
  });
  host.append(group, shown, button("watch the error fall", () => { for (let k = 0; k <= last; k++) setTimeout(() => step.set(k, "play"), 1300 * k); }));
}

/** Targets as the controller would get them; figures that are not those of the step before stand out. */
function sampleProgram(steps, k) {
  return steps[k].program.map(({ name, programmed, written }, i) => {
    const before = k ? steps[k - 1].program[i].written : programmed, moved = Math.hypot(...written.map((x, c) => x - programmed[c]));
    const figures = written.flatMap((x, c) => [c ? "," : "", element(Math.abs(x - before[c]) >= 0.0005 ? "mark" : "span", {}, x.toFixed(3))]);
    return element("div", {}, "MoveL [[", ...figures, "],..],v100,fine,tTool;", element("span", { class: "quiet" }, `  ! ${name}, moved by ${moved.toFixed(3)} mm`));
  });
}

function worstTable({ unit, row: rows }, scene) {
  const host = document.querySelector('[data-steps="worst"]'), { worst } = data("document");
  if (!host || !worst.length) return;
  const key = Object.keys(worst[0]).find((name) => name.startsWith("error_")), column = (title, name = title, number = false) => ({ title, number, value: (row) => row[name] });
  new Table(host, [column("pose", "pose_id"), ...(worst[0].file ? [column("file")] : []), column("row", "row", true), { ...column(`off [${unit}]`, key, true), shown: (row) => row[key].toFixed(3) }],
    worst, { label: "worst poses", pick: ({ row }) => { if (rows.includes(row)) scene?.chosen.set(rows.indexOf(row), "table"); } });
}

showSteps();
