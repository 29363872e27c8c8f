"use strict";
// What every part of a page uses: elements, columns of numbers, the address, saved files, and choices that are shared.

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

const button = (text, onclick, attributes = {}) => element("button", { type: "button", onclick, ...attributes }, text);

/** An entry of a legend, with the mark of a class. */
const entry = (name, text) => element("span", {}, element("i", { class: name }), text);

/** A slider of how many times as large as it is something is drawn, two decades to both sides of what is usual; draw(times) draws it. */
function magnifier(text, label, usual, draw, least = 0) {
  const out = element("output"), range = element("input", { type: "range", min: "0", max: "100", "aria-label": `how many times as large the ${label} drawn` });
  const show = (times) => { draw(times); out.textContent = times === 1 ? "as it is" : `${thousands(times)} times as large`; };
  const first = address.number("times") || usual;
  range.value = 50 + 25 * Math.log10(first / usual);
  range.addEventListener("input", () => {
    const times = Math.max(least, oneDigit(usual * 10 ** ((range.value - 50) / 25)));
    address.set("times", times);
    show(times);
  });
  show(first);
  return element("label", {}, text, range, out);
}

/** Buttons of which one is pressed; choose(name) is called with its name. */
function switchOf(label, names, pressed, choose) {
  const group = element("span", { class: "buttons", role: "group", "aria-label": label });
  const press = (name) => { for (const one of group.children) one.setAttribute("aria-pressed", one.textContent === name); };
  group.append(...names.map((name) => button(name, () => { press(name); choose(name); })));
  press(pressed);
  return group;
}

const data = (id) => JSON.parse(document.getElementById(id)?.textContent ?? "null");

/** Numbers of a column that Python packed: single precision, whole numbers, or two bytes between two limits. */
function numbers(column) {
  const text = atob(column.data), bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = text.charCodeAt(i);
  if (column.type === "f4") return new Float32Array(bytes.buffer);
  if (column.type === "i4") return new Int32Array(bytes.buffer);
  const steps = new Uint16Array(bytes.buffer), values = new Float32Array(steps.length);
  for (let i = 0; i < values.length; i++) values[i] = steps[i] ? column.low + steps[i] * column.step : NaN;
  return values;
}

/** Ends of the lines that lead to some places, each from the one before. */
function linesTo(places, rows) {
  const ends = new Float32Array(6 * rows.length);
  rows.forEach((i, k) => ends.set(places.subarray(3 * i - 3, 3 * i + 3), 6 * k));
  return ends;
}

const upTo = (n) => Array.from({ length: n }, (_, i) => i);
const lengths = (vectors) => Float32Array.from({ length: vectors.length / 3 }, (_, i) => Math.hypot(vectors[3 * i], vectors[3 * i + 1], vectors[3 * i + 2]));

const largest = (values) => values.reduce((most, value) => (value > most ? value : most), 0);
const thousands = (x) => x.toLocaleString("en");
const oneDigit = (x) => Number(x.toPrecision(1));
const short = (x) => String(Number(x.toPrecision(4)));
/** Decimals of figures that are judged by a tolerance or a noise: the last digit is a tenth of it. */
const decimalsOf = (scale) => (scale > 0 ? Math.min(Math.max(Math.ceil(1 - Math.log10(scale) - 1e-9), 0), 6) : 3);
const fixed = (x, decimals) => x.toFixed(decimals).replace(/^-(0\.?0*)$/, "$1");
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** A value that several parts of the page show and change: the place of the path, the step of a model. */
class Choice {
  constructor(value) { this.value = value; this.heard = []; }
  listen(hear) { this.heard.push(hear); }
  set(value, from) {
    if (value === this.value) return;
    this.value = value;
    for (const hear of this.heard) hear(value, from);
  }
}

/** What the page shows, as the part of its address behind #. */
const address = {
  values: new URLSearchParams(location.hash.slice(1)),
  number(name) { const text = this.values.get(name); return text === null || Number.isNaN(Number(text)) ? null : Number(text); },
  set(name, value) {
    this.values.set(name, value);
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.write(), 150);
  },
  write() { history.replaceState(null, "", `#${this.values}`.replaceAll("%2C", ",")); },
};

