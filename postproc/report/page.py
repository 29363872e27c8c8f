"""One self-contained HTML page: a sentence and a number first, then pictures, then tables, the document inside."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from postproc import __version__
from postproc.resources import resource

MOST_ROWS = 2000


@dataclass(frozen=True, slots=True)
class Section:
    """A heading, one sentence that says how to read what follows, and HTML."""

    title: str
    html: str
    note: str = ""


def render_page(
    title: str,
    sentence: str,
    sections: Sequence[Section],
    document: Mapping[str, Any],
    key: Mapping[str, object] | None = None,
) -> str:
    """The page as text.

    Args:
        document: the JSON document of the same result, plain values; the page carries it in ``<script id="document">``.
        key: figures that stand large under the sentence, lengths [mm] as floats; None is left out.
    """
    environment = Environment(
        loader=FileSystemLoader(str(resource("templates"))),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    # "</script" would end the element, "<!--<script" keep it from ending.
    embedded = json.dumps(document, allow_nan=False).replace("<", "\\u003c")
    shown = [Section(s.title, Markup(s.html), prose(s.note)) for s in sections]
    return environment.get_template("report.html.j2").render(
        title=title,
        sentence=prose(sentence),
        key={label: _figure(value) for label, value in (key or {}).items() if value is not None},
        sections=shown,
        document=Markup(embedded),
        plotly=Markup(_bundle()) if any('<div class="space">' in s.html for s in sections) else "",
    )


def prose(text: str) -> Markup:
    """Text as HTML, with `names` set apart."""
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text)))


def _figure(value: object) -> str:
    return f"{value:.3f} mm" if isinstance(value, float) else str(value)


def table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A table; numbers stand right, with four significant digits."""
    kinds = map(_kind, rows[0] if rows else columns)
    head = "".join(f'<th scope="col"{kind}>{escape(name)}</th>' for name, kind in zip(columns, kinds, strict=True))
    body = "".join("<tr>" + "".join(f"<td{_kind(cell)}>{_shown(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{head}</tr>{body}</table>"


def first_rows(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> tuple[str, str]:
    """A table of as many rows as can be read, and what it leaves out."""
    cut = f"The first {MOST_ROWS} of {len(rows)}; --json has all of them." if len(rows) > MOST_ROWS else ""
    return table(columns, rows[:MOST_ROWS]), cut


def made_section(made: Mapping[str, str]) -> Section:
    """With what a result was made, and by which version."""
    return Section("How this was made", table(("what", "with"), [*made.items(), ("postproc", __version__)]))


def grid(charts: Sequence[str], least: int) -> str:
    """Charts side by side, as many in a row as are at least ``least`` pixels wide."""
    return f'<div class="grid" style="--least: {least}px">{"".join(charts)}</div>'


def _kind(cell: object) -> str:
    return ' class="number"' if isinstance(cell, (int, float)) and not isinstance(cell, bool) else ""


def _shown(cell: object) -> str:
    if cell is None:
        return ""
    return f"{cell + 0.0:.4g}" if isinstance(cell, float) else prose(str(cell))


def _bundle() -> str:
    from plotly.offline import get_plotlyjs

    return get_plotlyjs()
