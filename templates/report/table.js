"use strict";
// Tables with search and sort. Of long ones only the rows that are seen are in the document.

const ROW = 30; // pixels of a row of a long table
const LONG = 200; // rows from which on a table is long
const ON_PAPER = 300;
const WORD = /^\S{1,20}$/; // a short word stays in one piece: "changed", a routine

class Table {
  /**
   * @param columns {title, value(row), shown(row)?, number?, href(row)?}[]
   * @param options {label, search?, pick(row, index)?, rowClass(row)?, sort?: [column, descending]}
   */
  constructor(host, columns, rows, options) {
    Object.assign(this, { host, columns, rows, options });
    this.order = rows.map((_, i) => i);
    this.sorted = options.sort || null;
    this.words = null;
    this.picked = -1;
    this.first = -1;
    this.long = rows.length > LONG;
    this.build();
    this.arrange();
    drawAgain(() => this.draw(true));
  }

  build() {
    const { label } = this.options;
    this.count = element("span", { class: "count", role: "status" });
    this.input = element("input", {
      type: "search", placeholder: "search", "aria-label": `search in ${label}`, oninput: () => this.arrange(),
    });
    this.head = element("tr");
    this.columns.forEach((column, k) => {
      const button = element("button", { type: "button", onclick: () => this.sortBy(k) }, column.title);
      this.head.append(element("th", { scope: "col", class: column.number ? "number" : null }, button));
    });
    this.body = element("tbody");
    this.table = element("table", { "aria-label": label, class: this.long ? "long" : null },
      element("thead", {}, this.head), this.body);
    this.box = element("div", { class: "rows", tabindex: "0", role: "region", "aria-label": label, onscroll: () => this.draw() }, this.table);
    this.box.addEventListener("keydown", (event) => this.key(event));
    if (this.options.search !== false && this.rows.length > 15)
      this.host.append(element("div", { class: "tools" }, this.input, this.count));
    this.host.append(this.box);
  }

  sortBy(k) {
    const down = this.sorted && this.sorted[0] === k ? !this.sorted[1] : Boolean(this.columns[k].number);
    this.sorted = [k, down];
    this.arrange();
  }

