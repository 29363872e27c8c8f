"""A result for people and programs: its values, and the blocks in which a terminal and a page show them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from postproc.numbers import fixed

Tone = Literal["", "good", "info", "warning", "error"]
"""What a line says: nothing, a success, or a finding of that severity."""
DIGITS = 4
"""Of the largest number of a column whose decimals nobody states."""
Values = Mapping[str, Any]
"""What ``--json`` prints, or a part of it: plain values by key."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure that stands large on a page; a terminal leaves out what the sentence of the document says already.

    Args:
        value: floats are shown with ``decimals``, None is not. kind: ``before`` or ``after``, which have colours;
            ``beyond`` stands out where the document is an error.
    """

    label: str
    value: object
    kind: str = ""
    unit: str = "mm"
    decimals: int = 3

    @property
    def text(self) -> str:
        """The value as text, with the unit if it is a float."""
        return f"{self.head} {self.unit}" if isinstance(self.value, float) else self.head

    @property
    def head(self) -> str:
        """The value as text without its unit."""
        return fixed(self.value, self.decimals) if isinstance(self.value, float) else str(self.value)


@dataclass(frozen=True, slots=True)
class DataTable:
    """Rows of words and numbers, shown where there are any; a column without a value in any row is not.

    Args:
        label: what it holds. brief: indices of rows that a terminal prints where not all are asked for, None for all.
        links: a column, and for each row the address to which its cell leads on a page.
        view: name of a view of the scene in which a page draws the same rows; empty for a plain table.
        beneath: columns from here on stand on lines of their own below their row in a terminal.
        decimals: of the numbers, for all columns or for each; None for as many as the size of the largest number of a
            column allows.
        tones: what each row says, which is its colour in a terminal; empty for none.
    """

    label: str
    columns: Sequence[str]
    rows: Sequence[Sequence[object]]
    brief: Sequence[int] | None = None
    links: tuple[int, Sequence[str | None]] | None = None
    view: str = ""
    beneath: int | None = None
    decimals: int | Sequence[int | None] | None = None
    tones: Sequence[Tone] = ()

    def decimals_of(self, k: int) -> int:
        """Return the decimals of the floats of column k: as stated, else four digits of the largest of them."""
        stated = self.decimals if self.decimals is None or isinstance(self.decimals, int) else self.decimals[k]
        cells = (row[k] for row in self.rows)
        largest = max((abs(c) for c in cells if isinstance(c, float) and math.isfinite(c)), default=0.0) or 1.0
        return min(max(DIGITS - 1 - math.floor(math.log10(largest)), 0), DIGITS) if stated is None else stated

    @property
    def shown(self) -> list[int]:
        """Indices of columns in which some row has a value; of all columns for an empty table."""
        every = range(len(self.columns))
        return [k for k in every if any(row[k] is not None and row[k] != "" for row in self.rows) or not self.rows]


@dataclass(frozen=True, slots=True)
class Bar:
    """One of the figures that are compared with each other.

    Args:
        value: None where it is not known. note: text beside the bar.
    """

    name: str
    value: float | None
    note: str = ""


@dataclass(frozen=True, slots=True)
class Bars:
    """Figures of one kind, on a page as bars, in a terminal as lines.

    Args:
        floor: the noise, below which no bar can fall, None where it is not known.
        grey: name of a bar that is drawn in grey, as it is no step from the first bar to the noise.
        steps: names of bars at which a click shows their step in the scene of the page.
    """

    bars: Sequence[Bar]
    floor: float | None
    grey: str = ""
    unit: str = "mm"
    steps: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Chart:
    """Pictures on a page, as SVG.

    Args:
        draw: returns them; none where there is nothing to draw.
        least: width [pixels] that each of several side by side needs; 0 for pictures below each other.
    """

    draw: Callable[[], Sequence[str]]
    least: int = 0


@dataclass(frozen=True, slots=True)
class View:
    """A part of the scene that a page draws here.

    Args:
        name: that the template of the scene has for it. chooses: a click in it chooses what the others show.
    """

    name: str
    chooses: bool = False


Block = str | DataTable | Bars | Chart | View
"""A text is prose, with `names` set apart."""


@dataclass(frozen=True, slots=True)
class Section:
    """Blocks under a heading, if it has one; left out where none of them has anything to show.

    Args:
        note: how to read what a page shows. folded: a page opens it by a click.
    """

    title: str
    blocks: Sequence[Block]
    note: str = ""
    folded: bool = False


@dataclass(frozen=True, slots=True)
class Scene:
    """What scripts of a page draw from numbers, and redraw where the reader chooses another step or row.

    Args:
        name: of its template and of the element that carries the data. data: returns these plain values.
        controls: name of the view with the controls, which stays in sight; empty where there is none.
        stage: name of the view that stands beside the sections and stays in sight; empty where there is none.
    """

    name: str
    data: Callable[[], Values]
    controls: str = ""
    stage: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Document:
    """One result.

    Args:
        title: the command and what it was asked of. values: what ``--json`` prints (docs/documents.md).
        sentence: what the result is; further ones follow on lines of their own. tone: what it says.
        figures: at most a few that matter. basis: what the result rests on.
        table: of all figures, which a terminal shows above the sentence, in place of figures and basis.
        notes: what belongs to the table, on lines below it.
        scene: what scripts of its page draw; None for a page without.
    """

    title: str
    values: Values = field(repr=False)
    sentence: str
    tone: Tone = ""
    table: DataTable | None = None
    notes: Sequence[str] = ()
    figures: Sequence[Figure] = ()
    basis: str = ""
    sections: Sequence[Section] = ()
    scene: Scene | None = None


def is_number(cell: object) -> bool:
    """Tell whether a cell of a table holds a number; booleans are none."""
    return isinstance(cell, (int, float)) and not isinstance(cell, bool)


def plain(value: Any) -> Any:
    """Convert nested mappings, sequences and arrays to plain Python values; NaN and infinity become None."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):  # numpy arrays and scalars
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def attributes(value: object, *names: str) -> dict[str, Any]:
    """Return some attributes of a value by name, as an entry of a document or a part of one."""
    return {name: getattr(value, name) for name in names}
