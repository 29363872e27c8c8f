"""Two tolerances and the scope: what welds keeps the strict one, ways in the air add nothing below theirs."""

from __future__ import annotations

import pytest

from postproc.compensation.plan import OUT_OF_SCOPE
from tests.compensation.build import convert, events, independent, lines_of, module, target, written

PLACES = {"p": (1350, -500), "q": (1350, -100), "r": (1150, -500, 850)}
DATA = "".join(f"CONST robtarget {name}:={target(*place)};\n" for name, place in PLACES.items())
SEAM = "ArcLStart p,v100,sm,wd,fine,tT;\nArcLEnd q,v100,sm,wd,fine,tT;"
TEXT = module(
    DATA, f"MoveJ r,v500,fine,tT;\nMoveL Offs(p,0,0,100),v500,z10,tT;\n{SEAM}\nMoveL Offs(p,0,0,100),v500,fine,tT;"
)


def added_before(text: str, output: str) -> dict[str, int]:
    """How many moves more there are of each instruction."""
    count = [[e.statement.instruction for e in events(t)] for t in (text, output)]
    return {name: count[1].count(name) - count[0].count(name) for name in {*count[1]}}


def test_air_moves_get_no_targets_below_their_tolerance() -> None:
    wide, strict = convert(TEXT, air_tolerance_m=2e-4), convert(TEXT)
    assert added_before(TEXT, written(wide)) == {"MoveJ": 0, "MoveL": 0, "ArcLStart": 0, "ArcL": 2, "ArcLEnd": 0}
    assert added_before(TEXT, written(strict))["MoveL"] > 0
    for found, air in ((wide, 0.2), (strict, 0.01)):
        assert found.report["max_arc_error_after_mm"] <= 0.01
        assert found.report["max_error_after_mm"] <= air
        report = independent(TEXT, found)
        assert report.violations == []
        assert max(s.after for s in report.segments if s.welding) <= 0.01
        assert report.after <= air and report.before > 1.0


def test_an_approach_keeps_its_text_within_the_tolerance_of_the_air() -> None:
    """Its correction differs from that of the seam's start by 0.02 mm: `p` carries both."""
    lines = lines_of(written(convert(TEXT, air_tolerance_m=2e-4)))
    assert "MoveL Offs(p,0,0,100),v500,z10,tT;" in lines and "ArcLStart p,v100,sm,wd,fine,tT;" in lines
    assert "MoveL Offs(p,0,0,100),v500,z10,tT;" not in lines_of(written(convert(TEXT)))


def test_a_program_that_never_welds_keeps_the_strict_tolerance_throughout() -> None:
    text = TEXT.replace("ArcLStart p,v100,sm,wd,", "MoveL p,v100,").replace("ArcLEnd q,v100,sm,wd,", "MoveL q,v100,")
    found = convert(text, air_tolerance_m=2e-4)
    assert found.report["max_error_after_mm"] <= 0.01
    assert independent(text, found).after <= 0.01


@pytest.mark.parametrize("scope", ["all", "welds"])
def test_the_scope(scope: str) -> None:
    found = convert(TEXT, scope=scope, air_tolerance_m=2e-4)
    left = [o.statement.instruction for o in found.outcomes if o.reason == OUT_OF_SCOPE]
    assert left == (["MoveJ", "MoveL", "MoveL"] if scope == "welds" else [])
    assert found.report["max_arc_error_after_mm"] <= 0.01
    assert max(s.after for s in independent(TEXT, found).segments if s.welding) <= 0.01
