"""The page of a compensated program: what it was off, what remains, where the targets moved, every statement."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from postproc.arrays import Array
from postproc.compensate.path.deviation import Deviation
from postproc.compensate.results.document import elsewhere
from postproc.convert import Conversion
from postproc.report.charts import course
from postproc.report.document import plain
from postproc.report.figures import chosen, enlargement, plane_views
from postproc.report.page import Section, first_rows, made_section, render_page
from postproc.report.svg import BLUE, RED

COLUMNS = ("line", "routine", "instruction", "status", "moved by [mm]", "remains [mm]", "why")


def compensation_page(name: str, found: Conversion, made: Mapping[str, str] | None = None) -> str:
    """HTML of a conversion.

    Args:
        name: of the program. made: with which model, loads and choices.
    """
    document = plain(found.report)
    sections: list[Section] = []
    key: dict[str, object] = {}
    if found.plan is not None:
        key = {
            "before": document["max_error_before_mm"],
            "after": document["max_error_after_mm"],
            "tolerance": document["tolerance_mm"],
            "the model is sure to (95 %)": (document["expected_accuracy"] or {}).get("within_95_percent_mm"),
            "targets added": document["added_targets"],
            "statements not proved": document["unproved_statements"] or None,
            "cycle time": f"{document['cycle_time_s']:.1f} s",
        }
        sections += [_course(found), _where(found)]
    rows = document["statements"]
    if document["diagnostics"]:
        findings = [(d["line"], d["severity"], d["code"], d["message"], d["help"]) for d in document["diagnostics"]]
        columns = ("line", "", "code", "what", "what to do")
        sections.append(Section("Findings", *first_rows(columns, findings)))
    skipped = [(row["line"], row["routine"], row["reason"]) for row in rows if row["status"] == "skipped"]
    if skipped:
        sections.append(Section("Left as they are", *first_rows(("line", "routine", "why"), skipped)))
    if rows:
        sections.append(Section("Every motion statement", *first_rows(COLUMNS, [_row(r) for r in rows])))
    sections.append(made_section({**({"arm": document["robot"]} if found.plan is not None else {}), **(made or {})}))
    return render_page(f"postproc compensate {name}", _sentence(document, bool(found.outputs)), sections, document, key)


def _sentence(document: Mapping[str, Any], written: bool) -> str:
    if not written:
        return "The program is not safe to compensate; no program was written."
    if not any(row["status"] == "compensated" for row in document["statements"]):
        return "Nothing was corrected."
    fell = f"{document['max_error_before_mm']:.3f} mm to {document['max_error_after_mm']:.3f} mm"
    if document["max_arc_error_after_mm"] is not None:
        arc = f"{document['max_arc_error_before_mm']:.3f} mm to {document['max_arc_error_after_mm']:.3f} mm"
        fell = f"{arc} while the arc burns, and with moves in the air from {fell}"
    beside = elsewhere(document)
    count = document["unproved_statements"]
    doubt = f" {count} of these statements also run where they cannot be followed: what remains there is not proved."
    end = f".{doubt if count else ''}"
    if not beside:
        return f"The largest deviation falls from {fell}{end}"
    return f"At steady speed the deviation falls from {fell}; there remain up to {' and '.join(beside)}{end}"


def _course(found: Conversion) -> Section:
    """Deviation from the programmed lines and arcs over the time of the program, before and after."""
    assert found.plan is not None and found.before is not None and found.after is not None
    limit = found.report["tolerance_mm"]
    charts = [
        course(t, y, "time [s]", "mm", limit=limit, color=color, title=title)
        for deviation, color, title in (
            (found.before, RED, "as programmed"),
            (found.after, BLUE, "as corrected"),
        )
        for t, y in [_over_time(found, deviation)]
        if len(t)
    ]
    note = (
        "Distance of the real torch from the line or arc of each statement, at its start and end from these points. "
        f"The dashed line is the tolerance, {limit:g} mm. Joint moves have no programmed curve and are left out."
    )
    return Section("How far the torch is off along the way", "".join(charts), note)


def _over_time(found: Conversion, deviation: Deviation) -> tuple[Array, Array]:
    assert found.plan is not None
    timeline = found.plan.motion.timeline
    t = timeline.at(timeline.t, deviation.owner + deviation.u)
    rows = deviation.space
    return t[rows], 1e3 * deviation.distance[rows]


def _where(found: Conversion) -> Section:
    assert found.plan is not None
    samples = found.plan.motion.samples
    T_work_goal = samples.curves.mounts.work(found.plan.exact.T_base_flange)
    way = samples.T_work_tcp[:, :3, 3]
    position = way[samples.goal]
    shift = T_work_goal[:, :3, 3] - position
    rows = chosen(shift)
    times = enlargement(position, shift)
    note = f"The way of the torch, and by how much each target moved, drawn {times:g} times as long."
    if len(rows) < len(shift):
        note += f" {len(rows)} of {len(shift)} targets are drawn, those that moved most among them."
    step = -(-len(way) // 5000)
    return Section("Where the targets moved", plane_views(position[rows], shift[rows], times, way[::step]), note)


def _row(row: Mapping[str, Any]) -> list[object]:
    keys = ("line", "routine", "instruction", "status", "shift_mm", "residual_mm", "reason")
    return [row[key] for key in keys]
