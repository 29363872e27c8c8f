"""Seams: what is told of each, and that none is written corrected in part."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.model.file import default_model
from postproc.runtime.passes import correct_program
from tests import build

HULL = (Path(__file__).parents[2] / "samples" / "hull_seam.mod").read_bytes()


def convert(data: bytes, **options: object) -> Conversion:
    settings = Options(force=(200.0, -200.0, -200.0), inertia=False, **options)  # type: ignore[arg-type]
    return correct_program(Source("hull.mod", data), default_model(), settings)


MISTYPED = HULL.replace(b"ArcL pSeam40", b"ArcL pSeam4o")


def test_a_seam_with_a_typing_error_stays_as_it_is() -> None:
    """Its targets keep their numbers; what is derived from them in the air is corrected in its own amounts."""
    found = convert(MISTYPED)
    (stop,) = [d for d in found.diagnostics if d.code == "CMP020"]
    assert found.exit_code == 0 and stop.severity == "warning" and "pSeam4o" in stop.message
    assert "--allow-partial" in stop.help
    seam = [line for line in MISTYPED.splitlines() if b"ArcL" in line or b"robtarget pSeam" in line]
    assert set(seam) <= set(found.output.splitlines())  # type: ignore[union-attr]
    (line,) = [i for i, text in enumerate(MISTYPED.splitlines(), 1) if b"pSeam4o" in text]
    welds = [o for o in found.outcomes if o.statement.signature.phase]
    assert {o.status for o in welds} == {"skipped"}
    assert sum(f"for line {line} cannot be corrected: `pSeam4o`" in str(o.reason) for o in welds) == len(welds) - 1
    assert sum(d.code == "CMP005" for d in found.diagnostics) == 1
    assert {o.status for o in found.outcomes if o not in welds} == {"compensated", "unchanged"}


def test_a_seam_is_corrected_in_part_where_that_is_asked_for() -> None:
    found = convert(MISTYPED, allow_partial=True)
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


def test_a_seam_ends_with_its_routine() -> None:
    """An arc that one routine does not put out is a seam of its own, and so is what the next one burns."""
    data = f"CONST robtarget a:={build.target(1300, -500)};\nCONST robtarget g:={build.target(1350, -430)};"
    first = "ArcLStart a,v100,sm,wd,fine,tT;\n    ArcL g,v100,sm,wd,z1,tT;"
    second = "ArcL a,v100,sm,wd,z1,tT;\n    ArcLEnd g,v100,sm,wd,fine,tT;"
    more = "".join(f"  PROC {name}()\n    {body}\n  ENDPROC\n" for name, body in (("one", first), ("two", second)))
    found = build.convert(build.module(data, "MoveJ a,v300,fine,tT;\none;\ntwo;", more))
    assert [weld["name"] for weld in found.report["welds"]] == ["one", "two"]
