"""Two files of the same rows as one table: what the instrument saw, and the joint angles that were commanded."""

from __future__ import annotations

from dataclasses import replace

from postproc.diagnostics import Diagnostic, PostprocError
from postproc.measure.read.cells import Cells
from postproc.measure.read.columns import LABELS
from postproc.measure.read.values.numbers import as_number, is_number


def join(seen: Cells, beside: Cells, diagnostics: list[Diagnostic]) -> Cells:
    """Return the rows of ``seen`` with the columns of ``beside`` added; how they were joined is reported (DAT033).

    They are joined by a column of names (`pose_id`, `Point`, ..) that both have, where most names of the first stand in
    the second, once each; else row by row. A column that both have is taken from the first.

    Args:
        seen: what the instrument measured; beside: the commanded joint angles; diagnostics: gets the findings.

    Raises:
        PostprocError: DAT033 where neither names nor the number of rows agree.
    """
    places, how = _by_name(seen, beside)
    if places is None:
        if len(seen.rows) != len(beside.rows):
            message = f"`{beside.source.path}` has {len(beside.rows)} rows, `{seen.source.path}` has {len(seen.rows)}"
            message += ", and no column of names joins them"
            help_ = "name the rows of both in a column `pose_id`, or leave the same number of rows in both"
            raise PostprocError.of("DAT033", message, seen.source, help=help_)
        places, how = list(range(len(seen.rows))), "row by row"
    new = [k for k, name in enumerate(beside.header) if name not in seen.header]
    empty = tuple("" for _ in new)
    rows = []
    for row, at in zip(seen.rows, places, strict=True):
        other = empty if at is None else tuple(_as_in(beside.rows[at][k], beside.decimal, seen.decimal) for k in new)
        rows.append((*row, *other))
    message = f"`{beside.source.path}` is read beside `{seen.source.path}`, joined {how}"
    diagnostics.append(Diagnostic("DAT033", "info", message, seen.source))
    if missing := [i for i, at in enumerate(places) if at is None]:
        message = f"`{beside.source.path}` has no row for {len(missing)} of {len(places)} rows"
        help_ = "check the names of these rows; they are not used"
        diagnostics.append(Diagnostic("DAT033", "warning", message, seen.source, seen.span(missing[0]), help_))
    header = (*seen.header, *(beside.header[k] for k in new))
    return replace(seen, header=header, units=(*seen.units, *(beside.units[k] for k in new)), rows=tuple(rows))


def _by_name(seen: Cells, beside: Cells) -> tuple[list[int | None] | None, str]:
    """Return the row of ``beside`` for each row of ``seen``, None where it has none, and words for how it was found.

    The list is None, with an empty text, where no two columns of names match.
    """
    names = [[name for name in cells.header if name.lower().replace("_", " ") in LABELS] for cells in (seen, beside)]
    for mine in names[0]:
        for theirs in names[1]:
            known = {name: i for i, name in enumerate(beside.text(theirs))}
            places = [known.get(name) for name in seen.text(mine)]
            unique = len(known) == len(beside.rows)
            if unique and 2 * sum(at is not None for at in places) > len(places):
                both = f"`{mine}`" if mine == theirs else f"`{mine}` and `{theirs}`"
                return places, f"by the names in {both}"
    return None, ""


def _as_in(cell: str, decimal: str, wanted: str) -> str:
    """Return a cell with the decimal sign of another table.

    Args:
        decimal: its own sign; wanted: the other's.
    """
    if decimal == wanted or not is_number(cell, decimal):
        return cell
    return as_number(cell, decimal).replace(".", wanted)
