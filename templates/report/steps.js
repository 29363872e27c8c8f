"use strict";
// A model step by step: as it came, with each effect that was found, or the first and the last beside each other.

const FALL = 450; // milliseconds that the residuals take from one step to the next
const BOTH = -1; // the step at which the first and the last are shown beside each other

/** Residuals at the drawn poses, for every step. */
class Residuals {
  constructor(packed) {
    Object.assign(this, { steps: packed.steps, label: packed.label, unit: packed.unit, n: packed.label.length, p: numbers(packed.p), q: numbers(packed.q) });
    this.away = packed.steps.map((step) => numbers(step.away));
    const sorted = lengths(this.away[0]).sort(); // the base decides, so that a fall is seen
    const side = (k) => component(this.p, 3, k), reach = Math.hypot(...[0, 1, 2].map((k) => Math.max(...side(k)) - Math.min(...side(k)))) || 1;
    this.usual = Number(((70 * reach) / (sorted[Math.floor(0.98 * (this.n - 1))] || 1e-3)).toPrecision(1));
    this.times = address.number("times") || this.usual;
    this.forces = packed.steps.map((step) => step.forces.map((one) => ({ ...one, wrench: numbers(one.wrench) })));
    this.strongest = Math.max(1e-9, ...this.forces.flat().map(({ wrench }) => largest(lengths(wrench.filter((_, k) => k % 6 < 3)))));
    this.chosen = new Choice(-1);
    this.rows = Array.from({ length: this.n }, (_, i) => i);
  }
}

class ResidualScene {
  constructor(host, all, packed) {
    this.all = all;
    const space = this.space = new Space(host, { label: "Residuals where they were measured, drawn larger than they are.", near: (x, y) => this.near(x, y) });
    if (!space.works) return;
    space.scene.add(floor(space));
    this.vectors = { came: space.lines(this.ends(all.away[0]), { color: "--before", width: 1.8 }), found: space.lines(this.ends(all.away[0]), { color: "--ink", width: 1.8 }) };
    this.pulls = space.lines(new Float32Array(6), { color: "--ink", width: 3 });
    this.dot = space.tag("dot");
    this.names = [0, 1, 2, 3].map(() => space.tag());
    this.arm = new Arm(space, packed.arm);
    this.arm.group.visible = this.pulls.visible = false;
    space.scene.add(...Object.values(this.vectors), this.pulls, this.arm.group);
    this.now = Float32Array.from(all.away[0]);
    space.frame(all.p, [0.7, -0.7, 0.5]);
    space.recall();
  }

  /** Ends of the vectors of some residuals [mm]. */
  ends(away) {
    const { p, n, times } = this.all, made = new Float32Array(6 * n);
    for (let i = 0; i < 3 * n; i++) {
      const k = 6 * Math.floor(i / 3) + (i % 3);
      made[k] = p[i];
      made[k + 3] = p[i] + (times / 1000) * (away[i] || 0);
    }
    return made;
  }

  show(step, slowly) {
    this.step = step;
    if (!this.space.works) return;
    const { all } = this, last = all.steps.length - 1, to = all.away[step === BOTH ? last : step];
    this.vectors.came.visible = step === BOTH || step === 0;
    this.vectors.found.visible = step !== 0;
    this.vectors.came.geometry.setPositions(this.ends(all.away[0]));
    const from = Float32Array.from(this.now), start = performance.now();
    const put = (part) => {
      for (let i = 0; i < to.length; i++) this.now[i] = from[i] + part * (to[i] - from[i]);
      this.vectors.found.geometry.setPositions(this.ends(this.now));
      this.space.later();
    };
    this.choose(all.chosen.value);
    if (!slowly || matchMedia("(prefers-reduced-motion: reduce)").matches) { put(1); return; }
    const go = (now) => {
      if (this.step !== step) return;
      const part = Math.min((now - start) / FALL, 1);
      put(part * part * (3 - 2 * part));
      if (part < 1) requestAnimationFrame(go);
    };
    requestAnimationFrame(go);
  }

