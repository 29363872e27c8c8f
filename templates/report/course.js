"use strict";
// Charts of values along a path, one below the other, drawn by uPlot: zoomed, pointed at and read together.

class Courses {
  /**
   * @param shared {axes: {name, unit, values}[], shaded: (i) => boolean, label(i), pick(i)}
   * @param charts {title, unit, height, decimals?, signed?, focus?, series: {name, values, color: name in the style sheet, dash?}[]}[]
   *   focus: (i) => boolean, the samples whose values fill the height; what is higher elsewhere stops at the edge
   */
  constructor(hosts, shared, charts) {
    Object.assign(this, { shared, charts, axis: 0, chosen: -1, range: null });
    this.n = shared.axes[0].values.length;
    this.rows = (values) => Array.from(values, (x) => (Number.isNaN(x) ? null : x));
    this.columns = charts.map((chart) => chart.series.map((s) => this.rows(s.values)));
    this.stretches = this.shadedStretches();
    this.key = uPlot.sync(charts[0].title).key;
    this.plots = charts.map((chart, k) => this.plot(hosts[Math.min(k, hosts.length - 1)], chart, k));
    new ResizeObserver(() => this.fit()).observe(hosts[0]);
    drawAgain(() => { this.fit(); for (const { u } of this.plots) u.redraw(false); });
  }

  get x() { return this.shared.axes[this.axis].values; }

  /** Buttons of the horizontal axis and of the zoom. */
  tools() {
    const names = this.shared.axes.map((axis) => `along the ${axis.name}`);
    return element("div", { class: "tools" },
      switchOf("horizontal axis", names, names[0], (name) => {
        const range = this.range && this.range.map((value) => this.sample(value));
        this.axis = names.indexOf(name);
        this.plots.forEach(({ u }, k) => u.setData([Array.from(this.x), ...this.columns[k]], false));
        if (range) this.show(...range); else this.all();
      }),
      element("span", { class: "buttons", role: "group", "aria-label": "zoom" },
        button("zoom in", () => this.zoomBy(0.5)), button("zoom out", () => this.zoomBy(2)), button("whole program", () => this.all())));
  }

  plot(host, chart, k) {
    const line = element("div", { class: "chosen" }), figure = element("figure", { class: "course", tabindex: "0", "aria-label": `${chart.title}. Left and right arrow keys go from place to place.` });
    const decimals = chart.decimals ?? decimalsOf(Math.max(...chart.series.map((s) => largest(s.values.map(Math.abs)))) / 20);
    const kept = () => [css("--faint"), css("--grid")], font = "12px system-ui, sans-serif";
    const axis = { font, stroke: () => kept()[0], grid: { stroke: () => kept()[1], width: 1 }, ticks: { show: false }, gap: 4 };
    const u = new uPlot({
      width: 400, height: chart.height || 130,
      padding: [6, 10, 0, 0],
      legend: { live: true, markers: { width: 0, fill: (_, s) => css(chart.series[s - 1].color) } },
      cursor: { sync: { key: this.key, setSeries: false }, drag: { x: true, y: false }, points: { size: 6 }, focus: { prox: 1e6 } },
      scales: { x: { time: false }, y: { range: (u) => this.height(u, chart) } },
      axes: [{ ...axis, size: 24, values: (_, at) => at.map((x, i) => (i === at.length - 1 ? `${figureText(x)} ${this.shared.axes[this.axis].unit}` : figureText(x))) },
        { ...axis, size: 52, space: 26, values: (_, at) => at.map(figureText) }],
      series: [{ label: "at", class: "at", value: (_, x) => (x === null ? "" : `${x.toFixed(2)} ${this.shared.axes[this.axis].unit}`) },
        ...chart.series.map((s) => ({ label: s.name, stroke: () => css(s.color), width: 1.5, dash: s.dash, points: { show: false }, value: (_, y) => (y === null || y === undefined ? "not known" : fixed(y, decimals)) }))],
      hooks: { drawClear: [(u) => this.shade(u)], setScale: [(u, name) => { if (name === "x") this.zoomed(u); }], draw: [() => this.mark()],
        setCursor: [(u) => { if (u.cursor.left < 0 && this.chosen >= 0) u.setLegend({ idx: this.chosen }, false); }] },
    }, [Array.from(this.x), ...this.columns[k]], figure);
    u.over.append(line);
    u.ctx.canvas.setAttribute("aria-label", chart.title);
    figure.prepend(element("figcaption", {}, element("b", {}, `${chart.title} [${chart.unit}]`), exports(chart.title,
      () => [[...this.shared.axes.map((a) => `${a.name} [${a.unit}]`), ...chart.series.map((s) => `${s.name} [${chart.unit}]`)], ...Array.from({ length: this.n }, (_, i) => [...this.shared.axes.map((a) => Number(a.values[i].toPrecision(7))), ...chart.series.map((s) => Number(s.values[i].toPrecision(6)))])],
      (name) => savePng(name, u.width, u.height + 20, uPlot.pxRatio, (pen) => {
        pen.drawImage(u.ctx.canvas, 0, 0, u.width, u.height);
        let x = 52;
        pen.font = font;
        for (const s of chart.series) {
          pen.fillStyle = css(s.color);
          pen.fillText(s.name, x, u.height + 12);
          x += pen.measureText(s.name).width + 16;
        }
      }))));
    let from = null;
    u.over.addEventListener("mousedown", (e) => { from = e.clientX; });
    u.over.addEventListener("mouseup", (e) => { if (from !== null && Math.abs(e.clientX - from) < 4 && u.cursor.idx !== null) this.shared.pick(u.cursor.idx); });
    figure.addEventListener("keydown", (e) => {
      const step = { ArrowLeft: -1, ArrowRight: 1, PageUp: -20, PageDown: 20 }[e.key];
      if (!step) return;
      e.preventDefault();
      this.shared.pick(Math.min(Math.max(this.chosen + step, 0), this.n - 1));
    });
    host.append(figure);
    return { u, line, figure };
  }

