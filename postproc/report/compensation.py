"""The page of a compensated program."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from postproc.report.document import plain
from postproc.report.page import Section, render_page, table
from postproc.report.svg import scatter


def compensation_page(name: str, document: Mapping[str, Any]) -> str:
    """HTML from the ``postproc/compensate/1`` document of a program."""
    document = plain(document)
    before, after = document.get("max_error_before_mm"), document.get("max_error_after_mm")
    rows = document["statements"]
    done = [row for row in rows if row["status"] == "compensated"]
    skipped = [row for row in rows if row["status"] == "skipped"]
    sentence = "Nothing was corrected." if rows else "The program is not safe to compensate; nothing was written."
    if done and before is not None and after is not None:
        sentence = f"The largest deviation falls from {before:.2f} mm to {after:.3f} mm."
        transient = document.get("max_transient_mm") or 0.0
        if transient > document.get("tolerance_mm", transient):
            steady = f"At steady speed the deviation falls from {before:.2f} mm to {after:.3f} mm"
            sentence = f"{steady}; while the speed changes up to {transient:.3f} mm remain."
    sections: list[Section] = []
    if done:
        line, shift, residual = (
            np.array([np.nan if row[key] is None else row[key] for row in done], dtype=float)
            for key in ("line", "shift_mm", "residual_mm")
        )
        charts = scatter(line, shift, "line of the program", "shift [mm]", size=(500, 240))
        charts += scatter(line, residual, "line of the program", "remaining [mm]", size=(500, 240))
        note = f"{document['added_targets']} targets were added; the program takes {document['cycle_time_s']:.1f} s."
        sections.append(Section("How far targets moved, and what remains at them", charts, note))
    if skipped:
        reasons = [(row["line"], row["routine"], row["reason"]) for row in skipped]
        sections.append(Section("Left alone", table(("line", "routine", "why"), reasons)))
    if document["diagnostics"]:
        findings = [(d["line"], d["code"], d["message"], d["help"]) for d in document["diagnostics"]]
        sections.append(Section("Findings", table(("line", "code", "what", "what to do"), findings)))
    keys = ("line", "routine", "status", "shift_mm", "residual_mm", "reason")
    if rows:
        sections.append(Section("Every motion statement", table(keys, [[row[key] for key in keys] for row in rows])))
    return render_page(f"postproc compensate {name}", sentence, sections, document)
