"use strict";
// What every part of the page uses: elements, columns of numbers, colours, and the place that is chosen.

function element(tag, attributes = {}, ...children) {
  const svg = ["svg", "g", "path", "line", "rect", "text", "circle"].includes(tag);
  const made = svg ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

function data(id) {
  const found = document.getElementById(id);
  return found ? JSON.parse(found.textContent) : null;
}

/** Numbers of a column that Python packed: single precision, whole numbers, or two bytes between two limits. */
function numbers(column) {
  const bytes = Uint8Array.from(atob(column.data), (c) => c.charCodeAt(0));
  if (column.type === "f4") return new Float32Array(bytes.buffer);
  if (column.type === "i4") return new Int32Array(bytes.buffer);
  return Float32Array.from(new Uint16Array(bytes.buffer), (x) => (x ? column.low + x * column.step : NaN));
}

/** One of several numbers that stand beside each other in every row. */
function component(values, width, k) {
  return Float32Array.from({ length: values.length / width }, (_, i) => values[i * width + k]);
}

function lengths(vectors) {
  return Float32Array.from({ length: vectors.length / 3 }, (_, i) =>
    Math.hypot(vectors[3 * i], vectors[3 * i + 1], vectors[3 * i + 2]));
}

function largest(values) {
  let most = 0;
  for (const value of values) if (value > most) most = value;
  return most;
}

const thousands = (x) => x.toLocaleString("en");
const mm = (x) => (Number.isFinite(x) ? `${x.toFixed(3)} mm` : "not known");
const short = (x) => String(Number(x.toPrecision(4)));
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

const STOPS = [[22, 138, 128], [222, 160, 20], [197, 34, 31]]; // small, middle, large: seen on white and on black
const SHADES = 24;

/** Colour of a size between 0 and 1. */
function shade(x) {
  const at = Math.min(Math.max(Number.isFinite(x) ? x : 0, 0), 1) * (STOPS.length - 1);
  const k = Math.min(Math.floor(at), STOPS.length - 2);
  const mixed = STOPS[k].map((c, i) => Math.round(c + (at - k) * (STOPS[k + 1][i] - c)));
  return `rgb(${mixed.join(",")})`;
}

function legend(most, unit, mark) {
  const ramp = Array.from({ length: 9 }, (_, i) => shade(i / 8)).join(",");
  const bar = element("span", { class: "ramp", style: `background: linear-gradient(90deg, ${ramp})` });
  if (mark && mark < most) bar.append(element("i", { style: `left: ${(100 * mark) / most}%`, title: `tolerance ${mark} ${unit}` }));
  return element("span", { class: "legend" }, `0`, bar, `${short(most)} ${unit}`);
}

/** Round numbers between two limits, about as many as asked for. */
function ticks(low, high, count) {
  const rough = (high - low) / Math.max(count, 1) || 1;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((f) => f * power >= rough * 0.999) * power;
  const found = [];
  for (let k = Math.ceil(low / step - 1e-6); k * step <= high + 1e-6 * step; k++) found.push(Number((k * step).toPrecision(10)));
  return found;
}

/** A value that several parts of the page show and change: the place of the path, the step of the loop. */
class Choice {
  constructor(value) { this.value = value; this.heard = []; }
  listen(hear) { this.heard.push(hear); }
  set(value, from) {
    if (value === this.value) return;
    this.value = value;
    for (const hear of this.heard) hear(value, from);
  }
}

/** Draw when the window has another size or other colours, and on paper. */
const drawn = [];
function drawAgain(draw) { drawn.push(draw); }
function drawAll() { for (const draw of drawn) draw(); }
let waiting = 0;
addEventListener("resize", () => { cancelAnimationFrame(waiting); waiting = requestAnimationFrame(drawAll); });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);
addEventListener("beforeprint", () => { document.documentElement.classList.add("paper"); drawAll(); });
addEventListener("afterprint", () => { document.documentElement.classList.remove("paper"); drawAll(); });
const PAPER = 700; // pixels of the width of a sheet between its margins
const onPaper = () => document.documentElement.classList.contains("paper");

function announce(text) {
  const live = document.getElementById("live");
  if (live) live.textContent = text;
}
