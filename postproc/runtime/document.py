"""A module that corrects targets on the controller: what it does over its region, as it was written or checked."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.report.blocks import Document, Section, Values
from postproc.runtime.proof.check import Check
from postproc.runtime.written import RunTimeModule

SCHEMA = "postproc/runtime/1"


def written_document(name: str, robot: str, made: RunTimeModule) -> Document:
    """Describe a module that was written.

    Args:
        name: of its file. robot: of its arm.
    """
    corrected, chord = made.corrected, made.chord
    values = {
        "effects": {"corrected": corrected.keys, "left_out": [*corrected.untold, *corrected.unfit]},
        "checks": [*map(_values, made.checks)],
        "chord_500_mm": {"lines": chord.count, "max_mm": 1e3 * chord.largest_m, "rms_mm": 1e3 * chord.rms_m},
        "diagnostics": [d.as_json() for d in made.diagnostics],
    }
    lines = [*map(str, made.checks), str(chord)]
    return _document(f"write {name}", values, f"{name}: `{robot}`, {made.cost} for one target", lines)


def check_document(name: str, robot: str, check: Check) -> Document:
    """Describe the check of a module.

    Args:
        name: of its file. robot: of its arm.
    """
    values = {"checks": [_values(check)], "diagnostics": []}
    raised = [f"an error leaves the function at {check.raised} targets"] if check.raised else []
    return _document(f"check {name}", values, f"{name}: `{robot}`, {check}", raised)


def _document(title: str, values: Values, sentence: str, lines: Sequence[str]) -> Document:
    """Return the ``postproc/runtime/1`` document with a sentence and further lines.

    Args:
        title: what follows ``postproc runtime`` in the title. values: entries beside the schema.
    """
    return Document(
        title=f"postproc runtime {title}",
        values={"schema": SCHEMA, **values},
        sentence=sentence,
        sections=[Section("", lines)],
    )


def _values(check: Check) -> Values:
    """Return an entry of ``checks`` of the document."""
    return {
        "mass_kg": check.mass,
        "corrected": check.corrected,
        "returned": {str(why): times for why, times in check.returned.items()},
        "errors": check.raised,
        "max_error_mm": 1e3 * check.largest_m,
        "rms_error_mm": 1e3 * check.rms_m,
        "max_correction_mm": 1e3 * check.correction_m,
    }