  fit() {
    for (const { u, figure } of this.plots) {
      const width = onPaper() ? PAPER : figure.clientWidth;
      if (width && width !== u.width) u.setSize({ width, height: u.height });
    }
  }

  /** Smallest and largest value of the samples that are seen, from zero where values have no sign. */
  height(u, chart) {
    const [from, to] = u.series[0].idxs;
    let [low, high] = chart.signed ? [Infinity, -Infinity] : [0, 0];
    const focused = chart.focus && this.stretches.some(([a, b]) => b >= from && a <= to);
    for (const { values } of chart.series)
      for (let i = from; i <= to; i++) {
        const y = values[i];
        if (focused && !chart.focus(i)) continue;
        if (y > high) high = y;
        if (chart.signed && y < low) low = y;
      }
    if (!(high > low)) return [0, 1];
    const spare = 0.08 * (high - low);
    return [chart.signed ? low - spare : 0, high + spare];
  }

  shade(u) {
    u.ctx.fillStyle = css("--weld");
    for (const [a, b] of this.stretches) {
      const [left, right] = [a, b].map((i) => u.valToPos(this.x[i], "x", true));
      const [from, to] = [Math.max(left, u.bbox.left), Math.min(Math.max(right, left + 1), u.bbox.left + u.bbox.width)];
      if (to > from) u.ctx.fillRect(from, u.bbox.top, to - from, u.bbox.height);
    }
  }

  shadedStretches() {
    const found = [];
    let begin = -1;
    for (let i = 0; i <= this.n; i++) {
      const is = i < this.n && this.shared.shaded(i);
      if (is && begin < 0) begin = i;
      if (!is && begin >= 0) { found.push([begin, i - 1]); begin = -1; }
    }
    return found;
  }

  /** The sample at a value of the axis. */
  sample(value) {
    let low = 0, high = this.n - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.x[middle] < value) low = middle + 1; else high = middle;
    }
    return low;
  }

  /** Let all charts show what one of them shows. */
  zoomed({ scales: { x: { min, max } } }) {
    if (this.passing || !this.plots) return;
    this.passing = true;
    this.range = [min, max];
    for (const { u } of this.plots) if (u.scales.x.min !== min || u.scales.x.max !== max) u.setScale("x", { min, max });
    this.passing = false;
  }

  /** Show the samples from one to another. */
  show(from, to) {
    const [min, max] = [this.x[Math.max(from, 0)], this.x[Math.min(Math.max(to, from + 1), this.n - 1)]];
    this.plots[0].u.setScale("x", { min, max: Math.max(max, min + 1e-6) });
  }

  all() { this.show(0, this.n - 1); }

  zoomBy(factor) {
    const { min, max } = this.plots[0].u.scales.x, at = this.chosen >= 0 && this.x[this.chosen] >= min && this.x[this.chosen] <= max ? this.x[this.chosen] : (min + max) / 2;
    const half = ((max - min) * factor) / 2, [low, high] = [this.x[0], this.x[this.n - 1]];
    this.plots[0].u.setScale("x", { min: Math.max(low, at - half), max: Math.min(high, at + half) });
  }

  /** Mark the place that is chosen and say its values. */
  choose(i) {
    this.chosen = i;
    const { min, max } = this.plots[0].u.scales.x;
    if (this.range && (this.x[i] < min || this.x[i] > max)) this.plots[0].u.setScale("x", { min: this.x[i] - (max - min) / 2, max: this.x[i] + (max - min) / 2 });
    for (const { u } of this.plots) u.setLegend({ idx: i }, false);
    this.mark();
  }

  mark() {
    for (const { u, line } of this.plots || []) {
      const at = this.chosen < 0 ? -1 : u.valToPos(this.x[this.chosen], "x");
      line.hidden = at < 0 || at > u.over.clientWidth;
      line.style.left = `${at}px`;
    }
  }
}

const figureText = (x) => String(Number(x.toPrecision(6)));
