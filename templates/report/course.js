"use strict";
// Charts of values along a path, one below the other: zoomed, pointed at and read together.

const LEFT = 62, RIGHT = 14, BOTTOM = 24;

class Courses {
  /**
   * @param shared {axes: {name, unit, values}[], shaded: (i) => boolean, joined: (i) => boolean, label(i), pick(i)}
   * @param charts {title, unit, height, signed?, told?, weldsFill?, series: {name, values, color}[], limit?: values}[]
   *   weldsFill: the welds fill the height, what is higher elsewhere stops at the edge
   */
  constructor(host, shared, charts) {
    Object.assign(this, { host, shared, charts });
    this.axis = 0;
    this.cursor = -1;
    this.n = shared.axes[0].values.length;
    this.all();
    this.readout = element("p", { class: "readout", "aria-live": "off" });
    const axes = element("span", { class: "buttons", role: "group", "aria-label": "horizontal axis" }, ...shared.axes.map((axis, k) =>
      element("button", { type: "button", "aria-pressed": k === 0, onclick: (e) => {
        this.axis = k;
        for (const b of axes.children) b.setAttribute("aria-pressed", b === e.currentTarget);
        this.show(this.from, this.to);
      } }, `along the ${axis.name}`)));
    const zoom = element("span", { class: "buttons", role: "group", "aria-label": "zoom" },
      element("button", { type: "button", onclick: () => this.zoomBy(0.5) }, "zoom in"),
      element("button", { type: "button", onclick: () => this.zoomBy(2) }, "zoom out"),
      element("button", { type: "button", onclick: () => { this.all(); this.draw(); } }, "whole program"));
    host.append(element("div", { class: "tools" }, axes, zoom), this.readout);
    this.places = charts.map((chart) => this.place(chart));
    drawAgain(() => this.draw());
    this.draw();
  }

  all() { this.from = 0; this.to = this.n - 1; }

  /** Show the samples from one to another. */
  show(from, to) {
    this.from = Math.max(0, from);
    this.to = Math.min(this.n - 1, Math.max(to, from + 1));
    this.draw();
  }

  zoomBy(factor) {
    const at = this.cursor < this.from || this.cursor > this.to ? (this.from + this.to) / 2 : this.cursor;
    const half = Math.max(2, ((this.to - this.from) * factor) / 2);
    this.show(Math.round(at - half), Math.round(at + half));
  }

  place(chart) {
    const names = chart.series.map((s) => element("span", {}, element("i", { style: `background: ${s.color}` }), s.name));
    const box = element("figure", { class: "course" },
      element("figcaption", {}, element("b", {}, chart.title), ...(chart.series.length > 1 ? names : [])));
    const svg = element("svg", { tabindex: "0", role: "img", "aria-label": `${chart.title}. Left and right arrow keys go from place to place.` });
    box.append(svg);
    this.host.append(box);
    const inside = (e) => this.sample(this.value(e.clientX - svg.getBoundingClientRect().left));
    let begin = null;
    svg.addEventListener("pointerdown", (e) => { begin = e.clientX; svg.setPointerCapture(e.pointerId); });
    svg.addEventListener("pointermove", (e) => this.hover(inside(e)));
    svg.addEventListener("pointerleave", () => this.hover(-1));
    svg.addEventListener("pointerup", (e) => {
      const left = svg.getBoundingClientRect().left;
      if (begin !== null && Math.abs(e.clientX - begin) > 8) {
        const [a, b] = [begin, e.clientX].sort((x, y) => x - y).map((x) => this.sample(this.value(x - left)));
        this.show(a, b);
      } else this.shared.pick(inside(e));
      begin = null;
    });
    svg.addEventListener("dblclick", () => { this.all(); this.draw(); });
    svg.addEventListener("keydown", (e) => {
      const step = { ArrowLeft: -1, ArrowRight: 1, PageUp: -20, PageDown: 20 }[e.key];
      if (!step) return;
      e.preventDefault();
      this.shared.pick(Math.min(Math.max(this.cursor + step, 0), this.n - 1));
    });
    return { svg, chart };
  }