  /** The arm at a pose, and the forces on its bodies along their lines of action, each where that is nearest to its body. */
  choose(i) {
    const { all, space, arm } = this;
    if (!space.works) return;
    Object.assign(this.dot, { shown: i >= 0, at: i < 0 ? [0, 0, 0] : [...all.p.subarray(3 * i, 3 * i + 3)] });
    arm.group.visible = i >= 0;
    const ends = [], told = new Map();
    if (i >= 0) {
      arm.pose(all.q, i, 0);
      const places = arm.places(), steps = this.step === BOTH ? all.steps.length - 1 : this.step ?? 0;
      for (const { name, body, wrench } of all.forces[steps]) {
        const [f, moment] = [wrench.subarray(6 * i, 6 * i + 3), wrench.subarray(6 * i + 3, 6 * i + 6)].map((v) => new THREE.Vector3(...v)), size = f.length();
        if (size < 1e-3 * all.strongest) continue;
        const o = new THREE.Vector3().fromArray(places, 3 * Math.min(body, 7)), m = moment.sub(o.clone().cross(f)); // about the body
        const c = o.addScaledVector(f.clone().cross(m), 1 / size ** 2), tip = c.clone().addScaledVector(f, 0.45 / all.strongest);
        ends.push(...c.toArray(), ...tip.toArray());
        if (!told.has(name)) told.set(name, [tip.toArray(), `${name}: ${short(Math.round(size))} N`]); // a pull between two bodies is told once
      }
    }
    this.pulls.visible = ends.length > 0;
    if (ends.length) this.pulls.geometry.setPositions(Float32Array.from(ends));
    this.names.forEach((tag, k) => { const [at, text] = [...told.values()][k] || [[0, 0, 0], ""]; Object.assign(tag, { at, text, shown: Boolean(text) }); });
    space.later();
  }

  near(x, y) {
    const { all } = this, i = this.space.nearest(all.p, all.rows, x, y);
    if (i < 0) return null;
    const size = (k) => `${Math.hypot(...all.away[k].subarray(3 * i, 3 * i + 3)).toFixed(3)} mm`, last = all.steps.length - 1;
    return { text: `${all.label[i]}\n${last ? `${size(0)} off as it came, ${size(last)} with what was found` : `${size(0)} off`}`, pick: () => all.chosen.set(i, "space") };
  }

  buttons() {
    return this.space.buttons({ "all poses": () => [this.all.p, null], "with the arm": () => [[...this.all.p, ...(this.all.chosen.value < 0 ? [0, 0, 0] : this.arm.places())], null] });
  }
}

function showSteps() {
  const packed = data("steps");
  if (!packed) return;
  const place = (name) => document.querySelector(`[data-steps="${name}"]`), { steps } = packed, last = steps.length - 1;
  const step = new Choice(null);
  let all = null, scene = null;
  if (place("space")) {
    all = new Residuals(packed);
    scene = new ResidualScene(place("space"), all, packed);
    residualControls(place("view"), place("legend"), all, scene, packed);
    all.chosen.listen((i) => { scene.choose(i); announce(all.label[i]); });
  }
  const some = (name, k) => (k === BOTH ? [0, last] : [k]).map((i) => [steps[i][name], i]);
  const pictures = (list) => list.filter(([svg]) => svg).map(([svg, i]) => `<div class="${i ? "found" : "came"}">${svg}</div>`).join("");
  step.listen((k, from) => {
    const shown = k === BOTH ? last : k, [charts, evidence, program] = ["charts", "evidence", "program"].map(place);
    if (charts) charts.innerHTML = pictures(steps[0].charts.flatMap((_, c) => some("charts", k).map(([svg, i]) => [svg[c], i]))) || "<p>No channel stands out.</p>";
    if (evidence) evidence.innerHTML = pictures([[k === BOTH ? packed.distances : steps[k].distances, shown], ...steps[shown].laws.map((law) => [law, shown])]);
    if (program) program.replaceChildren(...sampleProgram(steps, shown));
    scene?.show(k, from !== "start");
    document.querySelectorAll(".bars [data-step]").forEach((bar) => bar.classList.toggle("here", k === BOTH ? [0, last].includes(Number(bar.dataset.step)) : Number(bar.dataset.step) === k));
    if (from !== "start") { address.set("step", k); announce(stepWords(steps, k, packed.unit)); }
  });
  document.querySelectorAll(".bars [data-step]").forEach((bar) => bar.addEventListener("click", () => step.set(Number(bar.dataset.step), "bar")));
  if (last && place("controls")) stepControls(place("controls"), step, packed);
  const asked = address.number("step");
  step.set(asked !== null && asked >= BOTH && asked <= last ? asked : last ? BOTH : 0, "start");
  worstTable(packed, all);
}

