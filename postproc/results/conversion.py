"""A corrected program: what it was off, what remains, where, and what was done about it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

from postproc import __version__
from postproc.compensation.conversion import Conversion
from postproc.compensation.judgement.accuracy import estimated_stiffness
from postproc.compensation.judgement.figures import PathFigures
from postproc.compensation.judgement.seams import Seam
from postproc.compensation.text.values import StatementOutcome
from postproc.diagnostics import Diagnostic, Matter
from postproc.numbers import mm
from postproc.report.blocks import DataTable, Document, Figure, Scene, Section, Values, View
from postproc.results.under_load import undetermined_text, undetermined_values
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
JOINTS_NOTE = "Torques of a rigid arm, under its own weight and the loads."
ALONG = "along lines and arcs"
FINDING_COLUMNS = ("line", "severity", "code", "what", "what to do")
STATEMENT = ("line", "routine", "instruction", "status", "reason")
LONG_S = 7200.0  # from here on hours are told
CORRECTED = ("compensated", "run_time")  # status of statements that are corrected
SEAM = {
    "name": "seam",
    "line_from": "from line",
    "line_to": "to line",
    "length_mm": "length [mm]",
    "before_mm": "before [mm]",
    "after_mm": "after [mm]",
    "added_targets": "added",
    "left": "left",
}


def conversion_document(name: str, conversion: Conversion, made: Mapping[str, str] | None = None) -> Document:
    """Describe the conversion of a program, for terminal and page.

    Args:
        name: of the program. made: what it was converted with (model, loads, options) as label and text.
    """
    values, moved = conversion.report, conversion.plan is not None
    findings = [(d["line"], d["severity"], d["code"], d["message"], d["help"]) for d in values["diagnostics"]]
    facts = {**({"arm": values["robot"]} if moved else {}), **(made or {})}
    return Document(
        title=f"postproc compensate {name}",
        values=values,
        sentence=_sentence(conversion),
        figures=_figures(values) if moved else (),
        basis=_basis(conversion, made or {}) if moved else "",
        sections=[
            Section("Seam by seam", [_seams(values)], "The largest deviation while the arc burns."),
            Section("Where", [View("space")] if moved else [], IN_SPACE_NOTE),
            Section("How far off, along the path", [View("deviation")] if moved else [], ACROSS),
            work_object_section(values),
            Section("Every motion statement", [_statements(values, moved)]),
            Section("Joints", [View("joints")] if moved else [], JOINTS_NOTE),
            Section("Findings", [DataTable("findings", FINDING_COLUMNS, findings, brief=())]),
            _run_time(values.get("run_time") or {}),
            made_section(facts),
        ],
        scene=Scene("path", lambda: _path(conversion)) if moved else None,
    )


def conversion_values(conversion: Conversion) -> dict[str, Any]:
    """Return the ``postproc/compensate/1`` document; of a program that was not converted it has the findings alone."""
    findings = [d.as_json() for d in conversion.diagnostics]
    judged, model = conversion.judged, conversion.model
    if judged is None or model is None:
        return {"schema": CONVERSION_SCHEMA, "statements": [], "diagnostics": findings}
    figures, accuracy, limits = judged.figures, judged.accuracy, judged.limits
    welds = [o for o in judged.outcomes if o.statement.signature.phase]
    sure = accuracy and {"sigma_mm": _mm(accuracy.sigma), "within_95_percent_mm": _mm(accuracy.within_95)}
    return {
        "schema": CONVERSION_SCHEMA,
        "tool": __version__,
        "robot": model.robot.name,
        "statements": [*map(_statement_values, judged.outcomes)],
        "max_error_before_mm": _mm(figures.before),
        "max_error_after_mm": _mm(figures.after),
        "max_arc_error_before_mm": None if figures.arc_before is None else _mm(figures.arc_before),
        "max_arc_error_after_mm": None if figures.arc is None else _mm(figures.arc),
        "max_transition_mm": _mm(figures.transition),
        "max_transient_mm": _mm(figures.transient),
        "max_joint_move_mm": _mm(figures.joint_move),
        "tolerance_mm": _mm(judged.options.tolerance_m),
        "air_tolerance_mm": _mm(judged.air_tolerance_m),
        "scope": judged.options.scope,
        "welds": [*map(_seam_values, judged.seams)],
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
        "expected_remaining_fraction": judged.remaining,
        "run_time": judged.run_time and asdict(judged.run_time),
        "rigid_shift": [*map(rigid_shift_values, judged.shifts)],
        "from_programmed_path": judged.drawn and _drawn_values(judged.drawn),
    }


def _drawn_values(drawn: PathFigures) -> Values:
    """Return the largest deviations from the path as programmed: where the arc burns, if it does, else along lines."""
    known = drawn.arc_before is not None and drawn.arc is not None
    before, after = (drawn.arc_before, drawn.arc) if known else (drawn.before, drawn.after)
    return {"before_mm": _mm(before or 0.0), "after_mm": _mm(after or 0.0)}


def _statement_values(outcome: StatementOutcome) -> Values:
    """Return an entry of ``statements`` of the document."""
    statement = outcome.statement
    return {
        "path": statement.source.path,
        "line": statement.line,
        "module": statement.module,
        "routine": statement.routine,
        "instruction": statement.instruction,
        "status": outcome.status,
        "reason": outcome.reason,
        "edited": outcome.edited,
        "conf_changed": outcome.conf_changed,
        "shift_mm": outcome.shift_mm,
        "residual_mm": outcome.residual_mm,
    }


def _seam_values(seam: Seam) -> Values:
    """Return an entry of ``welds`` of the document."""
    first, last = seam.outcomes[0].statement, seam.outcomes[-1].statement
    return {
        "name": seam.name,
        "path": first.source.path,
        "line_from": first.line,
        "line_to": last.line,
        "length_mm": round(seam.length_mm, 1),
        "before_mm": seam.before_mm,
        "after_mm": seam.after_mm,
        "added_targets": seam.added_targets,
        "left": len(seam.uncorrected),
    }


def _mm(value: float) -> float:
    """Convert metres to millimetres with five decimals, two more than RAPID text has."""
    return mm(value, 5)


def made_section(made: Mapping[str, str]) -> Section:
    """Return the folded section that says with what a result was made, and by which version.

    Args:
        made: (model, loads, options) as label and text.
    """
    rows = [*made.items(), ("postproc", __version__)]
    return Section("How this was made", [DataTable("how this was made", ("what", "with"), rows, brief=())], folded=True)


def _seams(values: Values) -> DataTable:
    """Return the table of seams with their deviations, from the document of the conversion."""
    rows = [[seam[key] for key in SEAM] for seam in values.get("welds", ())]
    return DataTable("seams", list(SEAM.values()), rows, view="seams")


def _statements(values: Values, moved: bool) -> DataTable:
    """Return the table of motion statements from the document.

    Args:
        moved: the motion is known, so that a page shows the table beside its picture of the path.
    """
    rows = [[row[key] for key in STATEMENT] for row in values["statements"]]
    return DataTable("statements", STATEMENT, rows, (), view="statements" if moved else "")


def _path(conversion: Conversion) -> Values:
    """Return the numbers from which a page draws the path of a conversion that has a plan."""
    from postproc.report.drawing.path import path_data

    return path_data(conversion)


def _figures(values: Values) -> list[Figure]:
    """Return three figures: deviation before, deviation after, and statements by status.

    Args:
        values: the document of the conversion.
    """
    arc, where = _main_figures(values)
    words = {"compensated": "corrected", "run_time": "at run time", "unchanged": "unchanged"}
    counts = [f"{count} {word}" for status, word in words.items() if (count := _count(values, status))]
    before, after = (values[f"max_{arc}error_{when}_mm"] for when in ("before", "after"))
    known = bool(values["measured_statements"])
    return [
        Figure(f"before, {where}", before if known else None, "before"),
        Figure(f"after, {where}", after if known else None, "after"),
        Figure("motion statements", ", ".join([*counts, f"{_count(values, 'skipped')} left"])),
    ]


def _run_time(figures: Values) -> Section:
    """Return the section on the module that corrects targets on the controller: what its check found.

    Args:
        figures: ``run_time`` of the document; empty without such a module, and then the section has nothing to show.
    """
    rows = [(key.removesuffix("_mm").replace("_", " "), value) for key, value in figures.items() if value is not None]
    note = "What `compensate` found with the function on targets of its region; lengths in mm."
    return Section("Corrected on the controller", [DataTable("run time", ("what", "value"), rows)], note)


def _count(document: Values, status: str) -> int:
    """Return how many statements of a document have a status."""
    return sum(row["status"] == status for row in document["statements"])


def _basis(conversion: Conversion, made: Mapping[str, str]) -> str:
    """Say what the result rests on: arm, tolerances, scope, added targets, cycle time and known accuracy.

    Args:
        made: what the program was converted with (model, loads, options) as label and text.
    """
    values = conversion.report
    known = values["expected_accuracy"]
    sure = (
        f"the fitted model itself is sure to {known['within_95_percent_mm']:.3f} mm (95 %)"
        if known
        else unknown_accuracy(conversion.diagnostics)
    )
    before, after = values["max_error_before_mm"], values["max_error_after_mm"]
    air = [f"with moves in the air {after:.3f} mm of {before:.3f} mm remain"] if _main_figures(values)[0] else []
    parts = [
        f"Arm `{values['robot']}`" + (f", {made['model']}" if "model" in made else ""),
        f"tolerance {values['tolerance_mm']:g} mm, {values['air_tolerance_mm']:g} mm in the air",
        f"scope {values['scope']}",
        f"{values['added_targets']} target{'s' * (values['added_targets'] != 1)} added",
        *_confdata(values),
        f"cycle time {_duration(values['cycle_time_s'])}",
        *air,
        sure,
    ]
    accuracy = None if conversion.judged is None else conversion.judged.accuracy
    return "; ".join(parts) + "." + ("" if accuracy is None else undetermined_text(accuracy))


def _duration(seconds: float) -> str:
    """Return a time as people read it: in seconds, or in hours where it is long."""
    return f"{seconds:.1f} s" if seconds < LONG_S else f"{seconds / 3600:.1f} h"


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


def unknown_accuracy(findings: Iterable[Diagnostic] = ()) -> str:
    """Say that how near the real torch comes to the path is not known, since the model was not fitted to this arm.

    Args:
        findings: of the conversion; where they say that parts of a model do not hold here, that is the reason given.
    """
    complete = all(d.matter is not Matter.NOT_WHOLE for d in findings)
    why = "the model was not fitted to measurements of this arm" if complete else "not all of the model holds here"
    return f"{why}: these are deviations in the model, and how near the real torch comes is not known (`postproc fit`)"


def _sentence(conversion: Conversion) -> str:
    """Say what became of the program: that no weld was corrected where that is so, then what became of the rest."""
    welds = [o for o in conversion.outcomes if o.statement.signature.phase]
    reasons = Counter(o.reason for o in welds if o.status == "skipped")
    if not reasons or any(o.status in CORRECTED for o in welds):
        return _rest(conversion)
    return f"No weld was corrected: {reasons.most_common(1)[0][0]}. {_rest(conversion)}"


def _rest(conversion: Conversion) -> str:
    """Say what became of the statements: the deviation before and after, or why nothing was corrected."""
    values = conversion.report
    if not conversion.outputs:
        return "The program is not safe to compensate; no program was written."
    if conversion.plan is None and conversion.module is None:
        return "Nothing moves: the program is written as it is."
    through, corrected = _count(values, "run_time"), _count(values, "compensated")
    what = "1 motion statement is" if through == 1 else f"{through} motion statements are"
    on_controller = (
        f"{what} corrected on the controller, where {'its' if through == 1 else 'their'} targets become known."
    )
    if through and not (corrected and values["measured_statements"]):
        return f"{on_controller}{_unmeasured(values)}"
    if not corrected:
        return f"Nothing was corrected.{_unmeasured(values)}"
    arc, where = _main_figures(values)
    before, after = values[f"max_{arc}error_before_mm"], values[f"max_{arc}error_after_mm"]
    unsteady = unsteady_deviations(values)
    fell = f"At most {after:.3f} mm of deviation remain {where}{' at steady speed' if unsteady else ''}, "
    fell += f"where there were {before:.3f} mm{'; up to ' * bool(unsteady)}{' and '.join(unsteady)}."
    if not values["measured_statements"]:
        fell = (
            f"{corrected} statement{'s are' if corrected > 1 else ' is'} corrected; no line or arc could be measured."
        )
    count = values["unproved_statements"]
    doubt = f" {count} of these statements also run where they cannot be followed: what remains there is not proved."
    estimated = f" On the arm: {estimate}." if (estimate := stiffness_estimate(values).replace("`", "")) else ""
    fell += from_programmed_path(values)
    return "".join([fell, _unmeasured(values), doubt * bool(count), f" {on_controller}" * bool(through), estimated])


def stiffness_estimate(values: Values) -> str:
    """Say how much deflection remains if the stiffness is only estimated; empty if it is known.

    Args:
        values: the document of the conversion.
    """
    return estimated_stiffness(values["expected_remaining_fraction"], values["max_error_before_mm"])


def _unmeasured(values: Values) -> str:
    """Return a sentence, after a blank, on how many lines or arcs have no known ends and count in no figure; or empty.

    Args:
        values: the document of the conversion.
    """
    count = values["unmeasured_statements"]
    what = f"{count} lines or arcs are" if count > 1 else "1 line or arc is"
    return f" {what} in no figure: where they begin or end is not known." if count else ""


def shown_on_the_arm(document: Values, tolerance_mm: float) -> bool:
    """Tell whether a tolerance [mm] is kept on the real arm: by remaining deviation plus the fitted model's 95 % error.

    False for a model that was not fitted. The deviation is that in welds, if there are any.

    Args:
        document: that of the conversion.
    """
    known, after = document["expected_accuracy"], document["max_arc_error_after_mm"]
    after = document["max_error_after_mm"] if after is None else after
    return known is not None and after + known["within_95_percent_mm"] <= tolerance_mm


def unsteady_deviations(document: Values) -> list[str]:
    """List, as phrases, deviations above the tolerance at changes of speed and at jumps of the correction.

    Args:
        document: that of the conversion.
    """
    places = (("max_transient_mm", "while the speed changes"), ("max_transition_mm", "where the correction jumps"))
    return [f"{document[key]:.3f} mm {where}" for key, where in places if document[key] > document["tolerance_mm"]]


def _main_figures(document: Values) -> tuple[str, str]:
    """Return which figures count, as prefix of their keys and words for where: in welds if there are any, else all.

    Args:
        document: that of the conversion.
    """
    return ("arc_", "while the arc burns") if document["max_arc_error_after_mm"] is not None else ("", ALONG)
