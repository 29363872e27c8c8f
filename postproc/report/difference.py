"""The page of two programs compared by meaning."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from postproc.report.page import Page, Section, figure, render_page, table

COLUMNS = ("what", "where", "line before", "line after", "name")
AMOUNTS = ("dx [mm]", "dy [mm]", "dz [mm]", "distance [mm]", "angle [deg]")
NOTE = "Targets in the axes of their work object, from the first program to the second; beyond the tolerance."


def difference_page(first: str, second: str, document: Mapping[str, Any]) -> str:
    """HTML of a comparison of programs.

    Args:
        first, second: names of the programs. document: ``postproc/diff/1``, plain values.
    """
    found = document["differences"]
    counts = {kind: sum(d["kind"] == kind for d in found) for kind in ("changed", "added", "removed")}
    said = ", ".join(f"{n} {kind}" for kind, n in counts.items() if n) or "nothing differs"
    sentence = f"Of {document['compared']} motion statements and all others: {said}."
    figures = [
        *figure("largest distance", document["max_distance_mm"]),
        *figure("largest angle", document["max_angle_deg"], unit="deg"),
        *figure("statements that differ", str(len(found))),
    ]
    rows = [_row(d) for d in found]
    sections = [Section("What differs", table("differences", (*COLUMNS, *AMOUNTS, "else"), rows), NOTE)] if rows else []
    assumed = f"Tolerance {document['tolerance_mm']:g} mm and {document['tolerance_deg']:g} deg."
    page = Page(
        title=f"postproc diff {first} {second}",
        sentence=sentence,
        sections=sections,
        document=document,
        figures=figures,
        assumed=assumed,
    )
    return render_page(page)


def _row(d: Mapping[str, Any]) -> list[object]:
    conf = [f"conf {d['conf'][0]} -> {d['conf'][1]}"] if d["conf"] else []
    others = [*conf, *(f"{a['role']}: {a['a'] or '-'} -> {a['b'] or '-'}" for a in d["arguments"])]
    shift = d["shift_mm"] or (None, None, None)
    kind = d["kind"] if d["what"] == "motion" else f"{d['kind']} {d['what']}"
    amounts = [None if x is None else round(x, 4) for x in (*shift, d["distance_mm"], d["angle_deg"])]
    return [kind, d["place"], d["line_a"], d["line_b"], d["name"], *amounts, "; ".join(others)]
