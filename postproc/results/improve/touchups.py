"""Targets that were taught anew: what they tell of the arm."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.diagnostics import Diagnostic
from postproc.measure.touchups import TouchUps
from postproc.report.blocks import DataTable, Document, Figure, Section


def touchups_document(
    name: str, touchups: TouchUps, deviation: float | None, findings: Sequence[Diagnostic]
) -> Document:
    """Describe the touch-ups of a program.

    Args:
        name: of both versions, for the title. deviation: standard deviation of a common factor of what the arm yields,
            None where its stiffness is not known. findings: what they cannot tell.
    """
    rows = [
        (use.name, use.event.wobj.name, use.event.statement.line, *use.moved.round(3).tolist(), round(use.distance, 3))
        for use in touchups.rows
    ]
    columns = ("target", "work object", "line", "dx [mm]", "dy [mm]", "dz [mm]", "distance [mm]")
    keys = ("target", "wobj", "line", "dx_mm", "dy_mm", "dz_mm", "distance_mm")
    median = sorted(use.distance for use in touchups.rows)[len(rows) // 2]
    sentence = f"{len(rows)} of {touchups.compared} targets were taught anew, by {median:.2f} mm in the median"
    others = touchups.omitted.total()
    sentence += f"; {others} others changed and give no row." if others else "."
    if deviation is not None and deviation < 1:
        sentence += (
            f" They tell how far the arm yields to ± {100 * deviation:.0f} % of itself, if its joints yield alike."
        )
    note = "From where the nominal program says that the work is to where the target is now, in the work object."
    omitted = DataTable("changed targets", ("targets", "why"), [(n, reason) for reason, n in touchups.omitted.items()])
    return Document(
        title=f"postproc touchups {name}",
        values={
            "schema": "postproc/touchups/1",
            "compared": touchups.compared,
            "touched": len(rows),
            "shifted_together": len(touchups.shifted),
            "omitted": [{"reason": reason, "targets": count} for reason, count in touchups.omitted.items()],
            "deflection_known_to": None if deviation is None or deviation > 1e3 else float(f"{deviation:.3g}"),
            "rows": [dict(zip(keys, row, strict=True)) for row in rows],
            "diagnostics": [finding.as_json() for finding in findings],
        },
        sentence=sentence,
        figures=[Figure("targets taught anew", len(rows))],
        sections=[Section("Touch-ups", [DataTable("touch-ups", columns, rows)], note), Section("No rows", [omitted])],
    )
