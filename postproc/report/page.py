"""A document as one self-contained HTML page; ``templates/report`` has what draws it. Its values are carried inside."""

from __future__ import annotations

import json
import re
from functools import cache
from html import escape
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from postproc import __version__
from postproc.files import resource
from postproc.report.blocks import Bars, Block, Chart, DataTable, Document, View, is_number, plain
from postproc.report.drawing.charts import bars

SCRIPTS = {
    "": ("base", "table"),
    "steps": ("vendor/three.min", "space", "arm", "steps"),
    "path": ("vendor/three.min", "vendor/uplot.min", "space", "arm", "course", "path_scene", "path"),
    "programs": ("programs",),
    "differences": ("vendor/three.min", "space", "differences"),
}
"""Of every page, and of each scene."""
STYLES = {name: name for name in ("vendor/uplot.min", "course", "programs", "differences", "steps")}
"""Style sheets by the script that needs them."""
COLUMN = 90
"""Letters of a table's row that stand in half the width of a page."""


def render_page(document: Document) -> str:
    """Render a document as one HTML page with styles, scripts and data inside."""
    scene, of = document.scene, "" if document.scene is None else document.scene.name
    scripts = [name for each in dict.fromkeys(("", of)) for name in SCRIPTS[each]]
    styles = ["page", *(STYLES[name] for name in scripts if name in STYLES)]
    headline, *details = re.split(r"(?<=[.!?])\s+(?=[A-Z\d`])|\n", document.sentence)
    stage, bar = ("", "") if scene is None else (scene.stage, scene.controls)
    drawn = [(section, "".join(_html(block, of) for block in section.blocks)) for section in document.sections]
    places = [(section, Markup(html)) for section, html in drawn if html]
    # Beside a picture stand the first section and those that choose what it shows; the others take the whole width.
    beside = [p for k, p in enumerate(places) if stage and (k == 0 or any(map(_chooses, p[0].blocks)))]
    others = [p for p in places if p not in beside]
    folded = [p for p in others if p[0].folded]
    wide = [p for p in others if not p[0].folded and any(map(_is_wide, p[0].blocks))]
    page = render(
        "page.html.j2",
        title=document.title,
        headline=prose(headline),
        lost=document.tone == "error",
        figures=Markup("" if document.table is None else table(document.table)),
        more=prose(" ".join(details)),
        basis=prose(document.basis),
        key=[figure for figure in document.figures if figure.value is not None],
        stage=render(f"{of}.html.j2", view=stage) if stage else "",
        bar=render(f"{of}.html.j2", view=bar) if bar else "",
        beside=beside,
        narrow=[p for p in others if p not in folded and p not in wide],
        wide=[*wide, *folded],
        prose=prose,
        style=Markup("\n").join(asset(f"{name}.css") for name in styles),
        document=embedded(plain(document.values)),
        data={} if scene is None else {of: embedded(plain(scene.data()))},
        scripts=[asset(f"{name}.js") for name in scripts],
    )
    return str(page)


def render_certificate(document: Document) -> str:
    """Render a certificate as a page to print and sign; its first section says what was examined."""
    style, own = asset("page.css"), asset("certificate.css")
    return str(render("certificate.html.j2", document=document, style=style, own=own))


def render_sheet(document: Document) -> str:
    """Render a plan of first measurements as a sheet to print: a row of empty boxes for each, then drawings."""
    drawings = Markup(_html(document.sections[1].blocks[0], ""))
    return str(
        render("sheet.html.j2", document=document, drawings=drawings, style=asset("page.css"), version=__version__)
    )


def _chooses(block: Block) -> bool:
    """Tell whether a click in a block chooses what the picture of the page shows."""
    match block:
        case DataTable():
            return bool(block.view)
        case Bars():
            return bool(block.steps)
        case View():
            return block.chooses
    return False


def _is_wide(block: Block) -> bool:
    """Tell whether a block needs the width of a page: several charts side by side, or a table of more than a column."""
    match block:
        case DataTable():
            cells = ([block.columns[k], *(row[k] for row in block.rows)] for k in block.shown)
            return sum(max(len("" if c is None else str(c)) for c in column) + 3 for column in cells) > COLUMN
        case Chart():
            return block.least > 0
        case View():
            return True
    return False


def _html(block: Block, scene: str) -> str:
    """Render a block as HTML, empty where it has nothing to show.

    Args:
        scene: name of the page's scene and of its template, in which views are drawn.
    """
    match block:
        case str(text):
            return f"<p>{prose(text)}</p>"
        case DataTable() if not block.rows:
            return ""
        case DataTable(view=""):
            return table(block)
        case DataTable(view=name):
            return render(f"{scene}.html.j2", view=name, table=table_values(block))
        case View(name):
            return render(f"{scene}.html.j2", view=name)
        case Bars():
            return bars(block)
        case Chart(draw, least):
            charts = "".join(draw())  # side by side, as many in a row as fit with so many pixels each
            return f'<div class="grid" style="--least: {least}px">{charts}</div>' if least and charts else charts


def render(template: str, **values: Any) -> Markup:
    """Render a template of ``templates/report`` as HTML.

    Args:
        values: variables of the template, by name.
    """
    return Markup(_environment().get_template(template).render(**values))


def asset(name: str) -> Markup:
    """Return the text of a style sheet or script of ``templates/report``."""
    return Markup(resource("templates", "report", name).read_text("utf-8"))


def embedded(value: Any) -> Markup:
    """Encode plain values as JSON that is safe inside a script element."""
    # "</script" would end the element, "<!--<script" keep it from ending.
    return Markup(json.dumps(value, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"))


def prose(text: str) -> Markup:
    """Escape text as HTML, with `names` set as code."""
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text)))


def table(block: DataTable) -> str:
    """Render a table as HTML that scripts make searchable and sortable; columns of numbers are right-aligned."""
    return f'<div data-table><script type="application/json">{table_values(block)}</script></div>'


def table_values(block: DataTable) -> Markup:
    """Encode a table for the scripts of a page: columns with values, rows of cells, and the column that has links."""
    every = [[row[k] for row in block.rows] for k in range(len(block.columns))]
    numbers = [any(map(is_number, cells)) and all(c is None or is_number(c) for c in cells) for cells in every]
    decimals = [
        block.decimals_of(k) if any(isinstance(c, float) for c in every[k]) else None for k in range(len(every))
    ]
    shown, (column, links) = block.shown, block.links or (None, ())
    spec = {
        "label": block.label,
        "columns": [{"title": block.columns[k], "number": numbers[k], "decimals": decimals[k]} for k in shown],
        "rows": [[*(_cell(row[k]) for k in shown), *links[i : i + 1]] for i, row in enumerate(block.rows)],
        "link": None if column is None else shown.index(column),
    }
    return embedded(spec)


def _cell(cell: object) -> object:
    """Return a cell as None, a number, or text without backticks and without characters that are not Unicode."""
    # A file name that is not Unicode is shown as far as it is.
    return cell if cell is None or is_number(cell) else str(cell).replace("`", "").encode("utf-8", "replace").decode()


@cache
def _environment() -> Environment:
    """Return the Jinja environment of ``templates/report``, with escaping on."""
    return Environment(
        loader=FileSystemLoader(str(resource("templates", "report"))),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
