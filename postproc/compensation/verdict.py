"""Whether a corrected program keeps its tolerance, and the sentence on it with which all that is written begins."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Literal

from postproc.compensation.conversion import JudgedProgram
from postproc.compensation.judgement.figures import CLAUSES
from postproc.compensation.text.values import Status
from postproc.numbers import above, mm, on_arm_text

Kept = Literal["kept", "not_kept", "not_shown", "not_measured"]
"""Whether the tolerance is kept: on the arm, not even in the model, in the model alone; or nothing was measured."""
Tone = Literal["good", "warning", "error"]
TONES: dict[Kept, Tone] = {
    "kept": "good",
    "not_shown": "warning",
    "not_kept": "error",
    "not_measured": "warning",
}
GUESS = ", a guess: the program leaves the range that was measured"
CORRECTED: tuple[Status, ...] = ("compensated", "run_time")
"""Status of statements that are corrected."""


@dataclass(frozen=True, slots=True)
class ProgramVerdict:
    """What is said first of a corrected program.

    Args:
        kept: whether its tolerance is kept, the entry ``verdict`` of its document.
        tone: of the sentence. sentence: that no weld or nothing was corrected, or whether the tolerance is kept.
    """

    kept: Kept
    tone: Tone
    sentence: str


def verdict_of(judged: JudgedProgram) -> ProgramVerdict:
    """Return the verdict on a corrected program; lengths count as its document has them, in five decimals of mm."""
    kept = _kept(judged)
    counts = Counter(outcome.status for outcome in judged.outcomes)
    corrected = sum(counts[status] for status in CORRECTED)
    welds = [outcome for outcome in judged.outcomes if outcome.statement.signature.phase]
    reasons = Counter(outcome.reason for outcome in welds if outcome.status == "skipped")
    if reasons and not any(outcome.status in CORRECTED for outcome in welds):
        return ProgramVerdict(kept, "error", f"No weld was corrected: {reasons.most_common(1)[0][0]}.")
    if not corrected:
        return ProgramVerdict(kept, "warning", "Nothing was corrected.")
    if not counts["compensated"] or not judged.places:
        text = f"{count_statements(corrected, 'corrected')}; no line or arc could be measured."
        return ProgramVerdict(kept, TONES[kept], text)
    return ProgramVerdict(kept, TONES[kept], _tolerance_sentence(judged, kept))


def _kept(judged: JudgedProgram) -> Kept:
    """Return whether the tolerance is kept.

    In the model it is where each seam keeps it and is corrected whole, without welds where lines and arcs do; on the
    arm where also the model was fitted, the program stays in the measured range, and the upper end of what is expected
    is within it.
    """
    if not judged.places:
        return "not_measured"
    tolerance = mm(judged.options.tolerance_m, 5)
    within = [seam.kept and not seam.uncorrected for seam in judged.seams]
    if not all(within or [mm(judged.figures.after, 5) <= tolerance]) or judged.unproved:
        return "not_kept"
    accuracy, expected = judged.accuracy, judged.expected_on_arm_mm
    known = accuracy is not None and not judged.guess and expected is not None and expected[1] <= tolerance
    return "kept" if known else "not_shown"


def _tolerance_sentence(judged: JudgedProgram, kept: Kept) -> str:
    """Say whether the tolerance is kept in the model and on the arm, in the place that counts most."""
    place, limit = judged.places[0], mm(judged.options.tolerance_m, 5)
    tolerance, digits = f"{limit:g} mm", judged.decimals
    expected, after = judged.expected_on_arm_mm, mm(place.after, 5)
    on_arm = "what the arm does is not known"
    if expected:
        on_arm = f"on the arm {on_arm_text(expected, digits)} are expected {CLAUSES[place.place]}{GUESS * judged.guess}"
    if kept == "kept":
        return f"The tolerance of {tolerance} is kept: {on_arm}."
    if kept == "not_shown":
        return f"The tolerance of {tolerance} is kept in the model; {on_arm}."
    lost = f"The tolerance of {tolerance} is not kept"
    if uncorrected := sum(len(seam.uncorrected) for seam in judged.seams):
        return f"{lost}: {count_statements(uncorrected, 'left as it is', 'left as they are', 'weld statement')}."
    if judged.unproved and all(seam.kept for seam in judged.seams):
        return f"That the tolerance of {tolerance} is kept is not proved; {on_arm}."
    along = max((seam.after_mm.along for seam in judged.seams if seam.after_mm), default=0.0)
    if after <= limit < along:
        return f"{lost}: {above(along, limit, digits)} mm remain along a seam in the model; {on_arm}."
    further = f", {on_arm_text(expected, digits)} are expected on the arm{GUESS * judged.guess}" if expected else ""
    return f"{lost}: {above(after, limit, digits)} mm remain in the model{further}."


def count_statements(count: int, what: str, several: str = "", noun: str = "motion statement") -> str:
    """Return ``1 motion statement is corrected``, or ``3 motion statements are corrected``."""
    return f"{count} {noun} is {what}" if count == 1 else f"{count} {noun}s are {several or what}"
