"""The figures of a conversion for people: one table that terminal, header, page, certificate and batch show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from postproc.compensation.conversion import JudgedProgram
from postproc.compensation.judgement.figures import Place
from postproc.numbers import decimals_of, fixed, mm, on_arm_text, range_text
from postproc.report.blocks import DataTable, Values

Verdict = Literal["kept", "not_kept", "not_shown", "not_measured"]
"""Whether the tolerance is kept: on the arm, not even in the model, in the model alone; or nothing was measured."""
LABELS: Mapping[Place, str] = {
    "weld": "weld",
    "air": "air",
    "path": "lines and arcs",
    "speed_changes": "speed changes",
    "correction_jumps": "correction jumps",
}
"""Names of places in tables."""
CLAUSES: Mapping[Place, str] = {
    "weld": "while the arc burns",
    "air": "in the air",
    "path": "along lines and arcs",
    "speed_changes": "while the speed changes",
    "correction_jumps": "where the correction jumps",
}
"""The same in sentences."""
COLUMNS = ("deviation [mm]", "before", "after, in the model", "tolerance", "expected on the arm")


def figure_values(judged: JudgedProgram) -> list[Values]:
    """Return the entries of ``figures`` of the ``postproc/compensate/1`` document, the place that counts most first."""
    return [
        {
            "place": place.place,
            "before_mm": mm(place.before, 5),
            "after_mm": mm(place.after, 5),
            "tolerance_mm": None if place.tolerance is None else mm(place.tolerance, 5),
            "expected_on_arm_mm": judged.expected_mm(place),
            "line": place.line,
        }
        for place in judged.places
    ]


def verdict(values: Values) -> Verdict:
    """Return whether the tolerance is kept.

    In the model it is where each seam keeps it and is corrected whole, without welds where lines and arcs do; on the
    arm where also the model was fitted and the upper end of what is expected there is within it.

    Args:
        values: the document of a conversion with a plan, without its ``verdict``.
    """
    if not values["figures"]:
        return "not_measured"
    tolerance, seams = values["tolerance_mm"], values["welds"]
    within = [seam["kept"] and not seam["left"] for seam in seams] or [values["max_error_after_mm"] <= tolerance]
    if not all(within) or values["unproved_statements"]:
        return "not_kept"
    expected = values["expected_on_arm_mm"]
    known = values["expected_accuracy"] is not None and expected is not None and expected[1] <= tolerance
    return "kept" if known else "not_shown"


def decimals(values: Values) -> int:
    """Return the decimals of the lengths of a conversion, from its tolerance.

    Args:
        values: its document.
    """
    return decimals_of(values["tolerance_mm"])


def figure_rows(values: Values) -> list[tuple[str, ...]]:
    """Return the rows of the table of figures as texts: place, before, after in the model, tolerance, on the arm.

    Args:
        values: a document with ``figures`` and ``tolerance_mm``, or an entry of a batch.
    """
    digits = decimals(values)
    return [
        (
            LABELS[row["place"]],
            *(fixed(row[key], digits) for key in ("before_mm", "after_mm")),
            "" if row["tolerance_mm"] is None else f"{row['tolerance_mm']:g}",
            range_text(row["expected_on_arm_mm"], digits),
        )
        for row in values["figures"]
    ]


def figure_table(values: Values) -> DataTable:
    """Return the table of figures, for terminal and page.

    Args:
        values: as of ``figure_rows``.
    """
    return DataTable("figures", COLUMNS, figure_rows(values))


def main_figure(values: Values) -> Values | None:
    """Return the entry of ``figures`` that counts most: of welds, or else of lines and arcs; None without any.

    Args:
        values: a document with ``figures``.
    """
    figures: Sequence[Values] = values.get("figures") or ()
    return figures[0] if figures else None


def weld_notes(values: Values) -> list[Values]:
    """Return what is expected of each weld as notes at the statement where its arc starts, in the form of findings.

    Args:
        values: a document with ``welds`` and ``tolerance_mm``; without them there are no notes.
    """
    notes: list[Values] = []
    for weld in values.get("welds", ()):
        digits, where = decimals(values), f"lines {weld['line_from']} to {weld['line_to']}, {weld['length_mm']:g} mm"
        if weld["before_mm"] is None:
            expected = "no deviation could be computed"
        else:
            before, after = (fixed(weld[key], digits) for key in ("before_mm", "after_mm"))
            expected = f"{before} mm before, {after} mm after in the model (tolerance {values['tolerance_mm']:g} mm), "
            expected += f"expected on the arm: {on_arm_text(weld['expected_on_arm_mm'], digits)}"
        left = f"; {weld['left']} of its statements stay uncorrected" if weld["left"] else ""
        message = f"weld `{weld['name']}`, {where}: {expected}{left}"
        place = {"path": weld["path"], "line": weld["line_from"], "column": None}
        notes.append({"severity": "info", "code": None, "message": message, "help": None, **place})
    return notes
