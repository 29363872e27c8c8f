"""One self-contained HTML page: a sentence and a number first, then pictures, then tables, the document inside."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from html import escape
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from postproc import __version__
from postproc.resources import resource

SCRIPTS = ("base", "table")  # of every page


@dataclass(frozen=True, slots=True)
class Section:
    """A heading, one sentence that says how to read what follows, and HTML; folded sections are opened by a click."""

    title: str
    html: str
    note: str = ""
    folded: bool = False


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure that stands large under the sentence; kind: ``before`` or ``after``, which have colours."""

    label: str
    text: str
    kind: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """One page.

    Args:
        sentence: what the result is; figures: at most a few that matter; assumed: what the result rests on.
        document: the JSON document of the same result, plain values, carried in ``<script id="document">``.
        bar: HTML that stays in sight, with what changes the page.
        data: further plain values by the id of the element that carries them; scripts: that draw them.
    """

    title: str
    sentence: str
    sections: Sequence[Section]
    document: Mapping[str, Any]
    figures: Sequence[Figure] = ()
    assumed: str = ""
    bar: str = ""
    data: Mapping[str, Any] = field(default_factory=dict)
    scripts: Sequence[str] = ()


def render_page(content: Page) -> str:
    """The page as text."""
    page = render(
        "page.html.j2",
        title=content.title,
        sentence=prose(content.sentence),
        key=content.figures,
        assumed=prose(content.assumed),
        bar=Markup(content.bar),
        sections=[Section(s.title, Markup(s.html), prose(s.note), s.folded) for s in content.sections],
        style=asset("page.css"),
        document=embedded(content.document),
        data={name: embedded(value) for name, value in content.data.items()},
        script=Markup("\n").join(asset(f"{name}.js") for name in (*SCRIPTS, *content.scripts)),
    )
    return str(page)


def render(template: str, **values: Any) -> Markup:
    """A template of ``templates/report`` as HTML."""
    return Markup(_environment().get_template(template).render(**values))


def asset(name: str) -> Markup:
    """A style sheet or script as it is, without the lines that only comment."""
    return Markup(resource("templates", "report", name).read_text("utf-8"))


def embedded(value: Any) -> Markup:
    """Plain values as JSON inside a script element."""
    # "</script" would end the element, "<!--<script" keep it from ending.
    return Markup(json.dumps(value, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"))


def prose(text: str) -> Markup:
    """Text as HTML, with `names` set apart."""
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text)))


def figure(label: str, value: object, kind: str = "", unit: str = "mm") -> list[Figure]:
    """A figure that stands large, none where nothing is known; floats are lengths [mm] unless another unit is said."""
    if value is None:
        return []
    return [Figure(label, f"{value:.3f} {unit}" if isinstance(value, float) else str(value), kind)]


def table(
    label: str,
    columns: Sequence[str],
    rows: Sequence[Sequence[object]],
    links: tuple[int, Sequence[str | None]] | None = None,
) -> str:
    """A table that can be searched and sorted; columns of numbers stand right, with four significant digits.

    A column without a value in any row is left out.

    Args:
        label: what it holds, for people who hear the page.
        links: a column, and for each row where its cell leads to.
    """
    every = [[row[k] for row in rows] for k in range(len(columns))]
    numbers = [any(map(_is_number, cells)) and all(c is None or _is_number(c) for c in cells) for cells in every]
    shown = [k for k, cells in enumerate(every) if any(c is not None and c != "" for c in cells) or not rows]
    spec = {
        "label": label,
        "columns": [{"title": columns[k], "number": numbers[k]} for k in shown],
        "rows": [[*(_cell(row[k]) for k in shown), *([links[1][i]] if links else [])] for i, row in enumerate(rows)],
        "link": shown.index(links[0]) if links else None,
    }
    return f'<div data-table><script type="application/json">{embedded(spec)}</script></div>'


def made_section(made: Mapping[str, str]) -> Section:
    """With what a result was made, and by which version."""
    rows = [*made.items(), ("postproc", __version__)]
    return Section("How this was made", table("how this was made", ("what", "with"), rows), folded=True)


def grid(charts: Sequence[str], least: int) -> str:
    """Charts side by side, as many in a row as are at least ``least`` pixels wide."""
    return f'<div class="grid" style="--least: {least}px">{"".join(charts)}</div>'


def _is_number(cell: object) -> bool:
    return isinstance(cell, (int, float)) and not isinstance(cell, bool)


def _cell(cell: object) -> object:
    # A file name that is not Unicode is shown as far as it is.
    return cell if cell is None or _is_number(cell) else str(cell).replace("`", "").encode("utf-8", "replace").decode()


@cache
def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(str(resource("templates", "report"))),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