async function copyLink(event) {
  const pressed = event.currentTarget;
  address.write();
  try {
    await navigator.clipboard.writeText(location.href);
    pressed.textContent = "link copied";
  } catch {
    prompt("The address of what is shown:", location.href); // browsers without a clipboard for pages from a disk
  }
  setTimeout(() => { pressed.textContent = "copy link"; }, 2000);
}
document.querySelector("[data-copy-link]")?.addEventListener("click", copyLink);

/** Let the browser save a file. */
function save(name, blob) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/** Save rows of cells as a CSV file. */
function saveCsv(title, rows) {
  const cell = (x) => (x === null || Number.isNaN(x) ? "" : /[",\n]/.test(String(x)) ? `"${String(x).replaceAll('"', '""')}"` : String(x));
  save(`${fileName(title)}.csv`, new Blob([rows.map((row) => row.map(cell).join(",")).join("\n"), "\n"], { type: "text/csv" }));
}

/** Save a picture under its title on paper; draw(pen) draws so many pixels. */
function savePng(title, width, height, ratio, draw) {
  const canvas = element("canvas", { width: Math.round(width * ratio), height: Math.round((height + 24) * ratio) }), pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  pen.fillStyle = css("--paper");
  pen.fillRect(0, 0, width, height + 24);
  pen.fillStyle = css("--ink");
  pen.font = "600 12px system-ui, sans-serif";
  pen.fillText(title, 6, 16);
  pen.translate(0, 24);
  draw(pen);
  canvas.toBlob((blob) => save(`${fileName(title)}.png`, blob));
}

/** Buttons that save a chart. @param rows () => rows of cells; @param picture (title) => saves it */
function exports(title, rows, picture) {
  return element("span", { class: "exports" },
    button("CSV", () => saveCsv(title, rows()), { "aria-label": `save ${title} as CSV` }),
    button("PNG", () => picture(title), { "aria-label": `save ${title} as PNG` }));
}

/** Save a chart that Python drew: its columns, or its picture with the colours that it has on the page. */
document.addEventListener("click", ({ target }) => {
  const kind = target.dataset?.save, svg = kind && target.closest("figure").querySelector("svg");
  if (!svg) return;
  const title = svg.getAttribute("aria-label");
  if (kind === "csv") {
    const columns = Object.entries(JSON.parse(svg.dataset.columns)).map(([name, packed]) => [name, ...Array.from(numbers(packed), (x) => Number(x.toPrecision(6)))]);
    return saveCsv(title, Array.from({ length: Math.max(...columns.map((c) => c.length)) }, (_, i) => columns.map((c) => c[i] ?? null)));
  }
  const copy = svg.cloneNode(true), { width, height } = svg.viewBox.baseVal, parts = [copy, ...copy.querySelectorAll("*")];
  [svg, ...svg.querySelectorAll("*")].forEach((part, i) => {
    const style = getComputedStyle(part);
    for (const name of ["fill", "stroke", "stroke-width", "stroke-dasharray", "opacity", "fill-opacity", "stroke-opacity", "stroke-linecap", "font-weight"]) parts[i].style.setProperty(name, style.getPropertyValue(name));
  });
  const image = new Image();
  image.onload = () => savePng(title, width, height, 2, (pen) => pen.drawImage(image, 0, 0, width, height));
  image.src = `data:image/svg+xml,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
});

const fileName = (title) => title.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "");

/** Draw when the window has another size or other colours, and on paper. */
const drawn = [];
const drawAgain = (draw) => drawn.push(draw);
const drawAll = () => drawn.forEach((draw) => draw());
addEventListener("resize", drawAll);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);
addEventListener("beforeprint", () => { document.documentElement.classList.add("paper"); drawAll(); });
addEventListener("afterprint", () => { document.documentElement.classList.remove("paper"); drawAll(); });
const PAPER = 700; // pixels of the width of a sheet between its margins
const onPaper = () => document.documentElement.classList.contains("paper");

const announce = (text) => { document.getElementById("live").textContent = text; };
