"""A corrected program: what it was off, what remains, where, and what was done about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from postproc import __version__
from postproc.compensation.conversion import Conversion, JudgedProgram
from postproc.compensation.judgement.figures import CLAUSES, PlaceFigures, legend
from postproc.compensation.judgement.seams import Seam
from postproc.compensation.text.values import StatementOutcome
from postproc.compensation.verdict import CORRECTED, verdict_of
from postproc.model.uncertainty.undetermined import Undetermined
from postproc.numbers import mm, on_arm_text
from postproc.report.blocks import DataTable, Document, Figure, Scene, Section, Tone, Values, View, attributes
from postproc.report.drawing.path import path_data
from postproc.results.convert.conclusion import conclusion, outcome_note
from postproc.results.convert.conclusion import unknown_accuracy as unknown_accuracy
from postproc.results.convert.figures import decimals, figure_table, is_guess, main_figure
from postproc.results.convert.work_objects import rigid_shift_values, work_object_section
from postproc.robot.pose import rpy_degrees

CONVERSION_SCHEMA = "postproc/compensate/1"
IN_SPACE_NOTE = (
    "Pick a seam, a statement, a line of the program or a place in a picture: all of them show the same place."
)
CHECKED = "What `compensate` found with the function on targets of its region; lengths in mm."
JOINTS_NOTE = "Torques of a rigid arm, under its own weight and the loads."
FINDING_COLUMNS = ("line", "severity", "code", "what", "what to do")
FINDING_KEYS = ("line", "severity", "code", "message", "help")
STATEMENT = ("line", "routine", "instruction", "status", "reason")
DEVIATIONS = {"error_before": "before", "error_after": "after", "arc_error_before": "arc_before"}
DEVIATIONS |= {"arc_error_after": "arc"} | {key: key for key in ("transition", "transient", "joint_move")}
"""Largest deviations of a document by the attributes of `PathFigures`."""
SEAM = ("seam", "lines", "length", "runs", "before", "after", "along before", "along after", "added", "left")
ALONG_NOTE = (
    "The largest deviation that the arc sees, sideways and along the stick-out; along the seam, at its targets. Once a "
    "seam goes on, what lies along it is not seen: it counts where the seam begins and ends."
)


def conversion_document(name: str, conversion: Conversion, made: Mapping[str, str] | None = None) -> Document:
    """Describe the conversion of a program, for terminal and page.

    Args:
        name: of the program. made: what it was converted with (model, loads, options) as label and text.
    """
    values, moved = conversion.report, conversion.plan is not None
    findings, statements = (
        [[row[key] for key in keys] for row in values.get(name, ())]
        for name, keys in (("diagnostics", FINDING_KEYS), ("statements", STATEMENT))
    )
    tone, lines = conclusion(conversion)
    shown = "statements" if moved else ""  # a page shows them beside its picture of the path
    run_time = {key: value for key, value in (values.get("run_time") or {}).items() if value is not None}
    checked = [(key.removesuffix("_mm").replace("_", " "), value) for key, value in run_time.items()]
    facts = {**({"arm": values["robot"]} if moved else {}), **(made or {})}
    return Document(
        title=f"postproc compensate {name}",
        values=values,
        sentence="\n".join(lines),
        tone=tone,
        table=figure_table(values) if moved else None,
        notes=[*filter(None, (legend(values["figures"]), outcome_note(values)))] if moved else (),
        figures=_figures(values) if moved else (),
        basis=_basis(values, made or {}) if moved else "",
        sections=[
            Section("Seam by seam [mm]", [_seam_table(values)], ALONG_NOTE),
            Section("Program", [View("text", chooses=True)] if moved else [], IN_SPACE_NOTE),
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
        "within_95_percent_at_welds_mm": _mm(accuracy.at_work) if figures.arc is not None else None,
        "link_weights_mm": _mm(accuracy.by_weights),
        "beyond_range": list(accuracy.beyond),
        "sigma_parts_mm": _lengths(("parameters", "unexplained"), accuracy.parts)
        | {"noise": model.fit.get("noise_mm")},
    }
    verdict = verdict_of(judged)
    return {
        "schema": CONVERSION_SCHEMA,
        "tool": __version__,
        "robot": model.robot.name,
        "mounting_deg": rpy_degrees(model.R_world_base).tolist(),
        "statements": [*map(_statement_values, judged.outcomes)],
        **{f"max_{key}_mm": _mm(getattr(figures, name)) for key, name in DEVIATIONS.items()},
        "tolerance_mm": _mm(judged.options.tolerance_m),
        "air_tolerance_mm": _mm(judged.air_tolerance_m),
        "figures": judged.figure_values(),
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
        "acceleration_limits": model.robot.acceleration_source,
        "diagnostics": findings,
        "already": list(judged.options.already),
        "expected_on_arm_mm": judged.expected_on_arm_mm,
        **judged.remaining_values(),
        "run_time": judged.run_time and asdict(judged.run_time),
        "rigid_shift": [*map(rigid_shift_values, judged.shifts)],
        "from_programmed_path": judged.drawn and _lengths(("before_mm", "after_mm"), judged.drawn.counting),
        "verdict": verdict.kept,
        "verdict_sentence": verdict.sentence,
    }


def _statement_values(outcome: StatementOutcome) -> Values:
    """Return an entry of ``statements`` of the document."""
    statement = outcome.statement
    return {
        "path": statement.source.path,
        **attributes(statement, "line", "module", "routine", "instruction"),
        **attributes(outcome, "status", "reason", "edited", "conf_changed", "shift_mm", "residual_mm", "along_mm"),
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


def _seam_table(values: Values) -> DataTable:
    """Return the table of seams, for terminal and page; those that do not keep the tolerance are warnings.

    Args:
        values: the document of the conversion.
    """
    seams, digits = values.get("welds", ()), decimals(values)
    keys = ("before_mm", "after_mm", "along_before_mm", "along_after_mm")
    rows = [
        (
            seam["name"],
            f"{seam['line_from']}-{seam['line_to']}",
            seam["length_mm"] or None,
            seam["runs"] if seam["runs"] > 1 else None,
            *(seam[key] for key in keys),
            seam["added_targets"] or None,
            seam["left"] or None,
        )
        for seam in seams
    ]
    tones: list[Tone] = ["" if seam["kept"] and not seam["left"] else "warning" for seam in seams]
    number = (None, None, 0, None, *(digits for _ in keys), None, None)
    return DataTable("seams", SEAM, rows, view="seams", decimals=number, tones=tones)


def made_section(made: Mapping[str, str]) -> Section:
    """Return the folded section that says with what a result was made, and by which version.

    Args:
        made: (model, loads, options) as label and text.
    """
    rows = [*made.items(), ("postproc", __version__)]
    return Section("How this was made", [DataTable("how this was made", ("what", "with"), rows, brief=())], folded=True)


def _figures(values: Values) -> list[Figure]:
    """Return three figures: deviation expected on the arm, before, and after in the model; none without a measured one.

    Args:
        values: the document of the conversion.
    """
    figure, digits = main_figure(values), decimals(values)
    if figure is None:
        return []
    where, expected, after = CLAUSES[figure["place"]], figure["expected_on_arm_mm"], figure["after_mm"]
    limit = float("inf") if figure["tolerance_mm"] is None else figure["tolerance_mm"]
    beyond, on_arm = "beyond" if after > limit else "", on_arm_text(expected, digits, is_guess(values))
    return [
        Figure(f"expected on the arm, {where}", on_arm, "" if expected is None else beyond),
        Figure(f"before, {where}", figure["before_mm"], "before", decimals=digits),
        Figure(f"after in the model, {where}", after, beyond or "after", decimals=digits),
    ]


def _basis(values: Values, made: Mapping[str, str]) -> str:
    """Say what the result rests on: arm, model, tolerances and scope; then what became of the statements.

    Args:
        made: what the program was converted with (model, loads, options) as label and text.
    """
    parts = [
        f"Arm `{values['robot']}`" + (f", {made['model']}" if "model" in made else ""),
        f"tolerance {values['tolerance_mm']:g} mm, {values['air_tolerance_mm']:g} mm in the air",
        f"scope {values['scope']}",
    ]
    limits = (
        f"Cycle time and inertial loads follow from limits of acceleration that are {values['acceleration_limits']}."
    )
    return " ".join(
        filter(None, (f"{'; '.join(parts)}.", f"{outcome_note(values)}.", limits, legend(values["figures"])))
    )


def undetermined_values(known: Undetermined | None) -> Values:
    """Return the entries ``undetermined_under_load_mm`` and ``undetermined_parameter`` of a conversion's document."""
    parameter = known and {
        "parameter": known.name,
        **attributes(known, "value", "sigma"),
        "within_95_percent_mm": mm(known.largest),
        "pull": [] if known.pull is None else known.pull.tolist(),
        "pull_shows_mm": mm(known.pull_displacement),
    }
    within = 0.0 if known is None else mm(known.within_95)
    return {"undetermined_under_load_mm": within, "undetermined_parameter": parameter}