  get x() { return this.shared.axes[this.axis].values; }

  value(px) { return this.low + ((px - LEFT) / this.wide) * (this.high - this.low); }

  /** The sample at a value of the axis. */
  sample(value) {
    let low = this.from, high = this.to;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.x[middle] < value) low = middle + 1; else high = middle;
    }
    return low > this.from && value - this.x[low - 1] < this.x[low] - value ? low - 1 : low;
  }

  hover(i) {
    this.readout.textContent = i < 0 ? this.said || "" : this.reading(i);
    this.mark("hover", i);
  }

  reading(i) {
    const axes = this.shared.axes.map((axis) => `${axis.values[i].toFixed(2)} ${axis.unit}`).join(", ");
    const values = this.charts.filter((c) => c.told !== false).map((c) =>
      c.series.map((s) => `${s.name} ${Number.isFinite(s.values[i]) ? short(s.values[i]) : "-"}`).join(", ") + ` ${c.unit}`);
    return [this.shared.label(i), axes, ...values].join(" · ");
  }

  /** The place that is chosen. */
  choose(i) {
    this.cursor = i;
    if (i < this.from || i > this.to) { const half = (this.to - this.from) / 2; this.show(Math.round(i - half), Math.round(i + half)); }
    this.said = i < 0 ? "" : this.reading(i);
    this.readout.textContent = this.said;
    this.mark("chosen", i);
  }

  mark(name, i) {
    for (const { svg } of this.places) {
      svg.querySelector(`.${name}`)?.remove();
      if (i < this.from || i > this.to || i < 0) continue;
      const x = LEFT + ((this.x[i] - this.low) / (this.high - this.low)) * this.wide;
      svg.append(element("line", { class: name, x1: x, x2: x, y1: 4, y2: svg.clientHeight - BOTTOM }));
    }
  }

  draw() {
    this.low = this.x[this.from];
    this.high = Math.max(this.x[this.to], this.low + 1e-9);
    for (const { svg, chart } of this.places) this.one(svg, chart);
    this.mark("chosen", this.cursor);
  }

  one(svg, chart) {
    const height = chart.height || 150, width = onPaper() ? PAPER : Math.max(svg.parentNode.clientWidth, 240);
    this.wide = width - LEFT - RIGHT;
    svg.setAttribute("width", width);
    svg.setAttribute("height", height);
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const deep = height - BOTTOM - 6;
    const columns = chart.series.map((s) => this.envelope(s.values));
    const seen = chart.weldsFill && this.stretches(this.shared.shaded).length ? chart.series.map((s) => this.envelope(s.values, this.shared.shaded)) : columns;
    let [low, high] = [chart.signed ? Infinity : 0, chart.signed ? -Infinity : 0];
    for (const { least, most } of seen) {
      for (const y of most) if (y > high) high = y;
      for (const y of least) if (chart.signed && y < low) low = y;
    }
    if (chart.limit) high = Math.max(high, 1.25 * this.limitIn(chart.limit));
    if (!(high > low)) { low -= 0.5; high = low + 1; }
    const spare = 0.06 * (high - low);
    high += spare;
    if (chart.signed) low -= spare;
    const px = (x) => LEFT + ((x - this.low) / (this.high - this.low)) * this.wide;
    const py = (y) => 6 + ((high - y) / (high - low)) * deep;
    const parts = [element("rect", { x: LEFT, y: 6, width: this.wide, height: deep, class: "frame" })];
    for (const [a, b] of this.stretches(this.shared.shaded))
      parts.push(element("rect", { x: px(this.x[a]), width: Math.max(px(this.x[b]) - px(this.x[a]), 1), y: 6, height: deep, class: "weld" }));
    for (const y of ticks(low, high, deep / 32)) {
      parts.push(element("line", { x1: LEFT, x2: LEFT + this.wide, y1: py(y), y2: py(y), class: "tick" }));
      parts.push(element("text", { x: LEFT - 6, y: py(y) + 4, "text-anchor": "end" }, String(y)));
    }
    for (const x of ticks(this.low, this.high, this.wide / 90))
      parts.push(element("text", { x: px(x), y: height - 8, "text-anchor": "middle" }, String(x)));
    const { name, unit } = this.shared.axes[this.axis];
    parts.push(element("text", { x: 2, y: 16 }, chart.unit), element("text", { x: 2, y: height - 8 }, unit));
    svg.setAttribute("data-axis", name);
    if (chart.limit) parts.push(this.band(chart.limit, px, py, high, chart.signed ? low : 0));
    const inside = (y) => py(Math.min(Math.max(y, low), high));
    chart.series.forEach((s, k) => parts.push(element("path", { d: this.outline(columns[k], inside), stroke: s.color, class: "line" })));
    svg.replaceChildren(...parts);
  }

  /** Smallest and largest value in every pixel, NaN where there is none. */
  envelope(values, where = () => true) {
    const size = Math.max(Math.round(this.wide), 1), x = this.x;
    const least = new Float32Array(size).fill(NaN), most = new Float32Array(size).fill(NaN);
    const scale = (size - 1) / (this.high - this.low);
    for (let i = this.from; i <= this.to; i++) {
      const y = values[i];
      if (!Number.isFinite(y) || !where(i)) continue;
      const k = Math.round((x[i] - this.low) * scale);
      if (!(least[k] <= y)) least[k] = y;
      if (!(most[k] >= y)) most[k] = y;
      // A line between two samples far apart passes every pixel between them.
      const last = i > this.from && this.shared.joined(i) && Number.isFinite(values[i - 1]) ? Math.round((x[i - 1] - this.low) * scale) : k;
      for (let j = last + 1; j < k; j++) {
        const between = values[i - 1] + ((y - values[i - 1]) * (j - last)) / (k - last);
        if (!(least[j] <= between)) least[j] = between;
        if (!(most[j] >= between)) most[j] = between;
      }
    }
    return { least, most };
  }

  outline({ least, most }, py) {
    const steps = [];
    let gap = true;
    for (let k = 0; k < most.length; k++) {
      if (Number.isNaN(most[k])) { gap = true; continue; }
      const x = (LEFT + k).toFixed(0), top = py(most[k]).toFixed(1), low = py(least[k]).toFixed(1);
      steps.push(`${gap ? "M" : "L"}${x} ${top}${low !== top ? `L${x} ${low}` : ""}${gap && low === top ? "h0" : ""}`);
      gap = false;
    }
    return steps.join("");
  }

  limitIn(limit) {
    let most = 0;
    for (let i = this.from; i <= this.to; i++) if (limit[i] > most && this.shared.shaded(i)) most = limit[i];
    if (most) return most;
    for (let i = this.from; i <= this.to; i++) if (limit[i] > most) most = limit[i];
    return most;
  }

  /** The tolerance as a band from zero. */
  band(limit, px, py, high, low) {
    const steps = [];
    let last = -1;
    for (let i = this.from; i <= this.to; i++) {
      if (i > this.from && i < this.to && limit[i] === limit[i - 1] && limit[i] === limit[i + 1]) continue;
      const y = py(Math.min(limit[i], high)).toFixed(1);
      steps.push(`L${px(this.x[i]).toFixed(1)} ${y}`);
      last = i;
    }
    if (last < 0) return element("g");
    const begin = `M${LEFT} ${py(low).toFixed(1)}`, end = `L${LEFT + this.wide} ${py(low).toFixed(1)}Z`;
    return element("path", { d: begin + steps.join("") + end, class: "band" });
  }

  stretches(is) {
    const found = [];
    let begin = -1;
    for (let i = this.from; i <= this.to; i++) {
      if (is(i) && begin < 0) begin = i;
      if ((!is(i) || i === this.to) && begin >= 0) { found.push([begin, is(i) ? i : i - 1]); begin = -1; }
    }
    return found;
  }
}
