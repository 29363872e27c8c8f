"use strict";
// A row for each program: before and after in the model, what is expected on the arm, and the tolerance, on one axis.

const DECADES = 5; // at most, below the largest length

/** The axis of all rows: places of lengths in percent of its width, logarithmic, from a power of ten to another. */
class LengthAxis {
  constructor(lengths) {
    const known = lengths.filter((x) => x > 0), most = Math.max(...known, 1e-3);
    const high = Math.ceil(Math.log10(most) - 1e-9);
    this.low = Math.max(Math.floor(Math.log10(Math.min(...known, most))), high - DECADES);
    this.count = Math.max(high - this.low, 1);
  }

  at(length) { return (100 * Math.max(Math.log10(length) - this.low, 0)) / this.count; }

  get ticks() { return upTo(this.count + 1).map((k) => String(oneDigit(10 ** (this.low + k)))); }

  head() { return element("div", { class: "ticks", "aria-hidden": "true" }, ...this.ticks.map((tick, k) => element("span", { style: `left: ${(100 * k) / this.count}%` }, tick))); }

  row({ before, after, on_arm: onArm, tolerance, fitted }, text) {
    const mark = (kind, a, b = a) => element("i", { class: kind, style: `left: ${this.at(a)}%; ${b > a ? `width: ${this.at(b) - this.at(a)}%` : ""}` }), known = after !== null;
    return element("div", { class: "dumbbell", role: "img", "aria-label": text, title: text, style: `--decade: ${100 / this.count}%` },
      ...(onArm ? [mark(fitted ? "arm fitted" : "arm", ...onArm)] : []),
      ...(known && before !== null ? [mark("fall", Math.min(before, after), Math.max(before, after))] : []),
      ...(tolerance !== null ? [mark("tolerance", tolerance)] : []),
      ...(before !== null ? [mark("before", before)] : []),
      ...(known ? [mark(tolerance !== null && after > tolerance ? "after beyond" : "after", after)] : []));
  }
}

function showPrograms() {
  const host = document.querySelector('[data-programs="table"]');
  if (!host) return;
  const { drawn } = data("programs"), { columns, rows, label } = tableIn(host);
  const axis = new LengthAxis(drawn.filter(Boolean).flatMap((d) => [d.before, d.after, d.tolerance, ...(d.on_arm || [])]).filter((x) => x !== null));
  const of = new Map(rows.map((row, i) => [row, drawn[i]]));
  const words = (d) => {
    const figure = (...ends) => (ends.includes(null) ? "not known" : `${[...new Set(ends.map((x) => fixed(x, decimalsOf(d.tolerance))))].join(" to ")} mm`);
    return `before ${figure(d.before)}, after in the model ${figure(d.after)}, tolerance ${figure(d.tolerance)}, on the arm ${figure(...(d.on_arm || [null]))}`;
  };
  const chart = {
    title: "deviation [mm]", number: true, value: (row) => of.get(row) && Math.max(of.get(row).after ?? 0, ...(of.get(row).on_arm || [])),
    shown: (row) => (of.get(row) ? words(of.get(row)) : ""), mark: (row, text) => axis.row(of.get(row), text),
  };
  const some = drawn.some(Boolean), table = new Table(host, some ? [columns[0], chart, ...columns.slice(1)] : columns, rows, { label, kind: some ? "programs" : "" });
  if (!some) return;
  table.head.children[1].append(axis.head());
  document.querySelector(".dumbbells").append(element("span", {}, `axis from ${axis.ticks[0]} to ${axis.ticks.at(-1)} mm, logarithmic`));
}

showPrograms();
