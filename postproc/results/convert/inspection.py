"""What a program moves, where, and what would be left alone and why."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from postproc.compensation.inspection import Inspection, Row
from postproc.compensation.text.values import Place
from postproc.motion.postures import Nearest
from postproc.report.blocks import DataTable, Document, Section, attributes

EDITED_WORDS: Mapping[Place | None, str] = {
    "declaration": "; its declaration is edited",
    "element": "; its array element is edited",
    "aggregate": "; its numbers are edited",
    "argument": "; an offset is written into its argument",
    "call": "; the argument of its call is edited",
    "derived": "; it moves with the target that it is derived from",
    None: "",
}
LONGEST_TEXT = 24  # letters of a target that leave room for its place
PLACE_COLUMNS = ("line", "routine", "instruction", "target", "x", "y", "z [mm]")
INSPECTION_COLUMNS = (*PLACE_COLUMNS, "tool, load, frame; what is edited", "note", "left alone")


def inspection_document(
    name: str, inspection: Inspection, stated: Mapping[str, str], converted: Mapping[str, Any] | None = None
) -> Document:
    """Describe what a program moves, for terminal and page.

    Args:
        name: of the program. stated: entries of the document that say which arm it is, and what names it.
        converted: the document of its conversion with a model of the arm, whose welds are taken over.
    """
    ends = filter(None, (_start(inspection.start), *map(_nearest, inspection.nearest)))
    rows = DataTable("statements", INSPECTION_COLUMNS, [_row(row) for row in inspection.rows], beneath=8, decimals=1)
    return Document(
        title=f"postproc inspect {name}",
        values={
            "schema": "postproc/inspect/1",
            **stated,
            "statements": [_values(row) for row in inspection.rows],
            "nearest": [_nearest_values(near) for near in inspection.nearest],
            **{key: value for key, value in (converted or {}).items() if key in ("welds", "tolerance_mm")},
            "diagnostics": [d.as_json() for d in inspection.diagnostics],
        },
        sentence="" if inspection.rows else "no motion statements",
        sections=[Section("", [rows, *ends])],
    )


def _row(row: Row) -> tuple[object, ...]:
    """Return the row of a statement in the table."""
    place = (None,) * 3 if row.position_mm is None else map(float, row.position_mm)
    load = f"{row.tool} {row.payload_mass:g} kg, {row.wobj}" if row.runs else ""
    axes = "".join(f", eax_{letter} {at:g}" for letter, at in row.external_axes.items())
    times = f", {row.runs} times" if row.runs > 1 else ""
    statement = row.statement
    text = statement.target
    target = text if len(text) <= LONGEST_TEXT else f"{text[: LONGEST_TEXT - 2]}.."
    head = (statement.line, statement.routine, statement.instruction, target, *place)
    return (*head, load + axes + times + EDITED_WORDS[row.edited], "; ".join(row.notes), row.reason)


def _start(row: Row | None) -> str:
    """Return a line on the posture in which the program begins; empty where it is not known."""
    if row is None or row.q_deg is None:
        return ""
    joints = ", ".join(f"{angle:.1f}" for angle in row.q_deg)
    conf = f", confdata [{','.join(map(str, row.confdata))}]" if row.confdata is not None else ""
    return f"start: joints {joints} deg{conf}; line {row.statement.line}, {row.statement.instruction}"


def _nearest(near: Nearest) -> str:
    """Return a line on where a program comes nearest to a joint limit or a singularity."""
    where = f"line {near.statement.line}, {near.statement.instruction}"
    if near.joint is None:
        return f"nearest to a {near.to}: smallest over largest singular value {near.amount:.2f}; {where}"
    return f"nearest to a {near.to}: {near.amount:.1f} deg, joint {near.joint} at {near.angle_deg:.1f} deg; {where}"


def _nearest_values(near: Nearest) -> dict[str, Any]:
    """Return an entry of ``nearest`` of the document."""
    ratio = near.joint is None
    return {
        "to": near.to,
        "distance_deg": None if ratio else near.amount,
        "singular_value_ratio": near.amount if ratio else None,
        **attributes(near, "joint", "angle_deg"),
        **attributes(near.statement, "line", "routine"),
    }


def _values(row: Row) -> dict[str, object]:
    """Return an entry of ``statements`` of the document."""
    return {
        **attributes(row.statement, "line", "routine", "instruction", "target"),
        "runs": row.runs,
        "tool": row.tool or None,
        "wobj": row.wobj or None,
        "payload_kg": row.payload_mass,
        "position_mm": row.position_mm,
        "external_axes": dict(row.external_axes),
        "joints_deg": row.q_deg,
        **attributes(row, "confdata", "notes", "edited", "reason"),
    }