  /** Rows that are asked for, in the order that is asked for. */
  arrange() {
    const asked = this.input.value.toLowerCase().split(/\s+/).filter(Boolean);
    this.words ||= asked.length ? this.rows.map((row) => this.columns.map((c) => this.text(c, row)).join("\n").toLowerCase()) : null;
    this.order = this.rows.map((_, i) => i).filter((i) => asked.every((word) => this.words[i].includes(word)));
    if (this.sorted) {
      const [k, down] = this.sorted, value = this.columns[k].value;
      const missing = (x) => x === null || x === undefined || x === "" || Number.isNaN(x);
      this.order.sort((i, j) => {
        const a = value(this.rows[i]), b = value(this.rows[j]);
        if (missing(a) || missing(b)) return missing(a) - missing(b) || i - j;
        const less = typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b));
        return (down ? -less : less) || i - j;
      });
    }
    [...this.head.children].forEach((th, k) => {
      const mine = this.sorted && this.sorted[0] === k;
      th.setAttribute("aria-sort", mine ? (this.sorted[1] ? "descending" : "ascending") : "none");
    });
    const of = this.rows.length.toLocaleString("en");
    this.count.textContent = asked.length ? `${this.order.length.toLocaleString("en")} of ${of}` : `${of} rows`;
    this.table.setAttribute("aria-rowcount", this.order.length + 1);
    this.box.scrollTop = 0;
    this.draw(true);
  }

  text(column, row) {
    if (column.shown) return column.shown(row);
    const value = column.value(row);
    if (value === null || value === undefined || Number.isNaN(value)) return "";
    return typeof value === "number" ? (Number.isInteger(value) ? String(value) : short(value)) : String(value);
  }

  draw(always = false) {
    const seen = this.long && !onPaper() ? Math.ceil((this.box.clientHeight || 420) / ROW) + 20 : onPaper() ? ON_PAPER : LONG;
    const first = this.long && !onPaper() ? Math.max(0, Math.floor(this.box.scrollTop / ROW) - 10) : 0;
    if (!always && first === this.first) return;
    this.first = first;
    const focus = this.body.contains(document.activeElement);
    const last = Math.min(first + seen, this.order.length);
    const made = [this.gap(first * ROW)];
    for (let k = first; k < last; k++) made.push(this.row(k));
    made.push(onPaper() && last < this.order.length ? this.rest(last) : this.gap((this.order.length - last) * ROW));
    this.body.replaceChildren(...made.filter(Boolean));
    if (focus) this.focused()?.focus({ preventScroll: true });
  }

  gap(height) {
    if (!(height > 0) || !this.long) return null;
    return element("tr", { "aria-hidden": "true" }, element("td", { colspan: this.columns.length, style: `height: ${height}px; padding: 0` }));
  }

  rest(last) {
    return element("tr", {}, element("td", { colspan: this.columns.length }, `${this.order.length - last} more rows are in the page, and in the document of --json.`));
  }

  row(k) {
    const index = this.order[k], row = this.rows[index], { pick, rowClass } = this.options;
    const made = element("tr", { "aria-rowindex": k + 2, class: rowClass ? rowClass(row) : null });
    if (pick) {
      made.setAttribute("tabindex", "-1");
      made.setAttribute("aria-selected", index === this.picked);
      made.addEventListener("click", () => this.pick(k));
    }
    for (const column of this.columns) {
      const text = this.text(column, row), link = column.href && column.href(row);
      const cell = element("td", { class: column.number ? "number" : WORD.test(text) ? "word" : null, "data-label": column.title, title: this.long && text.length > 20 ? text : null });
      if (text) cell.append(link ? element("a", { href: link }, text) : column.mark ? column.mark(row, text) : text);
      made.append(cell);
    }
    return made;
  }

  pick(k, quiet = false) {
    this.picked = this.order[k];
    if (!quiet) this.options.pick?.(this.rows[this.picked], this.picked);
    for (const tr of this.body.children)
      if (tr.hasAttribute("aria-selected")) tr.setAttribute("aria-selected", this.order[tr.getAttribute("aria-rowindex") - 2] === this.picked);
  }

  /** Show a row that was chosen elsewhere. */
  show(index) {
    const k = this.order.indexOf(index);
    if (k < 0) return;
    this.picked = index;
    const top = this.long ? k * ROW : (this.body.children[k]?.offsetTop ?? 0);
    if (top < this.box.scrollTop || top > this.box.scrollTop + this.box.clientHeight - 2 * ROW)
      this.box.scrollTop = Math.max(0, top - this.box.clientHeight / 2);
    this.draw(true);
  }

  focused() {
    return [...this.body.children].find((tr) => tr.getAttribute("aria-selected") === "true");
  }

  key(event) {
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10, Home: -1e9, End: 1e9 }[event.key];
    if (!step || !this.options.pick || !this.order.length) return;
    event.preventDefault();
    const at = this.order.indexOf(this.picked);
    const k = Math.min(Math.max(at + step, 0), this.order.length - 1);
    this.show(this.order[k]);
    this.pick(k);
    this.focused()?.focus({ preventScroll: true });
  }
}

/** Tables whose rows stand in the page: {columns: {title, number}[], rows: cell[][], label, sort, links: column}. */
for (const host of document.querySelectorAll("[data-table]")) {
  const spec = JSON.parse(host.querySelector("script").textContent);
  const columns = spec.columns.map((column, k) => ({
    ...column,
    value: (row) => row[k],
    shown: column.number && column.decimals !== null ? (row) => (row[k] === null ? "" : fixed(row[k], column.decimals)) : null,
    href: k === spec.link ? (row) => row[spec.columns.length] : null,
  }));
  new Table(host, columns, spec.rows, { label: spec.label, sort: spec.sort });
}
