"""Whether a corrected program keeps its tolerance, and the sentence on it with which all that is written begins."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from postproc.compensation.conversion import JudgedProgram
from postproc.compensation.judgement.figures import CLAUSES
from postproc.compensation.text.values import StatementOutcome, Status
from postproc.numbers import above, decimals_of, mm, on_arm_text

Verdict = Literal["kept", "not_kept", "not_shown", "not_measured"]
"""Whether the tolerance is kept: on the arm, not even in the model, in the model alone; or nothing was measured."""
Tone = Literal["good", "warning", "error"]
TONES: dict[Verdict, Tone] = {
    "kept": "good",
    "not_shown": "warning",
    "not_kept": "error",
    "not_measured": "warning",
}
CORRECTED: tuple[Status, ...] = ("compensated", "run_time")
"""Status of statements that are corrected."""


def verdict(values: Mapping[str, Any]) -> Verdict:
    """Return whether the tolerance is kept.

    In the model it is where each seam keeps it and is corrected whole, without welds where lines and arcs do; on the
    arm where also the model was fitted, the program stays in the measured range, and the upper end of what is expected
    is within it.

    Args:
        values: the document of a conversion, without its ``verdict``.
    """
    if not values["figures"]:
        return "not_measured"
    tolerance, seams = values["tolerance_mm"], values["welds"]
    within = [seam["kept"] and not seam["left"] for seam in seams] or [values["max_error_after_mm"] <= tolerance]
    if not all(within) or values["unproved_statements"]:
        return "not_kept"
    expected = values["expected_on_arm_mm"]
    accuracy = values["expected_accuracy"]
    known = accuracy is not None and not accuracy["beyond_range"] and expected is not None and expected[1] <= tolerance
    return "kept" if known else "not_shown"


def verdict_values(judged: JudgedProgram) -> dict[str, Any]:
    """Return the ``verdict`` of a program, and the entries of its document that `verdict_sentence` reads."""
    welds = [
        {
            "kept": seam.kept,
            "left": len(seam.uncorrected),
            "along_after_mm": None if seam.after_mm is None else seam.after_mm.along,
        }
        for seam in judged.seams
    ]
    accuracy = judged.accuracy
    values = {
        "tolerance_mm": mm(judged.options.tolerance_m, 5),
        "max_error_after_mm": mm(judged.figures.after, 5),
        "figures": judged.figure_values(),
        "welds": welds,
        "unproved_statements": judged.unproved,
        "expected_on_arm_mm": judged.expected_on_arm_mm,
        "expected_accuracy": None if accuracy is None else {"beyond_range": list(accuracy.beyond)},
    }
    return {**values, "verdict": verdict(values)}


def verdict_sentence(values: Mapping[str, Any], outcomes: Sequence[StatementOutcome]) -> tuple[Tone, str]:
    """Return the first sentence on a program, and its tone: no weld or nothing corrected, or is the tolerance kept.

    Args:
        values: the document of the conversion. outcomes: of all motion statements.
    """
    counts = Counter(outcome.status for outcome in outcomes)
    corrected = sum(counts[status] for status in CORRECTED)
    welds = [outcome for outcome in outcomes if outcome.statement.signature.phase]
    reasons = Counter(outcome.reason for outcome in welds if outcome.status == "skipped")
    tone = TONES[values["verdict"]]
    if reasons and not any(outcome.status in CORRECTED for outcome in welds):
        return "error", f"No weld was corrected: {reasons.most_common(1)[0][0]}."
    if not corrected:
        return "warning", "Nothing was corrected."
    if not counts["compensated"] or not values["figures"]:
        return tone, f"{count_statements(corrected, 'corrected')}; no line or arc could be measured."
    return tone, _tolerance_sentence(values)


def _tolerance_sentence(values: Mapping[str, Any]) -> str:
    """Say whether the tolerance is kept in the model and on the arm, in the place that counts most."""
    figure, limit = values["figures"][0], values["tolerance_mm"]
    tolerance, digits = f"{limit:g} mm", decimals_of(limit)
    expected, after = figure["expected_on_arm_mm"], figure["after_mm"]
    on_arm = "what the arm does is not known"
    if expected:
        on_arm = f"on the arm {on_arm_text(expected, digits)} are expected {CLAUSES[figure['place']]}"
    if values["verdict"] == "kept":
        return f"The tolerance of {tolerance} is kept: {on_arm}."
    if values["verdict"] == "not_shown":
        return f"The tolerance of {tolerance} is kept in the model; {on_arm}."
    lost = f"The tolerance of {tolerance} is not kept"
    if uncorrected := sum(seam["left"] for seam in values["welds"]):
        return f"{lost}: {count_statements(uncorrected, 'left as it is', 'left as they are', 'weld statement')}."
    if values["unproved_statements"] and all(seam["kept"] for seam in values["welds"]):
        return f"That the tolerance of {tolerance} is kept is not proved; {on_arm}."
    along = max((seam["along_after_mm"] or 0.0 for seam in values["welds"]), default=0.0)
    if after <= limit < along:
        return f"{lost}: {above(along, limit, digits)} mm remain along a seam in the model; {on_arm}."
    further = f", {on_arm_text(expected, digits)} are expected on the arm" if expected else ""
    return f"{lost}: {above(after, limit, digits)} mm remain in the model{further}."


def count_statements(count: int, what: str, several: str = "", noun: str = "motion statement") -> str:
    """Return ``1 motion statement is corrected``, or ``3 motion statements are corrected``."""
    return f"{count} {noun} is {what}" if count == 1 else f"{count} {noun}s are {several or what}"
