"""A conversion in at most three sentences: is the tolerance kept, what is in no figure, and how sure is the model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

import numpy as np

from postproc.compensation.conversion import Conversion
from postproc.compensation.correction.rigid_shift import FEWEST, remainder_unknown
from postproc.compensation.judgement.accuracy import Accuracy, remaining_deflection
from postproc.compensation.verdict import verdict_of
from postproc.diagnostics import Diagnostic, Finding, Matter, joined
from postproc.effects.registry import effect_library
from postproc.model.arm import Model
from postproc.model.uncertainty.undetermined import PULLING_POSES, Undetermined
from postproc.numbers import fixed
from postproc.report.blocks import Tone, Values
from postproc.results.convert.figures import decimals
from postproc.results.wording import in_words, readable, with_sigma

MATTERING_SHARE = 0.3
"""Share of the stated distance above which what no row has told is said."""
LEAST_M = 5e-5  # of the distance that is said
LONG_S = 7200.0  # from here on hours are told


def conclusion(conversion: Conversion) -> tuple[Tone, list[str]]:
    """Return what became of a program: a tone, and lines of one sentence each; advice with a command comes last."""
    values, judged = conversion.report, conversion.judged
    if not conversion.outputs:
        return "error", ["The program is not safe to compensate; no program was written."]
    if judged is None or (conversion.plan is None and conversion.module is None):
        return "", ["Nothing moves: the program is written as it is."]
    verdict = verdict_of(judged)
    lines = [verdict.sentence]
    lines += _not_in_figures(values)
    if unknown := remainder_unknown(judged.shifts):
        of = joined([f"that of `{name}`" for name in unknown])
        lines.append(f"A rigid shift follows fewer than {FEWEST} targets nearly: what remains beside {of} is not told.")
    if values["figures"]:
        lines += _how_sure(values, conversion.diagnostics, judged.accuracy, conversion.model)
    return verdict.tone, lines


def _not_in_figures(values: Values) -> list[str]:
    """Return a sentence on what the figures do not hold, none where they hold everything."""
    unseen, unproved, through = (
        *(values[f"{what}_statements"] for what in ("unmeasured", "unproved")),
        _counts(values)["run_time"],
    )
    parts = [
        f"{unseen} line{'s' * (unseen != 1)} or arc{'s' * (unseen != 1)} with unknown ends" if unseen else "",
        f"other runs of {unproved} statement{'s' * (unproved != 1)}" if unproved else "",
        f"{through} statement{'s' * (through != 1)} corrected on the controller" if through else "",
    ]
    taught = [f"`{row['wobj']}`" for row in values["rigid_shift"] if row["left_out"]]
    lines = [f"Not in these figures: {joined([part for part in parts if part])}."] if any(parts) else []
    if values["from_programmed_path"]:
        lines.append(f"The path is the one that this arm has taught in {joined(taught)}, not that of the numbers.")
    if at_tool := [f"`{row['wobj']}`" for row in values["rigid_shift"] if row["left_out"] and row["held"]]:
        lines.append(
            f"That counts where {joined(at_tool)} was taught at the stationary tool, turned as in these targets."
        )
    return lines


def _how_sure(
    values: Values, findings: Iterable[Diagnostic], accuracy: Accuracy | None, model: Model | None = None
) -> list[str]:
    """Return lines on how well the model knows this arm, and on the cheapest measurement that tells more."""
    text, advice = remaining_deflection(values)
    if text:
        return [f"{text[0].upper()}{text[1:]}.", f"{advice[0].upper()}{advice[1:]}"]
    known = values["expected_accuracy"]
    if known is None:
        text = unknown_accuracy(findings)
        return [f"{text[0].upper()}{text[1:]}."]
    least, at_welds = (known[f"within_95_percent{where}_mm"] for where in ("", "_at_welds"))
    sizes = [fixed(size, decimals(values)) for size in (at_welds, least) if size is not None]
    sure = f"At the least certain target the fitted model itself may be off by up to {sizes[-1]} mm (95 %)."
    if len(set(sizes)) > 1:
        off = f"{sizes[0]} mm (95 %) where it welds, {sizes[1]} mm in the air"
        sure = f"The fitted model itself may be off by up to {off}."
    if model is not None and 0 < len(measured := model.measured_springs) < 6:
        joints = f"joint{'s' * (len(measured) > 1)} {joined([str(joint) for joint in measured])}"
        sure += f" Measured are the springs of {joints}; the others stand as those of the arm's type."
    if known["beyond_range"]:
        return [sure]
    return [sure, *(_undetermined(accuracy, model) if accuracy else [])]


def touches_help(accuracy: Accuracy | None, model: Model | None) -> bool:
    """Return whether touches would tell weights of links that are open: a dial gauge alone tells nothing of them."""
    if accuracy is None or model is None or accuracy.beyond or list(model.fit.get("kinds", ())) != ["gauge"]:
        return False
    return _weights_open(accuracy)


def unknown_accuracy(findings: Iterable[Diagnostic | Finding] = (), of_type: bool = False) -> str:
    """Return a clause: how near the real torch comes is not known, since the model was not fitted to this arm.

    Args:
        findings: of the conversion; where they say that parts of a model do not hold here, or that its fit contradicts
            itself, that is the reason given.
        of_type: what is expected on the arm follows from the scatter of its type's stiffness.
    """
    if any(d.matter is Matter.OMITTED for d in findings):
        return "not all of the model holds here: how near the real torch comes is not known"
    if any(d.matter is Matter.CONTRADICTED for d in findings):
        return "what the model was fitted to contradicts itself: how near the real torch comes is not known"
    why = "the model was not fitted to measurements of this arm"
    if of_type:
        return f"{why}: what is expected counts its stiffness alone (`postproc fit`)"
    return f"{why}: how near the torch comes is not known (`postproc fit`)"


def outcome_note(values: Values) -> str:
    """Return how many statements were corrected and left, how many targets added, and the cycle time, in one line.

    Args:
        values: the document of a conversion with a plan.
    """
    counts, seconds = _counts(values), values["cycle_time_s"]
    every = sum(counts.values())
    time = "" if seconds is None else f"{seconds:.1f} s" if seconds < LONG_S else f"{seconds / 3600:.1f} h"
    parts = [
        f"{counts['compensated']} of {every} motion statements corrected",
        f"{counts['run_time']} on the controller" if counts["run_time"] else "",
        f"{counts['unchanged']} unchanged" if counts["unchanged"] else "",
        f"{counts['skipped']} left",
        f"{values['added_targets']} target{'s' * (values['added_targets'] != 1)} added",
        _confdata(values),
        f"cycle time {time}" if time else "",
    ]
    return ", ".join(filter(None, parts))


def _confdata(values: Values) -> str:
    """Return a phrase on the statements whose confdata was changed, as it would select another posture; or empty."""
    lines = [str(row["line"]) for row in values["statements"] if row["conf_changed"]]
    listed = ", ".join(lines[:5]) + ", .." * (len(lines) > 5)
    return f"confdata changed in line{'s' * (len(lines) > 1)} {listed}" if lines else ""


def _counts(values: Values) -> Counter[str]:
    """Return the number of motion statements by status."""
    return Counter(row["status"] for row in values["statements"])


def _undetermined(accuracy: Accuracy, model: Model | None) -> list[str]:
    """Return lines on what no row has told, a parameter or link masses, and how to tell it; none where it is little.

    Args:
        accuracy: that of the conversion; model: of the arm.
    """
    known = accuracy.undetermined
    if _weights_open(accuracy):
        open_ = f"Of that, {1e3 * accuracy.by_weights:.2f} mm are open, as the weights of the links are estimates"
        helps = ": positions, or touches of a tip, tell how far the arm sags" if touches_help(accuracy, model) else ""
        return [f"{open_}{helps}."]
    if known is None or known.within_95 < max(LEAST_M, MATTERING_SHARE * accuracy.within_95):
        return []
    size = f"{1e3 * known.within_95:.2f} mm"
    return [f"Of that, {size} are open: the rows say little of {_parameter_text(known)}.", _pull_text(known)]


def _weights_open(accuracy: Accuracy) -> bool:
    """Return whether much of the expected distance is open as the weights of the links are estimates."""
    return accuracy.by_weights > max(LEAST_M, MATTERING_SHARE * accuracy.within_95)


def _parameter_text(known: Undetermined) -> str:
    """Return the parameter with its value: ``the compliance of joint 1 (4.22 ± 0.90 µrad/(N m))``."""
    effect = effect_library().get(known.effect)
    name = known.name.partition(".")[2]
    if effect is None or (declared := effect.parameters().get(name.partition("[")[0])) is None:
        return f"`{known.name}` ({with_sigma(known.value, known.sigma)})"
    factor, unit = readable(declared.unit)
    return f"{in_words(effect, name)} ({with_sigma(factor * known.value, factor * known.sigma)} {unit})"


def _pull_text(known: Undetermined) -> str:
    """Return the cheapest measurement that tells the parameter; that `plan` says it where no pull does."""
    if known.pull is None or known.pull_displacement < LEAST_M / 5:
        return "`postproc plan MODEL TABLE` says which poses tell it."
    axis = int(np.argmax(known.pull))
    size, way = known.pull[axis], "xyz"[axis % 3]
    how = f"pull with {size:.0f} N along {way}" if axis < 3 else f"turn with {size:.0f} N m about {way}"
    where = f"of the base at {PULLING_POSES} poses of the program, measure with and without it, and fit again"
    return f"To tell it, {how} {where}."
