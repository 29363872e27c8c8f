"""Seams: what is told of each, and that none is written corrected in part."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.convert import compensate_program
from postproc.diagnostics import Source
from postproc.model.file import default_model

HULL = (Path(__file__).parents[2] / "samples" / "hull_seam.mod").read_bytes()


def convert(data: bytes, **options: object) -> Conversion:
    settings = Options(force=(200.0, -200.0, -200.0), inertia=False, **options)  # type: ignore[arg-type]
    return compensate_program(Source("hull.mod", data), default_model(), settings)


def test_a_typing_error_in_a_seam_keeps_the_program_from_being_written() -> None:
    found = convert(HULL.replace(b"ArcL pSeam40", b"ArcL pSeam4o"))
    partial = [d for d in found.diagnostics if d.code == "CMP020"]
    assert found.exit_code == 1 and not found.outputs
    assert [d.severity for d in partial] == ["error"]
    assert "pSeam4o" in partial[0].message


def test_a_partial_seam_is_written_where_that_is_asked_for() -> None:
    found = convert(HULL.replace(b"ArcL pSeam40", b"ArcL pSeam4o"), allow_partial=True)
    assert found.exit_code == 0 and found.outputs
    assert [d.severity for d in found.diagnostics if d.code == "CMP020"] == ["warning"]
    assert found.report["welds"][0]["left"] == 1


def test_the_seam_is_told_by_its_lines() -> None:
    (seam,) = convert(HULL).report["welds"]
    lines = HULL.decode("latin-1").splitlines()
    assert "ArcLStart" in lines[seam["line_from"] - 1] and "ArcLEnd" in lines[seam["line_to"] - 1]
    assert seam["length_mm"] == pytest.approx(1380.0, abs=3.0)
    assert seam["before_mm"] > 1.0 and seam["after_mm"] <= 0.01 and seam["left"] == 0


def test_the_scope_of_welds_leaves_moves_in_the_air() -> None:
    found = convert(HULL, scope="welds")
    status = {o.statement.argument("to").text: o.status for o in found.outcomes if o.statement.argument("to")}  # type: ignore[union-attr]
    assert status["pSeam50"] == "compensated" and status["pAbove"] == "unchanged"
    assert found.report["max_arc_error_after_mm"] <= 0.01


@pytest.mark.parametrize(
    ("instruction", "mistyped", "said"),
    [
        (b"ArcLEnd", b"ArcL", "is not ended"),
        (b"ArcLStart", b"ArcL", "nothing on the way here starts the arc"),
    ],
)
def test_a_seam_without_start_or_end_is_told(instruction: bytes, mistyped: bytes, said: str) -> None:
    assert "CMP021" not in {d.code for d in convert(HULL).diagnostics}
    told = [d for d in convert(HULL.replace(instruction + b" ", mistyped + b" ")).diagnostics if d.code == "CMP021"]
    assert told and all(d.severity == "warning" for d in told)
    assert said in told[0].message