const stepWords = (steps, k, unit) => (k === BOTH ? `${steps[0].error.toFixed(3)} \u2192 ${steps[steps.length - 1].error.toFixed(3)} ${unit}` : `${steps[k].error.toFixed(3)} ${unit}`);

function stepControls(host, step, { steps, unit }) {
  const last = steps.length - 1, order = [0, BOTH, ...steps.keys()].filter((k, i, every) => every.indexOf(k) === i);
  const names = new Map(order.map((k) => [k, k === BOTH ? "both" : k ? steps[k].name : "as it came"]));
  const group = element("span", { class: "buttons", role: "group", "aria-label": "step of the model" },
    ...order.map((k) => button(names.get(k), () => step.set(k, "button"), { "data-shows": k })));
  const told = element("output", { class: "step" });
  step.listen((k) => {
    for (const one of group.children) one.setAttribute("aria-pressed", Number(one.dataset.shows) === k);
    told.textContent = stepWords(steps, k, unit);
    told.className = `step ${k === BOTH ? "" : k ? "found" : "came"}`;
  });
  addEventListener("keydown", (e) => {
    if (e.target !== document.body || !["ArrowLeft", "ArrowRight"].includes(e.key)) return;
    const at = order.indexOf(step.value) + (e.key === "ArrowLeft" ? -1 : 1);
    step.set(order[Math.min(Math.max(at, 0), order.length - 1)], "key");
  });
  const play = button("watch the error fall", () => {
    step.set(0, "play");
    for (let k = 1; k <= last; k++) setTimeout(() => step.set(k, "play"), 1300 * k);
  });
  host.append(group, told, play);
}

function residualControls(host, legend, all, scene, packed) {
  if (!scene.space.works) return;
  const out = element("output"), times = element("input", { type: "range", min: "0", max: "100", "aria-label": "how many times as large the residuals are drawn" });
  times.value = 50 + 25 * Math.log10(all.times / all.usual);
  const tell = () => { out.textContent = `${thousands(all.times)} times as large`; };
  times.addEventListener("input", () => {
    all.times = Number((all.usual * 10 ** ((times.value - 50) / 25)).toPrecision(1));
    address.set("times", all.times);
    scene.show(scene.step, false);
    tell();
  });
  tell();
  host.append(scene.buttons(), element("label", {}, "residual", times, out));
  const key = (name, text) => element("span", {}, element("i", { class: name }), text);
  legend.append(key("before", all.steps.length > 1 ? "residual as it came" : "residual"), ...(all.steps.length > 1 ? [key("after", "with what was found")] : []),
    element("span", {}, `From the predicted position along measured minus predicted; a click shows the arm there.${packed.drawn < packed.of ? ` ${thousands(packed.drawn)} of ${thousands(packed.of)} poses, the worst among them.` : ""}`));
}

/** Targets as the controller would get them; figures that are not those of the step before stand out. */
function sampleProgram(steps, k) {
  return steps[k].program.map((target, i) => {
    const before = k ? steps[k - 1].program[i].written : target.programmed, moved = Math.hypot(...target.written.map((x, c) => x - target.programmed[c]));
    const line = element("div", {}, `MoveL [[`);
    target.written.forEach((x, c) => line.append(c ? "," : "", element(Math.abs(x - before[c]) >= 0.0005 ? "mark" : "span", {}, x.toFixed(3))));
    line.append(`],..],v100,fine,tTool;`, element("span", { class: "quiet" }, `  ! ${target.name}, moved by ${moved.toFixed(3)} mm`));
    return line;
  });
}

function worstTable(packed, all) {
  const host = document.querySelector('[data-steps="worst"]'), found = data("document");
  if (!host || !found.worst) return;
  const key = Object.keys(found.worst[0] || {}).find((name) => name.startsWith("error_"));
  new Table(host, [{ title: "pose", value: (row) => row.pose_id }, ...(found.worst.some((row) => row.file) ? [{ title: "file", value: (row) => row.file }] : []),
    { title: "row", value: (row) => row.row, number: true }, { title: `off [${packed.unit}]`, value: (row) => row[key], shown: (row) => row[key].toFixed(3), number: true }],
    found.worst, { label: "worst poses", pick: (row) => { const i = packed.row.indexOf(row.row); if (all && i >= 0) all.chosen.set(i, "table"); } });
}

showSteps();
