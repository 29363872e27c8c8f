"""A corrected program: what it was off, what remains, where, and what was done about it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from postproc import __version__
from postproc.compensation.results.document import elsewhere, estimated_stiffness
from postproc.convert import Conversion
from postproc.report.blocks import Chart, DataTable, Document, Figure, Scene, Section
from postproc.report.drawing.path import path_data
from postproc.report.page import render

ACROSS = (
    "Distance of the real torch from the line or arc of each statement, measured across it at and between targets; at "
    "targets the tables also count what points along it. Shaded: the arc burns; green: the tolerance. Drag to zoom, "
    "double-click to see all, click to choose a place."
)
IN_SPACE = "Pick a seam, a statement, a line of the program or a place in a picture: all of them show the same place."
ALONG = "along lines and arcs"
FINDING = ("line", "severity", "code", "what", "what to do")
STATEMENT = ("line", "routine", "instruction", "status", "reason")


def conversion_document(name: str, found: Conversion, made: Mapping[str, str] | None = None) -> Document:
    """A conversion of the program that is named.

    Args:
        made: with which model, loads and choices.
    """
    values, moved = found.report, found.plan is not None
    sections = [*_pictures(values)] if moved else [*_statements(values)]
    if values["diagnostics"]:
        findings = [(d["line"], d["severity"], d["code"], d["message"], d["help"]) for d in values["diagnostics"]]
        sections.append(Section("Findings", [DataTable("findings", FINDING, findings)]))
    sections += _run_time(values)
    sections.append(made_section({**({"arm": values["robot"]} if moved else {}), **(made or {})}))
    return Document(
        title=f"postproc compensate {name}",
        values=values,
        sentence=_sentence(values, bool(found.outputs)),
        figures=_figures(values) if moved else (),
        basis=_basis(values, made or {}) if moved else "",
        sections=sections,
        scene=Scene("path", lambda: path_data(found), ("space", "arm", "course", "path")) if moved else None,
    )


def made_section(made: Mapping[str, str]) -> Section:
    """With what a result was made, and by which version."""
    rows = [*made.items(), ("postproc", __version__)]
    return Section("How this was made", [DataTable("how this was made", ("what", "with"), rows)], folded=True)


def _pictures(document: Mapping[str, Any]) -> list[Section]:
    seams = [Chart(lambda: ['<div data-path="seams"></div>'])] if document["welds"] else []
    return [
        Section("Seam by seam", seams, "The largest deviation while the arc burns."),
        Section("Where", [Chart(lambda: [render("path.html.j2")])], IN_SPACE),
        Section("How far off, along the path", [Chart(lambda: ['<div data-path="deviation"></div>'])], ACROSS),
        Section("Every motion statement", [Chart(lambda: ['<div data-path="statements"></div>'])]),
        Section(
            "Joints",
            [Chart(lambda: ['<div data-path="joints"></div>'])],
            "Torques of a rigid arm, under its own weight and the loads.",
        ),
    ]


def _statements(document: Mapping[str, Any]) -> Iterator[Section]:
    """The statements of a program none of whose targets is known before it runs, as a table."""
    rows = [tuple(row[key] for key in STATEMENT) for row in document["statements"]]
    if rows:
        yield Section("Every motion statement", [DataTable("statements", STATEMENT, rows)])


def _figures(document: Mapping[str, Any]) -> list[Figure]:
    """Three: before, after, and what was left uncorrected."""
    arc, where = _welds(document)
    left, through = _count(document, "skipped"), _count(document, "run_time")
    corrected = f"{_count(document, 'compensated')} corrected" + (f", {through} at run time" if through else "")
    return [
        Figure(f"before, {where}", document[f"max_{arc}error_before_mm"], "before"),
        Figure(f"after, {where}", document[f"max_{arc}error_after_mm"], "after"),
        Figure("motion statements", f"{corrected}, {left} left"),
    ]


def _run_time(document: Mapping[str, Any]) -> list[Section]:
    """What the function that corrects on the controller was checked with."""
    found = document.get("run_time")
    if not found:
        return []
    rows = [(key.removesuffix("_mm").replace("_", " "), value) for key, value in found.items() if value is not None]
    note = "What `compensate` found with the function on targets of its region; lengths in mm."
    return [Section("Corrected on the controller", [DataTable("run time", ("what", "value"), rows)], note)]


def _count(document: Mapping[str, Any], status: str) -> int:
    return sum(row["status"] == status for row in document["statements"])


def _basis(document: Mapping[str, Any], made: Mapping[str, str]) -> str:
    """What the result rests on, in a line."""
    known = document["expected_accuracy"]
    sure = (
        f"the fitted model itself is sure to {known['within_95_percent_mm']:.3f} mm (95 %)"
        if known
        else "the model was not fitted to measurements of this arm, so these are deviations in the model"
    )
    before, after = document["max_error_before_mm"], document["max_error_after_mm"]
    air = [f"with moves in the air {after:.3f} mm of {before:.3f} mm remain"] if _welds(document)[0] else []
    parts = [
        f"Arm `{document['robot']}`" + (f", {made['model']}" if "model" in made else ""),
        f"tolerance {document['tolerance_mm']:g} mm, {document['air_tolerance_mm']:g} mm in the air",
        f"scope {document['scope']}",
        f"{document['added_targets']} target{'s' * (document['added_targets'] != 1)} added",
        f"cycle time {document['cycle_time_s']:.1f} s",
        *air,
        sure,
    ]
    return "; ".join(parts) + "."


def _sentence(document: Mapping[str, Any], written: bool) -> str:
    if not written:
        return "The program is not safe to compensate; no program was written."
    through = _count(document, "run_time")
    on_controller = f"{through} motion statements are corrected on the controller, where their targets become known."
    if through and not (_count(document, "compensated") and document["measured_statements"]):
        return on_controller
    if not _count(document, "compensated"):
        return "Nothing was corrected."
    arc, where = _welds(document)
    before, after = document[f"max_{arc}error_before_mm"], document[f"max_{arc}error_after_mm"]
    beside = elsewhere(document)
    steady = " at steady speed" if beside else ""
    fell = f"At most {after:.3f} mm of deviation remain {where}{steady}, where there were {before:.3f} mm"
    fell += f"; up to {' and '.join(beside)}." if beside else "."
    count = document["unproved_statements"]
    doubt = f" {count} of these statements also run where they cannot be followed: what remains there is not proved."
    estimated = f"On the arm: {said}." if (said := estimated_stiffness(document).replace("`", "")) else ""
    parts = [fell, doubt.strip() if count else "", on_controller if through else "", estimated]
    return " ".join(part for part in parts if part)


def _welds(document: Mapping[str, Any]) -> tuple[str, str]:
    """What the key of the figures that count first begins with, and where they hold."""
    return ("arc_", "while the arc burns") if document["max_arc_error_after_mm"] is not None else ("", ALONG)
