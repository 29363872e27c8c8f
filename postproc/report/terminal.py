"""A document as text: the sentence, then tables and figures under their headings; pictures are left to pages."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from postproc.report.blocks import DIGITS, Bars, Block, DataTable, Document, Tone, is_number

Line = tuple[Tone, str]
"""What a line says, and its text."""

"""Significant digits of the largest number of a column."""


def render_text(document: Document, every: bool = False) -> str:
    """Render a document as text.

    Args:
        every: print all rows of all tables.
    """
    return "\n".join(text for _, text in render_lines(document, every))


def render_lines(document: Document, every: bool = False) -> Iterator[Line]:
    """Yield the lines of a document, each with what it says.

    Args:
        every: print all rows of all tables.
    """
    if document.table is not None:
        yield from _table(document.table, every)
        yield from (("", f"  {note}") for note in document.notes)
        if document.sentence:
            yield "", ""
    for i, text in enumerate(document.sentence.split("\n") if document.sentence else ()):
        yield "" if i else document.tone, text
    if document.table is None:
        words = document.sentence
        known = [figure for figure in document.figures if figure.value is not None]
        figures = [f"{f.label} {f.text}" for f in known if isinstance(f.value, int) or f.head not in words]
        for text in filter(None, (", ".join(figures), document.basis)):
            yield "", text
    for section in document.sections:
        inside: list[Line] = []
        for block in section.blocks:
            drawn = list(_lines(block, every))
            inside += [("", ""), *drawn] if inside and drawn and isinstance(block, DataTable) else drawn
        if inside:
            if section.title:
                yield "", ""
                yield "", f"{section.title}:"
            yield from inside


def _lines(block: Block, every: bool) -> Iterator[Line]:
    """Yield the lines of a block; charts and views have none.

    Args:
        every: print all rows of tables.
    """
    match block:
        case str(text):
            yield "", text
        case DataTable():
            yield from _table(block, every)
        case Bars():
            rows = [*((level.name, level.value, level.note) for level in block.bars), ("noise", block.floor, "")]
            width = max(len(name) for name, *_ in rows)
            for name, value, note in rows:
                shown = "unknown" if value is None else f"{value:.3f}"
                yield "", f"  {name:{width}}  {shown:>8}   {note}".rstrip()


def _table(block: DataTable, every: bool) -> Iterator[Line]:
    """Yield the lines of a table, and how many rows are left out.

    Args:
        every: print all rows, else those of ``brief`` alone.
    """
    chosen = range(len(block.rows)) if every or block.brief is None else block.brief
    if not chosen:
        return
    end = len(block.columns) if block.beneath is None else block.beneath
    cells = [_column(block, k, chosen) for k in block.shown if k < end]
    for i, row in enumerate(zip(*cells, strict=True)):
        if i or any(block.columns[:end]):
            yield block.tones[chosen[i - 1]] if i and block.tones else "", f"  {'  '.join(row)}".rstrip()
        for k in range(end, len(block.columns)) if i else ():
            if text := _text(block.rows[chosen[i - 1]][k], ""):
                yield "", f"{'':7}{block.columns[k]}{': ' * bool(block.columns[k])}{text}"
    if len(chosen) < len(block.rows):
        yield "", f"  {len(block.rows) - len(chosen)} more; `--verbose` shows them"


def _column(block: DataTable, k: int, chosen: Sequence[int]) -> list[str]:
    """Return heading and some cells of column k, of one width; numbers are right-aligned with common decimals.

    Args:
        chosen: indices of the rows that are printed.
    """
    cells = [row[k] for row in block.rows]
    right = all(c is None or is_number(c) for c in cells)
    number = f"z.{block.decimals_of(k)}f" if right else f".{DIGITS}g"
    texts = [block.columns[k], *(_text(cells[i], number) for i in chosen)]
    width = max(map(len, texts))
    return [text.rjust(width) if right else text.ljust(width) for text in texts]


def _text(cell: object, number: str) -> str:
    """Return a cell as text, floats by the format ``number``; None is empty."""
    if cell is None:
        return ""
    return f"{cell:{number}}" if isinstance(cell, float) else str(cell).replace("\n", " ")
