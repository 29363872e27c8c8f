"use strict";
// Tables with search and sort. Of long ones only the rows that are seen are in the document.

const ROW = 30; // pixels of a row of a long table
const LONG = 200; // rows from which on a table is long
const ON_PAPER = 300;
const WORD = /^\S{1,20}$/; // a short word stays in one piece: "changed", a routine

class Table {
  /**
   * @param columns {title, value(row), shown(row)?, mark(row, text)?, number?, href(row)?}[]
   * @param options {label, pick(row, index)?, kind?: class, height?: pixels of a row, bare?: without head and search}
   */
  constructor(host, columns, rows, options) {
    Object.assign(this, { host, columns, rows, options, sorted: null, words: null, picked: -1 });
    this.long = rows.length > LONG;
    this.high = options.height || ROW;
    this.build(options);
    this.arrange();
    drawAgain(() => this.draw(true));
  }

  build({ label, kind = "", bare = false }) {
    this.count = element("span", { class: "count", role: "status" });
    this.input = element("input", { type: "search", placeholder: "search", "aria-label": `search in ${label}`, oninput: () => this.arrange() });
    this.head = element("tr", {}, ...this.columns.map((column, k) =>
      element("th", { scope: "col", class: column.number ? "number" : null }, column.title && button(column.title, () => this.sortBy(k)))));
    this.body = element("tbody");
    this.table = element("table", { "aria-label": label, class: `${kind} ${this.long ? "long" : ""}` }, ...(bare ? [] : [element("thead", {}, this.head)]), this.body);
    this.box = element("div", { class: `rows ${kind}`, tabindex: "0", role: "region", "aria-label": label, onscroll: () => this.draw(), onkeydown: (e) => this.key(e) }, this.table);
    this.host.append(...(!bare && this.rows.length > 15 ? [element("div", { class: "tools" }, this.input, this.count)] : []), this.box);
  }

  sortBy(k) {
    this.sorted = [k, this.sorted?.[0] === k ? !this.sorted[1] : Boolean(this.columns[k].number)];
    this.arrange();
  }

  /** Put the rows that have all words of the search in the order of the column that sorts. */
  arrange() {
    const search = this.input.value.toLowerCase().split(/\s+/).filter(Boolean);
    this.words ||= search.length ? this.rows.map((row) => this.columns.map((c) => this.text(c, row)).join("\n").toLowerCase()) : null;
    this.order = upTo(this.rows.length).filter((i) => search.every((word) => this.words[i].includes(word)));
    const [k, down] = this.sorted || [];
    if (this.sorted) {
      const values = this.rows.map((row) => this.columns[k].value(row)), missing = (x) => x === null || x === undefined || x === "" || Number.isNaN(x);
      this.order.sort((i, j) => {
        const [a, b] = [values[i], values[j]];
        if (missing(a) || missing(b)) return missing(a) - missing(b) || i - j;
        const less = typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b));
        return (down ? -less : less) || i - j;
      });
    }
    [...this.head.children].forEach((th, i) => th.setAttribute("aria-sort", i !== k ? "none" : down ? "descending" : "ascending"));
    const all = thousands(this.rows.length);
    this.count.textContent = search.length ? `${thousands(this.order.length)} of ${all}` : `${all} rows`;
    this.table.setAttribute("aria-rowcount", this.order.length + 1);
    this.box.scrollTop = 0;
    this.draw(true);
  }

  text(column, row) {
    if (column.shown) return column.shown(row);
    const value = column.value(row);
    if (value === null || value === undefined || Number.isNaN(value)) return "";
    return typeof value === "number" && !Number.isInteger(value) ? short(value) : String(value);
  }

  draw(always = false) {
    const virtual = this.long && !onPaper(), seen = virtual ? Math.ceil((this.box.clientHeight || 420) / this.high) + 20 : onPaper() ? ON_PAPER : LONG;
    const first = virtual ? Math.max(0, Math.floor(this.box.scrollTop / this.high) - 10) : 0, last = Math.min(first + seen, this.order.length);
    if (!always && first === this.first) return;
    this.first = first;
    const focus = this.body.contains(document.activeElement), rows = upTo(last - first).map((k) => this.row(first + k));
    this.body.replaceChildren(...this.gap(first), ...rows, ...this.gap(this.order.length - last));
    if (focus) this.focused()?.focus({ preventScroll: true });
  }

  /** A row in place of some that are not in the document: as high as they are, or on paper the number of those below. */
  gap(count) {
    if (!count) return [];
    const style = onPaper() ? null : `height: ${count * this.high}px; padding: 0`;
    return [element("tr", { "aria-hidden": onPaper() ? null : "true" }, element("td", { colspan: this.columns.length, style }, onPaper() ? `${count} more rows are in the page, and in the document of --json.` : ""))];
  }

  row(k) {
    const index = this.order[k], row = this.rows[index];
    const pick = this.options.pick ? { tabindex: "-1", "aria-selected": index === this.picked, onclick: () => this.pick(k) } : {};
    return element("tr", { "aria-rowindex": k + 2, ...pick }, ...this.columns.map((column) => {
      const text = this.text(column, row), link = column.href?.(row), kind = column.number ? "number" : WORD.test(text) ? "word" : null;
      const shown = link ? element("a", { href: link }, text) : text && column.mark ? column.mark(row, text) : text;
      return element("td", { class: kind, "data-label": column.title, title: this.long && text.length > 20 ? text : null }, ...(text ? [shown] : []));
    }));
  }

  pick(k) {
    this.picked = this.order[k];
    this.options.pick(this.rows[this.picked], this.picked);
    for (const tr of this.body.querySelectorAll("[aria-selected]")) tr.setAttribute("aria-selected", this.order[tr.getAttribute("aria-rowindex") - 2] === this.picked);
  }

  /** Show a row that was chosen elsewhere. */
  show(index) {
    const k = this.order.indexOf(index);
    if (k < 0) return;
    this.picked = index;
    const top = this.long ? k * this.high : (this.body.children[k]?.offsetTop ?? 0);
    if (top < this.box.scrollTop || top > this.box.scrollTop + this.box.clientHeight - 2 * this.high)
      this.box.scrollTop = Math.max(0, top - this.box.clientHeight / 2);
    this.draw(true);
  }

  focused() { return this.body.querySelector('[aria-selected="true"]'); }

  key(event) {
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10, Home: -1e9, End: 1e9 }[event.key];
    if (!step || !this.options.pick || !this.order.length) return;
    event.preventDefault();
    const k = Math.min(Math.max(this.order.indexOf(this.picked) + step, 0), this.order.length - 1);
    this.show(this.order[k]);
    this.pick(k);
    this.focused()?.focus({ preventScroll: true });
  }
}

/** Rows of cells and columns of a table that stands in the page. @return {columns, rows, label} */
function tableIn(host) {
  const { columns, rows, label, link } = JSON.parse(host.querySelector("script").textContent);
  const column = (each, k) => ({
    ...each, value: (row) => row[k], shown: each.decimals === null ? null : (row) => (row[k] === null ? "" : fixed(row[k], each.decimals)),
    href: k === link ? (row) => row[columns.length] : null,
  });
  return { columns: columns.map(column), rows, label };
}

for (const host of document.querySelectorAll("[data-table]")) {
  const { columns, rows, label } = tableIn(host);
  new Table(host, columns, rows, { label });
}
