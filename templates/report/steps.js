"use strict";
// Watch the error fall: from the model as it came through each added effect, everything on the page changes together.

const FALL = 450; // milliseconds that the residuals take from one step to the next

class Residuals {
  constructor(packed) {
    Object.assign(this, { steps: packed.steps, label: packed.label, unit: packed.unit });
    this.p = numbers(packed.p);
    this.q = numbers(packed.q);
    this.n = packed.label.length;
    this.arm = new Arm(packed.arm);
    this.away = packed.steps.map((step) => numbers(step.away));
    this.size = this.away.map(lengths);
    this.now = Float32Array.from(this.away[this.away.length - 1]);
    const sorted = Float32Array.from(this.size[0]).sort();
    this.scale = sorted[Math.floor(0.98 * (this.n - 1))] || 1e-3; // the base decides, so that a fall is seen
    this.box = boxOf(this.p);
    const reach = Math.hypot(...this.box[0].map((x, i) => this.box[1][i] - x)) || 1;
    this.usual = (0.07 * reach * 1000) / this.scale;
    this.times = Number(this.usual.toPrecision(1));
    this.forces = packed.steps.map((step) => step.forces.map((one) => ({ ...one, wrench: numbers(one.wrench) })));
    this.strongest = Math.max(1e-9, ...this.forces.flat().map(({ wrench }) => largest(lengths(wrench.filter((_, k) => k % 6 < 3)))));
    this.chosen = new Choice(-1);
    this.step = packed.steps.length - 1;
    this.rows = Array.from({ length: this.n }, (_, i) => i);
  }
}

class ResidualScene {
  constructor(all) {
    this.all = all;
    this.box = all.box;
    this.label = "Residuals where they were measured, drawn larger than they are.";
  }

  draw(space, pen) {
    space.floor(pen);
    const { all } = this, at = space.projection(), k = all.times / 1000;
    if (all.chosen.value >= 0) this.arm(space, pen, all.arm.joints(all.q, all.chosen.value, all.chosen.value));
    const bins = Array.from({ length: SHADES }, () => []);
    for (let i = 0; i < all.n; i++) {
      const [x, y, z] = [all.p[3 * i], all.p[3 * i + 1], all.p[3 * i + 2]], d = all.now.subarray(3 * i, 3 * i + 3);
      const size = Math.hypot(...d);
      const bin = Math.min(SHADES - 1, Math.floor(SHADES * Math.min(size / all.scale, 1)) || 0);
      bins[bin].push(at(x, y, z), at(x + k * d[0], y + k * d[1], z + k * d[2]));
    }
    bins.forEach((ends, b) => {
      pen.strokeStyle = pen.fillStyle = shade(b / (SHADES - 1));
      pen.lineWidth = 1.4;
      pen.beginPath();
      for (let j = 0; j < ends.length; j += 2) arrow(pen, ends[j], ends[j + 1]);
      pen.stroke();
      for (let j = 0; j < ends.length; j += 2) pen.fillRect(ends[j][0] - 1.3, ends[j][1] - 1.3, 2.6, 2.6);
    });
    const i = all.chosen.value;
    if (i < 0) return;
    const [x, y] = at(all.p[3 * i], all.p[3 * i + 1], all.p[3 * i + 2]);
    pen.strokeStyle = css("--accent"); pen.lineWidth = 2.5;
    pen.beginPath(); pen.arc(x, y, 8, 0, 7); pen.stroke();
  }

  /** The arm, and the forces on its bodies along their lines of action, each where that is nearest to its body. */
  arm(space, pen, joints) {
    const { all } = this, at = space.projection(), i = all.chosen.value, named = new Set();
    joints[joints.length - 1] = [...all.p.subarray(3 * i, 3 * i + 3)]; // the tool as it was fitted
    all.arm.draw(space, pen, joints);
    for (const { name, body, wrench } of all.forces[all.step]) {
      const [fx, fy, fz, mx, my, mz] = wrench.subarray(6 * i, 6 * i + 6), f = [fx, fy, fz], o = joints[Math.min(body, 7)];
      const size = Math.hypot(...f);
      if (size < 1e-3 * all.strongest) continue;
      const m = cross(o, f).map((c, k) => [mx, my, mz][k] - c); // about the body
      const c = cross(f, m).map((x, k) => o[k] + x / size ** 2);
      const tip = c.map((x, k) => x + (0.45 * f[k]) / all.strongest);
      pen.strokeStyle = pen.fillStyle = css("--curve");
      pen.lineWidth = 3;
      pen.beginPath(); arrow(pen, at(...c), at(...tip)); pen.stroke();
      pen.beginPath(); pen.arc(...at(...c), 4, 0, 7); pen.fill();
      if (named.has(name)) continue; // a pull between two bodies is told once
      named.add(name);
      pen.font = "600 13px system-ui, sans-serif"; pen.textAlign = "left"; pen.textBaseline = "middle";
      const [x, y] = at(...c), text = `${name}: ${short(Math.round(size))} N`;
      pen.lineWidth = 4; pen.strokeStyle = css("--paper");
      pen.strokeText(text, x + 8, y - 12); pen.fillText(text, x + 8, y - 12);
    }
  }

  near(space, x, y) {
    const { all } = this, i = nearest(space, all.p, all.rows, x, y);
    if (i < 0) return null;
    const d = [...all.away[all.step].subarray(3 * i, 3 * i + 3)];
    return { text: `${all.label[i]}\n${mm(Math.hypot(...d))} off (${d.map((c) => c.toFixed(3)).join(", ")})`, pick: () => all.chosen.set(i, "space") };
  }

