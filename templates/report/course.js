"use strict";
// Charts of values along a path, drawn by uPlot: zoomed, pointed at and read together.

const FONT = "12px system-ui, sans-serif";
const figureText = (x) => String(Number(x.toPrecision(6)));

class Courses {
  /**
   * @param shared {axes: {name, unit, values}[], shaded: (i) => boolean, pick(i)}
   * @param charts {host, title, unit, height, decimals?, signed?, most?, series: {name, values, color: name in the style sheet, dash?}[]}[]
   *   most: value at the top, what is higher stops at the edge; without it the largest that is seen
   */
  constructor(shared, charts) {
    Object.assign(this, { shared, axis: shared.axes[0], chosen: -1, n: shared.axes[0].values.length });
    this.stretches = this.shadedStretches();
    this.columns = charts.map(({ series }) => series.map(({ values }) => Array.from(values, (x) => (Number.isNaN(x) ? null : x))));
    this.plots = charts.map((chart, k) => this.plot(chart, k));
    new ResizeObserver(() => this.fit()).observe(charts[0].host);
    drawAgain(() => { this.fit(); for (const { u } of this.plots) u.redraw(false); });
  }

  /** Buttons of the horizontal axis and of the zoom. */
  tools() {
    const { axes } = this.shared, names = axes.map((axis) => `along the ${axis.name}`);
    return element("div", { class: "tools" },
      switchOf("horizontal axis", names, names[0], (name) => {
        const range = this.range.map((value) => this.plots[0].u.valToIdx(value));
        this.axis = axes[names.indexOf(name)];
        this.plots.forEach(({ u }, k) => u.setData([Array.from(this.axis.values), ...this.columns[k]], false));
        this.show(...range);
      }),
      element("span", { class: "buttons", role: "group", "aria-label": "zoom" },
        button("zoom in", () => this.zoomBy(0.5)), button("zoom out", () => this.zoomBy(2)), button("whole program", () => this.show(0, this.n - 1))));
  }

  plot({ host, title, unit, height, decimals, signed, most, series }, k) {
    const marker = element("div", { class: "chosen" }), figure = element("figure", { class: "course", tabindex: "0", "aria-label": `${title}. Left and right arrow keys go from place to place.` });
    const digits = decimals ?? decimalsOf(Math.max(...series.map((s) => largest(s.values.map(Math.abs)))) / 20);
    const axis = { font: FONT, stroke: () => css("--faint"), grid: { stroke: () => css("--grid"), width: 1 }, ticks: { show: false }, gap: 4 };
    const u = new uPlot({
      width: 400, height, padding: [8, 10, 0, 0],
      legend: { markers: { width: 0, fill: (_, s) => css(series[s - 1].color) } },
      cursor: { sync: { key: "courses", setSeries: false }, drag: { x: true, y: false }, points: { size: 6 }, focus: { prox: 1e6 } },
      scales: { x: { time: false }, y: { range: (_, low, high) => this.height(signed, signed ? low : 0, most ?? high) } },
      axes: [{ ...axis, size: 24, values: (_, at) => at.map((x, i) => (i === at.length - 1 ? `${figureText(x)} ${this.axis.unit}` : figureText(x))) },
        { ...axis, size: 52, space: 26, values: (_, at) => at.map(figureText) }],
      series: [{ label: "at", class: "at", value: (_, x) => (x === null ? "" : `${x.toFixed(2)} ${this.axis.unit}`) },
        ...series.map((s) => ({ label: s.name, stroke: () => css(s.color), width: 1.5, dash: s.dash, points: { show: false }, value: (_, y) => (y === null || y === undefined ? "not known" : fixed(y, digits)) }))],
      hooks: { drawClear: [(u) => this.shade(u)], draw: [() => this.mark()], setCursor: [(u) => { if (u.cursor.left < 0 && this.chosen >= 0) u.setLegend({ idx: this.chosen }, false); }] },
    }, [Array.from(this.axis.values), ...this.columns[k]], figure);
    u.over.append(marker);
    u.ctx.canvas.setAttribute("aria-label", title);
    figure.prepend(element("figcaption", {}, element("b", {}, `${title} [${unit}]`), exports(title, () => this.rows(unit, series), (name) => savePng(name, u.width, u.height + 20, uPlot.pxRatio, (pen) => {
      pen.drawImage(u.ctx.canvas, 0, 0, u.width, u.height);
      let x = 52;
      pen.font = FONT;
      for (const s of series) {
        pen.fillStyle = css(s.color);
        pen.fillText(s.name, x, u.height + 12);
        x += pen.measureText(s.name).width + 16;
      }
    }))));
    u.over.addEventListener("click", () => { if (u.cursor.idx !== null) this.shared.pick(u.cursor.idx); });
    figure.addEventListener("keydown", (e) => {
      const step = { ArrowLeft: -1, ArrowRight: 1, PageUp: -20, PageDown: 20 }[e.key];
      if (!step) return;
      e.preventDefault();
      this.shared.pick(Math.min(Math.max(this.chosen + step, 0), this.n - 1));
    });
    host.append(figure);
    return { u, marker, figure };
  }

