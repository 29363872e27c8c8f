"""The pages of two programs, and of two folders of them, compared by meaning."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from postproc.report.page import Page, Section, figure, render_page, table

COLUMNS = ("what", "where", "line before", "line after", "name")
AMOUNTS = ("dx [mm]", "dy [mm]", "dz [mm]", "distance [mm]", "angle [deg]", "speed [mm/s]", "was [mm/s]")
FILES = ("file", "result", "changed", "added", "removed", "compared", "distance [mm]", "angle [deg]", "note")
LONGEST = 24  # letters of a name that leave room for the amounts beside it
NOTE = "Targets in the axes of their work object, from the first program to the second; beyond the tolerance."
IN_BOTH = "Files by their path in both folders; added stands in the second alone, removed in the first."


def difference_page(first: str, second: str, document: Mapping[str, Any]) -> str:
    """HTML of a comparison of programs.

    Args:
        first, second: names of the programs. document: ``postproc/diff/1``, plain values.
    """
    found = document["differences"]
    counts = {kind: sum(d["kind"] == kind for d in found) for kind in ("changed", "added", "removed")}
    figures = [
        *figure("largest distance", document["max_distance_mm"]),
        *figure("largest angle", document["max_angle_deg"], unit="deg"),
        *figure("statements that differ", str(len(found))),
    ]
    rows = [_row(d) for d in found]
    sections = [Section("What differs", table("differences", (*COLUMNS, *AMOUNTS, "else"), rows), NOTE)] if rows else []
    sentence = f"Of {document['compared']} motion statements and all others: {_counted(counts)}."
    return _page(f"{first} {second}", sentence, sections, document, figures)


def folders_page(first: str, second: str, document: Mapping[str, Any]) -> str:
    """HTML of a comparison of folders.

    Args:
        first, second: names of the folders. document: ``postproc/diff-folders/1``, plain values.
    """
    files, counts = document["files"], document["counts"]
    figures = [
        *figure("largest distance", max((f["max_distance_mm"] for f in files), default=0.0)),
        *figure("files that differ", str(len(files) - counts["equal"])),
        *figure("statements that differ", str(sum(len(f["differences"]) for f in files))),
    ]
    different = {k: n for k, n in counts.items() if k != "equal"}
    order = sorted(files, key=lambda f: (f["status"] == "equal", f["path"]))
    sections = [Section("Every file", table("files", FILES, [_file_row(f) for f in order]), IN_BOTH)]
    rows = [[f["path"], *_row(d)] for f in order for d in f["differences"]]
    if rows:
        sections.append(Section("What differs", table("differences", ("file", *COLUMNS, *AMOUNTS, "else"), rows), NOTE))
    return _page(f"{first} {second}", f"Of {len(files)} files: {_counted(different)}.", sections, document, figures)


def _page(names: str, sentence: str, sections: list[Section], document: Mapping[str, Any], figures: list[Any]) -> str:
    page = Page(
        title=f"postproc diff {names}",
        sentence=sentence,
        sections=sections,
        document=document,
        figures=figures,
        assumed=f"Tolerance {document['tolerance_mm']:g} mm and {document['tolerance_deg']:g} deg.",
    )
    return render_page(page)


def _counted(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{n} {kind}" for kind, n in counts.items() if n) or "nothing differs"


def _file_row(f: Mapping[str, Any]) -> list[object]:
    known = f["compared"] > 0
    figures = [round(f[key], 4) if known else None for key in ("max_distance_mm", "max_angle_deg")]
    counts = [f[key] for key in ("changed", "added", "removed", "compared")]
    return [f["path"], f["status"], *counts, *figures, f["reason"]]


def _row(d: Mapping[str, Any]) -> list[object]:
    arc = ["at the circle point"] if d["at_circle_point"] else []
    conf = [f"conf {d['conf'][0]} -> {d['conf'][1]}"] if d["conf"] else []
    others = [*arc, *conf, *(f"{a['role']}: {a['a'] or '-'} -> {a['b'] or '-'}" for a in d["arguments"])]
    shift = d["shift_mm"] or (None, None, None)
    kind = d["kind"] if d["what"] == "motion" else f"{d['kind']} {d['what']}"
    amounts = [None if x is None else round(x, 4) for x in (*shift, d["distance_mm"], d["angle_deg"])]
    was, now = d["speed_mm_s"] or (None, None)
    name = d["name"]
    if len(name) > LONGEST:  # a whole statement
        name, others = f"{name[:LONGEST]} ..", [name, *others]
    return [kind, d["place"], d["line_a"], d["line_b"], name, *amounts, now, was, "; ".join(others)]
