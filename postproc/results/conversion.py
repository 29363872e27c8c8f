"""A corrected program: what it was off, what remains, where, and what was done about it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from postproc import __version__
from postproc.compensation.conversion import Conversion, JudgedProgram
from postproc.compensation.judgement.accuracy import Accuracy, better_figure
from postproc.compensation.judgement.figures import PlaceFigures
from postproc.compensation.judgement.seams import Seam
from postproc.compensation.text.values import StatementOutcome
from postproc.diagnostics import Diagnostic, Matter
from postproc.effects.registry import effect_library
from postproc.model.undetermined import PULLING_POSES, Undetermined
from postproc.numbers import mm, on_arm_text
from postproc.report.blocks import DataTable, Document, Figure, Scene, Section, Values, View, attributes
from postproc.report.drawing.path import path_data
from postproc.results.figures import figure_values, verdict
from postproc.results.wording import in_words, readable, with_sigma
from postproc.results.work_objects import from_programmed_path, rigid_shift_values, work_object_section

CONVERSION_SCHEMA = "postproc/compensate/1"
ACROSS = (
    "Distance of the real torch from the line or arc of each statement, measured across it at and between targets; at "
    "targets the tables also count what points along it. Shaded: the arc burns; green: the tolerance. Drag to zoom, "
    "double-click to see all, click to choose a place."
)
IN_SPACE_NOTE = (
    "Pick a seam, a statement, a line of the program or a place in a picture: all of them show the same place."
)
CHECKED = "What `compensate` found with the function on targets of its region; lengths in mm."
JOINTS_NOTE = "Torques of a rigid arm, under its own weight and the loads."
FINDING_COLUMNS = ("line", "severity", "code", "what", "what to do")
FINDING_KEYS = ("line", "severity", "code", "message", "help")
STATEMENT = ("line", "routine", "instruction", "status", "reason")
MATTERING_SHARE = 0.3
"""Share of the stated distance above which what no row has told is said."""
LEAST_M = 5e-5  # of the distance that is said
LONG_S = 7200.0  # from here on hours are told
DEVIATIONS = {"error_before": "before", "error_after": "after", "arc_error_before": "arc_before"}
DEVIATIONS |= {"arc_error_after": "arc"} | {key: key for key in ("transition", "transient", "joint_move")}
"""Largest deviations of a document by the attributes of `PathFigures`."""
CORRECTED = ("compensated", "run_time")  # status of statements that are corrected
SEAM = {"name": "seam", "line_from": "from line", "line_to": "to line", "length_mm": "length [mm]"}
SEAM |= {"before_mm": "before [mm]", "after_mm": "after [mm]", "added_targets": "added", "left": "left"}


def conversion_document(name: str, conversion: Conversion, made: Mapping[str, str] | None = None) -> Document:
    """Describe the conversion of a program, for terminal and page.

    Args:
        name: of the program. made: what it was converted with (model, loads, options) as label and text.
    """
    values, moved = conversion.report, conversion.plan is not None
    findings, seams, statements = (
        [[row[key] for key in keys] for row in values.get(name, ())]
        for name, keys in (("diagnostics", FINDING_KEYS), ("welds", SEAM), ("statements", STATEMENT))
    )
    of_seams = DataTable("seams", list(SEAM.values()), seams, view="seams")
    shown = "statements" if moved else ""  # a page shows them beside its picture of the path
    run_time = {key: value for key, value in (values.get("run_time") or {}).items() if value is not None}
    checked = [(key.removesuffix("_mm").replace("_", " "), value) for key, value in run_time.items()]
    facts = {**({"arm": values["robot"]} if moved else {}), **(made or {})}
    return Document(
        title=f"postproc compensate {name}",
        values=values,
        sentence=_sentence(conversion),
        figures=_figures(values) if moved else (),
        basis=_basis(conversion, made or {}) if moved else "",
        sections=[
            Section("Seam by seam", [of_seams], "The largest deviation while the arc burns."),
            Section("Program", [View("text")] if moved else [], IN_SPACE_NOTE),
            work_object_section(values),
            Section("Every motion statement", [DataTable("statements", STATEMENT, statements, (), view=shown)]),
            Section("Joints", [View("joints")] if moved else [], JOINTS_NOTE),
            Section("Findings", [DataTable("findings", FINDING_COLUMNS, findings, brief=())]),
            Section("Corrected on the controller", [DataTable("run time", ("what", "value"), checked)], CHECKED),
            made_section(facts),
        ],
        scene=Scene("path", lambda: path_data(conversion), stage="stage") if moved else None,
    )


def conversion_values(conversion: Conversion) -> dict[str, Any]:
    """Return the ``postproc/compensate/1`` document; of a program that was not converted it has the findings alone."""
    findings = [d.as_json() for d in conversion.diagnostics]
    judged, model = conversion.judged, conversion.model
    if judged is None or model is None:
        return {"schema": CONVERSION_SCHEMA, "statements": [], "diagnostics": findings}
    figures, accuracy, limits = judged.figures, judged.accuracy, judged.limits
    welds = [o for o in judged.outcomes if o.statement.signature.phase]
    sure = accuracy and {
        "sigma_mm": _mm(accuracy.sigma),
        "within_95_percent_mm": _mm(accuracy.within_95),
        "sigma_parts_mm": _lengths(("parameters", "unexplained"), accuracy.parts)
        | {"noise": model.fit.get("noise_mm")},
    }
    document = {
        "schema": CONVERSION_SCHEMA,
        "tool": __version__,
        "robot": model.robot.name,
        "statements": [*map(_statement_values, judged.outcomes)],
        **{f"max_{key}_mm": _mm(getattr(figures, name)) for key, name in DEVIATIONS.items()},
        "tolerance_mm": _mm(judged.options.tolerance_m),
        "air_tolerance_mm": _mm(judged.air_tolerance_m),
        "figures": figure_values(judged),
        "scope": judged.options.scope,
        "welds": [_seam_values(judged, seam) for seam in judged.seams],
        "expected_accuracy": sure,
        **undetermined_values(accuracy.undetermined if accuracy else None),
        "unproved_statements": judged.unproved,
        "unmeasured_statements": judged.unmeasured,
        "measured_statements": judged.lines - judged.unmeasured,
        "weld_statements": len(welds),
        "corrected_weld_statements": len([o for o in welds if o.status in CORRECTED]),
        "added_targets": judged.added,
        "cycle_time_s": limits and round(limits.slower, 3),
        "cycle_time_before_s": limits and round(limits.cycle_time, 3),
        "diagnostics": findings,
        "already": list(judged.options.already),
        "expected_on_arm_mm": judged.expected_on_arm_mm,
        **judged.remaining_values(),
        "run_time": judged.run_time and asdict(judged.run_time),
        "rigid_shift": [*map(rigid_shift_values, judged.shifts)],
        "from_programmed_path": judged.drawn and _lengths(("before_mm", "after_mm"), judged.drawn.counting),
    }
    return {**document, "verdict": verdict(document)}


def _statement_values(outcome: StatementOutcome) -> Values:
    """Return an entry of ``statements`` of the document."""
    statement = outcome.statement
    return {
        "path": statement.source.path,
        **attributes(statement, "line", "module", "routine", "instruction"),
        **attributes(outcome, "status", "reason", "edited", "conf_changed", "shift_mm", "residual_mm"),
    }


def _seam_values(judged: JudgedProgram, seam: Seam) -> Values:
    """Return an entry of ``welds`` of the document."""
    measured = seam.before_mm and seam.after_mm and (seam.before_mm.arc * 1e-3, seam.after_mm.arc * 1e-3)
    first, last = seam.outcomes[0].statement, seam.outcomes[-1].statement
    states = {"before": seam.before_mm, "after": seam.after_mm}
    return {
        "name": seam.name,
        "path": first.source.path,
        "line_from": first.line,
        "line_to": last.line,
        "length_mm": round(seam.length_mm, 1),
        "runs": seam.runs,
        **{f"{when}_mm": of_seam and of_seam.arc for when, of_seam in states.items()},
        **{
            f"{part}_{when}_mm": of_seam and getattr(of_seam, part)
            for when, of_seam in states.items()
            for part in ("sideways", "stick_out", "along")
        },
        "expected_on_arm_mm": measured and judged.expected_mm(PlaceFigures("weld", *measured)),
        **attributes(seam, "kept", "added_targets"),
        "left": len(seam.uncorrected),
    }


def _mm(value: float | None) -> float | None:
    """Convert metres to millimetres with five decimals, two more than RAPID text has; None stays None."""
    return None if value is None else mm(value, 5)


def _lengths(keys: Sequence[str], values: Sequence[float]) -> dict[str, Any]:
    """Return lengths [m] in millimetres by their keys."""
    return dict(zip(keys, map(_mm, values), strict=True))


def made_section(made: Mapping[str, str]) -> Section:
    """Return the folded section that says with what a result was made, and by which version.

    Args:
        made: (model, loads, options) as label and text.
    """
    rows = [*made.items(), ("postproc", __version__)]
    return Section("How this was made", [DataTable("how this was made", ("what", "with"), rows, brief=())], folded=True)


def _figures(values: Values) -> list[Figure]:
    """Return four figures: deviation expected on the arm, before and after in the model, and statements by status.

    Args:
        values: the document of the conversion.
    """
    before, after, where = main_figures(values) if values["measured_statements"] else (None, None, "")
    words = {"compensated": "corrected", "run_time": "at run time", "unchanged": "unchanged"}
    counts = Counter(row["status"] for row in values["statements"])
    statuses = [f"{counts[status]} {word}" for status, word in words.items() if counts[status]]
    return [
        Figure(f"expected on the arm, {where}", on_arm_text(values["expected_on_arm_mm"]) if where else None),
        Figure(f"before, {where}", before, "before"),
        Figure(f"after in the model, {where}", after, "after"),
        Figure("motion statements", ", ".join([*statuses, f"{counts['skipped']} left"])),
    ]


def _basis(conversion: Conversion, made: Mapping[str, str]) -> str:
    """Say what the result rests on: arm, tolerances, scope, added targets, cycle time and known accuracy.

    Args:
        made: what the program was converted with (model, loads, options) as label and text.
    """
    values = conversion.report
    known = values["expected_accuracy"]
    sure = unknown_accuracy(conversion.diagnostics, values["expected_remaining_fraction"] is not None)
    if known:
        sure = f"the fitted model itself is sure to {known['within_95_percent_mm']:.3f} mm (95 %)"
    air = "with moves in the air {max_error_after_mm:.3f} mm of {max_error_before_mm:.3f} mm remain"
    seconds = values["cycle_time_s"]
    parts = [
        f"Arm `{values['robot']}`" + (f", {made['model']}" if "model" in made else ""),
        f"tolerance {values['tolerance_mm']:g} mm, {values['air_tolerance_mm']:g} mm in the air",
        f"scope {values['scope']}",
        f"{values['added_targets']} target{'s' * (values['added_targets'] != 1)} added",
        *_confdata(values),
        "cycle time " + (f"{seconds:.1f} s" if seconds < LONG_S else f"{seconds / 3600:.1f} h"),
        *([air.format(**values)] if values["max_arc_error_after_mm"] is not None else []),
        sure,
    ]
    accuracy = None if conversion.judged is None else conversion.judged.accuracy
    return "; ".join(parts) + "." + ("" if accuracy is None else undetermined_text(accuracy))


def _confdata(values: Values) -> list[str]:
    """Return a phrase on the statements whose confdata was changed, none if there are no such statements.

    Args:
        values: the document of the conversion.
    """
    lines = [str(row["line"]) for row in values["statements"] if row["conf_changed"]]
    if not lines:
        return []
    listed = ", ".join(lines[:5]) + ", .." * (len(lines) > 5)
    count, where = ("1 statement", "line") if len(lines) == 1 else (f"{len(lines)} statements", "lines")
    return [f"confdata of {count} changed, it would select another posture ({where} {listed})"]


def unknown_accuracy(findings: Iterable[Diagnostic] = (), of_type: bool = False) -> str:
    """Say that how near the real torch comes to the path is not known, since the model was not fitted to this arm.

    Args:
        findings: of the conversion; where they say that parts of a model do not hold here, that is the reason given.
        of_type: what is expected on the arm follows from the scatter of its type's stiffness.
    """
    complete = all(d.matter is not Matter.NOT_WHOLE for d in findings)
    why = "the model was not fitted to measurements of this arm" if complete else "not all of the model holds here"
    if of_type:
        return f"{why}: what is expected on it counts the stiffness alone, no error of its geometry (`postproc fit`)"
    return f"{why}: these are deviations in the model, and how near the real torch comes is not known (`postproc fit`)"


def _sentence(conversion: Conversion) -> str:
    """Say what became of the program: that no weld was corrected where that is so, then what became of the rest."""
    welds = [o for o in conversion.outcomes if o.statement.signature.phase]
    reasons = Counter(o.reason for o in welds if o.status == "skipped")
    if not reasons or any(o.status in CORRECTED for o in welds):
        return _outcome_text(conversion)
    return f"No weld was corrected: {reasons.most_common(1)[0][0]}. {_outcome_text(conversion)}"


def _outcome_text(conversion: Conversion) -> str:
    """Say what became of the statements: the deviation before and after, or why nothing was corrected."""
    values = conversion.report
    if not conversion.outputs:
        return "The program is not safe to compensate; no program was written."
    if conversion.plan is None and conversion.module is None:
        return "Nothing moves: the program is written as it is."
    counts = Counter(row["status"] for row in values["statements"])
    through, corrected = counts["run_time"], counts["compensated"]
    what, whose = ("1 motion statement is", "its") if through == 1 else (f"{through} motion statements are", "their")
    on_controller = f"{what} corrected on the controller, where {whose} targets become known."
    if through and not (corrected and values["measured_statements"]):
        return f"{on_controller}{_unmeasured(values)}"
    if not corrected:
        return f"Nothing was corrected.{_unmeasured(values)}"
    before, after, where = main_figures(values)
    places = (("max_transient_mm", "while the speed changes"), ("max_transition_mm", "where the correction jumps"))
    unsteady = [f"{values[key]:.3f} mm {place}" for key, place in places if values[key] > values["tolerance_mm"]]
    fell = f"Expected on the arm {where}: {on_arm_text(values['expected_on_arm_mm'])}; {after:.3f} mm remain in "
    fell += f"the model{' at steady speed' if unsteady else ''}, where there were {before:.3f} mm"
    fell += f"{'; up to ' * bool(unsteady)}{' and '.join(unsteady)}."
    if not values["measured_statements"]:
        what = "statements are" if corrected > 1 else "statement is"
        fell = f"{corrected} {what} corrected; no line or arc could be measured."
    count = values["unproved_statements"]
    doubt = f" {count} of these statements also run where they cannot be followed: what remains there is not proved."
    better = better_figure(values)
    advice = f"\n{better[0].upper()}{better[1:]}." if better else ""
    fell += from_programmed_path(values)
    return "".join([fell, _unmeasured(values), doubt * bool(count), f" {on_controller}" * bool(through), advice])


def _unmeasured(values: Values) -> str:
    """Return a sentence, after a blank, on how many lines or arcs have no known ends and count in no figure; or empty.

    Args:
        values: the document of the conversion.
    """
    count = values["unmeasured_statements"]
    what = f"{count} lines or arcs are" if count > 1 else "1 line or arc is"
    return f" {what} in no figure: where they begin or end is not known." if count else ""


def main_figures(values: Values) -> tuple[float, float, str]:
    """Return the deviations that count, before and after, and where: in welds if there are any, else in all.

    Args:
        values: the document of the conversion.
    """
    welds = values["max_arc_error_after_mm"] is not None
    before, after = (values[f"max_{'arc_' * welds}error_{when}_mm"] for when in ("before", "after"))
    return before, after, "while the arc burns" if welds else "along lines and arcs"


def undetermined_values(known: Undetermined | None) -> Values:
    """Return the entries ``undetermined_under_load_mm`` and ``undetermined_parameter`` of a conversion's document."""
    parameter = known and {
        "parameter": known.name,
        **attributes(known, "value", "sigma"),
        "within_95_percent_mm": mm(known.largest),
        "pull": [] if known.pull is None else known.pull.tolist(),
        "pull_shows_mm": mm(known.told),
    }
    within = 0.0 if known is None else mm(known.within_95)
    return {"undetermined_under_load_mm": within, "undetermined_parameter": parameter}


def undetermined_text(accuracy: Accuracy) -> str:
    """Return sentences on the parameter that no row has told, its cost, and how to tell it; empty where it is little.

    Args:
        accuracy: that of the conversion.
    """
    known = accuracy.undetermined
    if known is None or known.within_95 < max(LEAST_M, MATTERING_SHARE * accuracy.within_95):
        return ""
    alone = "" if known.largest > 0.99 * known.within_95 else f", {1e3 * known.largest:.2f} mm by it alone"
    why = f"because the measured rows say little of {_parameter_text(known)}{alone}"
    return f" Of that, {1e3 * known.within_95:.2f} mm are open under these loads {why}. {_pull_text(known)}"


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
    if known.pull is None or known.told < LEAST_M / 5:
        return "`postproc plan` says which poses tell it."
    axis = int(np.argmax(known.pull))
    size, way = known.pull[axis], "xyz"[axis % 3]
    how = f"pull with {size:.0f} N along {way}" if axis < 3 else f"turn with {size:.0f} N m about {way}"
    where = f"of the base at {PULLING_POSES} poses of the program, measure with and without, and fit again"
    return f"To tell it, {how} {where}: the TCP moves by {1e3 * known.told:.2f} mm for each standard deviation."
