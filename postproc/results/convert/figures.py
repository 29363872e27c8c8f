"""The figures of a conversion as values and as one table, and whether they keep the tolerance."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.compensation.judgement.figures import COLUMNS, LABELS, shown_figures
from postproc.numbers import decimals_of, fixed, on_arm_text, range_text
from postproc.report.blocks import DataTable, Tone, Values


def decimals(values: Values) -> int:
    """Return the decimals of lengths in millimetres of a conversion, from its tolerance.

    Args:
        values: its document, or its entry in that of a batch.
    """
    return decimals_of(values.get("tolerance_mm", 0.0))


def main_figure(values: Values) -> Values | None:
    """Return the entry of ``figures`` that counts most: of welds, or else of lines and arcs; None without any.

    Args:
        values: a document with ``figures``, or an entry of that of a batch.
    """
    figures: Sequence[Values] = values.get("figures") or ()
    return figures[0] if figures else None


def is_guess(values: Values) -> bool:
    """Return whether what is expected on the arm is a guess: the program leaves the measured range of a fitted model.

    Args:
        values: a document of a conversion, or its entry in that of a batch.
    """
    known = values.get("expected_accuracy")
    return bool(known and known["beyond_range"])


def severity(values: Values) -> tuple[int, float]:
    """Return how bad a conversion is, larger for worse: by its verdict, then by the deviation over the tolerance.

    The deviation is the upper end of what is expected on the arm, else what remains in the model.

    Args:
        values: its document, or its entry in that of a batch; what has no figures is the least bad of its verdict.
    """
    figure, order = main_figure(values), ("kept", "not_measured", "not_shown", "not_kept")
    rank = order.index(values.get("verdict", "kept"))
    if figure is None:
        return rank, 0.0
    remaining = max(figure["expected_on_arm_mm"] or (figure["after_mm"],))
    return rank, float(remaining) / values["tolerance_mm"]


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
            expected += f"expected on the arm: {on_arm_text(weld['expected_on_arm_mm'], digits, is_guess(values))}"
        uncorrected = f"; {weld['left']} of its statements stay uncorrected" if weld["left"] else ""
        message = f"weld `{weld['name']}`, {where}: {expected}{uncorrected}"
        place = {"path": weld["path"], "line": weld["line_from"], "column": None}
        notes.append({"severity": "info", "code": None, "message": message, "help": None, **place})
    return notes


def figure_table(values: Values) -> DataTable:
    """Return the table of figures that tell something, for terminal and page; beyond their tolerance they are warnings.

    Args:
        values: the document of a conversion.
    """
    digits = decimals(values)
    rows: list[tuple[object, ...]] = []
    tones: list[Tone] = []
    for row in shown_figures(values["figures"]):
        before, after, tolerance = (row[f"{key}_mm"] for key in ("before", "after", "tolerance"))
        expected = range_text(row["expected_on_arm_mm"], digits, guess=is_guess(values))
        rows.append((LABELS[row["place"]], before, after, tolerance, expected))
        tones.append("warning" if tolerance is not None and after > tolerance else "")
    if drawn := values["from_programmed_path"]:
        rows.append(("from its numbers", drawn["before_mm"], drawn["after_mm"], None, ""))
        tones.append("")
    return DataTable("figures", COLUMNS, rows, decimals=digits, tones=tones)