  armBox() {
    const joints = this.all.arm.joints(this.all.q, Math.max(this.all.chosen.value, 0), 0);
    return boxOf([...joints.flat(), ...this.box[0], ...this.box[1]]);
  }
}

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

function arrow(pen, from, to) {
  pen.moveTo(...from); pen.lineTo(...to);
  const dx = to[0] - from[0], dy = to[1] - from[1], size = Math.hypot(dx, dy);
  if (size < 5) return;
  const head = Math.min(0.35 * size, 6) / size;
  pen.moveTo(to[0] - head * (dx - 0.5 * dy), to[1] - head * (dy + 0.5 * dx));
  pen.lineTo(...to);
  pen.lineTo(to[0] - head * (dx + 0.5 * dy), to[1] - head * (dy - 0.5 * dx));
}

function showSteps() {
  const packed = data("steps");
  if (!packed) return;
  const place = (name) => document.querySelector(`[data-steps="${name}"]`), steps = packed.steps;
  const step = new Choice(steps.length - 1);
  let all = null, space = null;
  if (place("space") && steps[0].away) {
    all = new Residuals(packed);
    space = new Space(place("space"), new ResidualScene(all));
    residualControls(place("view"), all, space, packed);
    all.chosen.listen((i) => { space.later(); announce(all.label[i]); });
  }
  const charts = place("charts"), laws = place("laws"), program = place("program");
  const show = (k, from) => {
    if (charts) charts.innerHTML = steps[k].charts.join("") || "<p>No channel stands out.</p>";
    if (laws) laws.innerHTML = steps[k].laws.join("");
    if (program) program.replaceChildren(...sampleProgram(steps, k));
    if (all) fall(all, space, k, from !== "start");
    document.querySelectorAll(".bars [data-step]").forEach((bar) => bar.classList.toggle("here", Number(bar.dataset.step) === k));
    if (from !== "start") announce(`${steps[k].name}: ${steps[k].error.toFixed(3)} ${packed.unit}`);
  };
  step.listen(show);
  document.querySelectorAll(".bars [data-step]").forEach((bar) => bar.addEventListener("click", () => step.set(Number(bar.dataset.step), "bar")));
  if (steps.length > 1) stepControls(place("controls"), step, packed);
  show(step.value, "start");
  worstTable(packed, all);
}

/** Let the residuals go from where they are to those of a step. */
function fall(all, space, k, slowly) {
  all.step = k;
  const from = Float32Array.from(all.now), to = all.away[k], start = performance.now();
  if (!slowly || matchMedia("(prefers-reduced-motion: reduce)").matches) { all.now.set(to); space.later(); return; }
  const go = (now) => {
    if (all.step !== k) return;
    const part = Math.min((now - start) / FALL, 1), smooth = part * part * (3 - 2 * part);
    for (let i = 0; i < to.length; i++) all.now[i] = from[i] + smooth * (to[i] - from[i]);
    space.later();
    if (part < 1) requestAnimationFrame(go);
  };
  requestAnimationFrame(go);
}

function stepControls(host, step, { steps, unit }) {
  const last = steps.length - 1;
  const slider = element("input", { type: "range", min: "0", max: String(last), value: String(last), "aria-label": "step of the model" });
  const said = element("output", { class: "step" });
  const go = (by) => step.set(Math.min(Math.max(step.value + by, 0), last), "button");
  slider.addEventListener("input", () => step.set(Number(slider.value), "slider"));
  const tell = (k) => {
    slider.value = String(k);
    slider.setAttribute("aria-valuetext", steps[k].name);
    said.replaceChildren(element("b", {}, `${steps[k].error.toFixed(3)} ${unit}`), ` ${steps[k].name}`);
  };
  step.listen(tell);
  tell(step.value);
  addEventListener("keydown", (e) => {
    if (e.target !== document.body || !["ArrowLeft", "ArrowRight"].includes(e.key)) return;
    go(e.key === "ArrowLeft" ? -1 : 1);
  });
  const play = element("button", { type: "button" }, "watch the error fall");
  play.addEventListener("click", () => {
    step.set(0, "play");
    for (let k = 1; k <= last; k++) setTimeout(() => step.set(k, "play"), 1300 * k);
  });
  host.append(element("button", { type: "button", "aria-label": "step back", onclick: () => go(-1) }, "\u25C0"), slider,
    element("button", { type: "button", "aria-label": "step on", onclick: () => go(1) }, "\u25B6"), said, play);
}

function residualControls(host, all, space, packed) {
  const out = element("output"), times = element("input", { type: "range", min: "0", max: "100", value: "50", "aria-label": "how many times as large the residuals are drawn" });
  const set = () => {
    all.times = Number((all.usual * 10 ** ((times.value - 50) / 25)).toPrecision(1));
    out.textContent = `${thousands(all.times)} times as large`;
    space.later();
  };
  times.addEventListener("input", set);
  set();
  const part = packed.drawn < packed.of ? ` ${thousands(packed.drawn)} of ${thousands(packed.of)} poses, the worst among them.` : "";
  host.append(element("label", {}, element("span", {}, "residual"), times, out), lookButtons(space, { "all poses": all.box, "with the arm": () => space.scene.armBox() }),
    legend(all.scale, packed.unit), element("span", { class: "legend" }, part));
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