  /** Rows of a chart's values, for a table. */
  rows(unit, series) {
    const { axes } = this.shared, columns = [...axes.map((a) => [a, a.unit, 7]), ...series.map((s) => [s, unit, 6])];
    return [columns.map(([{ name }, of]) => `${name} [${of}]`), ...upTo(this.n).map((i) => columns.map(([{ values }, , digits]) => Number(values[i].toPrecision(digits))))];
  }

  fit() {
    for (const { u, figure } of this.plots) {
      const width = onPaper() ? PAPER : figure.clientWidth;
      if (width && width !== u.width) u.setSize({ width, height: u.height });
    }
  }

  /** Ends of the vertical axis, from zero where values have no sign. */
  height(signed, low, high) {
    if (!(high > low)) return [0, 1];
    const spare = 0.08 * (high - low);
    return [signed ? low - spare : 0, high + spare];
  }

  shade(u) {
    const { left, top, width, height } = u.bbox, at = (i) => Math.min(Math.max(u.valToPos(this.axis.values[i], "x", true), left), left + width);
    u.ctx.fillStyle = css("--weld");
    for (const [a, b] of this.stretches) if (at(b) > at(a)) u.ctx.fillRect(at(a), top, Math.max(at(b) - at(a), 1), height);
  }

  shadedStretches() {
    const { shaded } = this.shared, begins = upTo(this.n).filter((i) => shaded(i) && !(i && shaded(i - 1)));
    return begins.map((i) => { let last = i; while (last + 1 < this.n && shaded(last + 1)) last++; return [i, last]; });
  }

  get range() { const { min, max } = this.plots[0].u.scales.x; return [min, max]; }
  set range([min, max]) { for (const { u } of this.plots) u.setScale("x", { min, max }); }

  /** Show the samples from one to another. */
  show(from, to) {
    const { values } = this.axis, min = values[Math.max(from, 0)];
    this.range = [min, Math.max(values[Math.min(Math.max(to, from + 1), this.n - 1)], min + 1e-6)];
  }

  zoomBy(factor) {
    const [min, max] = this.range, { values } = this.axis, x = values[this.chosen], at = x >= min && x <= max ? x : (min + max) / 2, half = ((max - min) * factor) / 2;
    this.range = [Math.max(values[0], at - half), Math.min(values[this.n - 1], at + half)];
  }

  /** Mark the place that is chosen and say its values. */
  choose(i) {
    const [min, max] = this.range, x = this.axis.values[i], half = (max - min) / 2;
    this.chosen = i;
    if (x < min || x > max) this.range = [x - half, x + half];
    for (const { u } of this.plots) u.setLegend({ idx: i }, false);
    this.mark();
  }

  mark() {
    for (const { u, marker } of this.plots || []) {
      const at = this.chosen < 0 ? -1 : u.valToPos(this.axis.values[this.chosen], "x");
      marker.hidden = at < 0 || at > u.over.clientWidth;
      marker.style.left = `${at}px`;
    }
  }
}
