"use strict";
// A row for each program: before and after in the model, what is expected on the arm, and the tolerance, on one axis.

const DECADES = 5; // at most, below the largest length

/** The axis of all rows: places of lengths in percent of its width, logarithmic, from a power of ten to another. */
class LengthAxis {
  constructor(lengths) {
    const known = lengths.filter((x) => x > 0), most = Math.max(...known, 1e-3);
    this.high = Math.ceil(Math.log10(most) - 1e-9);
    this.low = Math.max(Math.floor(Math.log10(Math.min(...known, most))), this.high - DECADES);
    this.high = Math.max(this.high, this.low + 1);
  }

  at(length) { return (100 * (Math.log10(Math.max(length, 10 ** this.low)) - this.low)) / (this.high - this.low); }

  words() { return [this.low, this.high].map((power) => Number((10 ** power).toPrecision(1))).join(" to "); }

  head() {
    const ticks = Array.from({ length: this.high - this.low + 1 }, (_, k) => element("span", { style: `left: ${(100 * k) / (this.high - this.low)}%` }, String(Number((10 ** (this.low + k)).toPrecision(1)))));
    return element("div", { class: "ticks", "aria-hidden": "true" }, ...ticks);
  }

  row({ before, after, on_arm: onArm, tolerance, fitted }, text) {
    const made = element("div", { class: "dumbbell", role: "img", "aria-label": text, title: text, style: `--decade: ${100 / (this.high - this.low)}%` });
    const span = (kind, a, b) => made.append(element("i", { class: kind, style: `left: ${this.at(a)}%; width: ${this.at(b) - this.at(a)}%` }));
    const dot = (kind, x) => made.append(element("i", { class: kind, style: `left: ${this.at(x)}%` }));
    if (onArm) span(fitted ? "arm fitted" : "arm", ...onArm);
    if (before !== null && after !== null) span("fall", Math.min(before, after), Math.max(before, after));
    if (tolerance !== null) dot("tolerance", tolerance);
    if (before !== null) dot("before", before);
    if (after !== null) dot(tolerance !== null && after > tolerance ? "after beyond" : "after", after);
    return made;
  }
}

function showPrograms() {
  const host = document.querySelector('[data-programs="table"]');
  if (!host) return;
  const { drawn } = data("programs"), table = JSON.parse(host.querySelector("script").textContent);
  const rows = table.rows.map((cells, i) => ({ cells, drawn: drawn[i] }));
  const axis = new LengthAxis(drawn.filter(Boolean).flatMap((d) => [d.before, d.after, d.tolerance, ...(d.on_arm || [])]).filter((x) => x !== null));
  const figure = (x) => (x === null ? "not known" : `${short(x)} mm`);
  const words = (d) => `before ${figure(d.before)}, after in the model ${figure(d.after)}, tolerance ${figure(d.tolerance)}, on the arm ${d.on_arm ? d.on_arm.map(figure).join(" to ") : "not known"}`;
  const columns = table.columns.map((column, k) => ({ ...column, value: (row) => row.cells[k], href: k === table.link ? (row) => row.cells[table.columns.length] : null }));
  const chart = {
    title: "deviation [mm]", number: true, value: (row) => (row.drawn ? Math.max(row.drawn.after ?? 0, ...(row.drawn.on_arm || [])) : null),
    shown: (row) => (row.drawn ? words(row.drawn) : ""), mark: (row, text) => axis.row(row.drawn, text),
  };
  const made = new Table(host, [columns[0], ...(drawn.some(Boolean) ? [chart] : []), ...columns.slice(1)], rows, { label: table.label });
  made.table.classList.toggle("programs", drawn.some(Boolean));
  if (!drawn.some(Boolean)) return;
  made.head.children[1].append(axis.head());
  document.querySelector(".dumbbells").append(element("span", {}, `axis from ${axis.words()} mm, logarithmic`));
}

showPrograms();
