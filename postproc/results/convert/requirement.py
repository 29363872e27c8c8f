"""What a required tolerance lacks: in the model of the arm, or as it is expected on the arm itself."""

from __future__ import annotations

from collections.abc import Mapping

from postproc.compensation.judgement.figures import CLAUSES
from postproc.diagnostics import joined
from postproc.numbers import above, on_arm_text
from postproc.report.blocks import Values
from postproc.results.convert.figures import decimals, is_guess, main_figure, severity

MET = {"model": ("kept", "not_shown"), "arm": ("kept",)}
"""Verdicts with which a requirement is met."""
LACKS = {"model": "not kept in the model", "arm": "not shown on the arm"}
MEASURE = "measure the arm (`postproc plan`, `postproc fit`) and name that model, or ask for less with `--tolerance`"
"""What may help where the tolerance is kept in the model alone."""
MEASURE_BEYOND = "measure poses there too (`postproc plan`), and fit again"
"""The same where a program leaves the measured range."""


def missed(require: str, programs: Mapping[str, Values]) -> str | None:
    """Return a clause on the worst program that does not meet a requirement, and on its worst weld; None where all do.

    A program in which nothing moves has no verdict, and meets any.

    Args:
        require: ``model`` or ``arm``. programs: documents of conversions, or their entries in that of a batch, by name.
    """
    lacking = {name: values for name, values in programs.items() if values.get("verdict", "kept") not in MET[require]}
    if not lacking:
        return None
    name = max(lacking, key=lambda name: severity(lacking[name]))
    count = f" in {len(lacking)} of {len(programs)} programs, the worst" if len(programs) > 1 else ""
    values = lacking[name]
    cure = MEASURE if values["verdict"] == "not_shown" else "CMP005 and CMP006 say of each statement what helps"
    why = ""
    if require == "arm" and values["verdict"] == "not_shown" and is_guess(values):
        beyond = joined(list(values["expected_accuracy"]["beyond_range"]))
        why, cure = f"of which what is expected is a guess ({beyond}); ", MEASURE_BEYOND
    return f"the tolerance is {LACKS[require]}{count}: `{name}`, {why}{_where(values, require)}. To meet it: {cure}"


def _over(place: Values | None, require: str) -> float:
    """Return the deviation [mm] of a weld or another place that is required; infinity where none is known."""
    if place is None or place["after_mm"] is None:
        return float("inf")
    on_arm = place["expected_on_arm_mm"] if require == "arm" else None
    return float(place["after_mm"] if on_arm is None else on_arm[1])


def _where(values: Values, require: str) -> str:
    """Return the weld that lacks most, or the line of the largest deviation, with the figures that say so.

    Args:
        values: the document of a conversion.
    """
    figure, digits = main_figure(values), decimals(values)
    welds = [weld for weld in values["welds"] if weld["left"] or not weld["kept"]]
    welds = welds or (list(values["welds"]) if require == "arm" else [])
    worst = max(welds, key=lambda weld: (_over(weld, require), weld["left"]), default=None)
    place = figure if worst is None else worst
    if figure is None or place is None:
        return "no line or arc could be measured"
    where = f"line {figure['line']}, {CLAUSES[figure['place']]}"
    if worst is not None:
        where = f"weld `{worst['name']}` in lines {worst['line_from']} to {worst['line_to']}"
        where += f", {worst['left']} of its statements left" if worst["left"] else ""
    if place["after_mm"] is None:
        return f"{where}, which could not be measured"
    sizes = f"{above(place['after_mm'], values['tolerance_mm'], digits)} mm in the model"
    if require == "arm":
        sizes = f"{on_arm_text(place['expected_on_arm_mm'], digits)} on the arm, {sizes}"
    text = f"{where}: {sizes}, tolerance {values['tolerance_mm']:g} mm"
    if values["unproved_statements"]:
        return f"{text}; {values['unproved_statements']} statements also run where what remains is not proved"
    if require == "arm" and _over(place, require) <= values["tolerance_mm"] and not is_guess(values):
        return f"{text}; the model was not fitted to measurements of this arm where the program goes"
    return text
