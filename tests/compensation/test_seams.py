"""What the report says of seams; what a seam or statement that stays looks like is a row of ``corpus/seams.txt``."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.diagnostics import Source
from postproc.results.conversion import conversion_document
from tests.build import codes, convert, module, target
from tests.compensation.build import PROCESS, small

HULL = (Path(__file__).parents[2] / "samples" / "hull_seam.mod").read_bytes()
LOOSE = {"tolerance_m": 1e-4, "air_tolerance_m": 2e-4}


def test_the_seam_is_told_by_its_lines() -> None:
    conversion = convert(HULL, **LOOSE)
    (seam,) = conversion.report["welds"]
    lines = HULL.decode("latin-1").splitlines()
    assert "ArcLStart" in lines[seam["line_from"] - 1] and "ArcLEnd" in lines[seam["line_to"] - 1]
    assert seam["length_mm"] == pytest.approx(1380.0, abs=3.0)
    assert seam["before_mm"] > 1.0 and seam["after_mm"] <= 0.01 and seam["left"] == 0
    assert "CMP021" not in codes(conversion)


def test_a_seam_that_is_corrected_in_part_counts_what_stays() -> None:
    conversion = convert(HULL.replace(b"ArcL pSeam40", b"ArcL pSeam4o"), allow_partial=True, **LOOSE)
    assert conversion.exit_code == 0 and conversion.report["welds"][0]["left"] == 1


def test_a_seam_ends_with_its_routine() -> None:
    """An arc that one routine does not put out is a seam of its own, and so is what the next one burns."""
    more = (
        f"PROC one() ArcLStart a,{PROCESS},fine,tT; ArcL g,{PROCESS},z1,tT; ENDPROC\n"
        f"PROC two() ArcL a,{PROCESS},z1,tT; ArcLEnd g,{PROCESS},fine,tT; ENDPROC"
    )
    conversion = convert(small("MoveJ a,v300,fine,tT; one; two;", "a 1300 -500, g 1350 -430", more=more))
    assert [weld["name"] for weld in conversion.report["welds"]] == ["one", "two"]


def test_a_seam_that_begins_nobody_knows_where_has_no_figure() -> None:
    body = f"MoveJ @{{1300,-500}},v300,fine,tT; p:=CRobT(); ArcLStart p,{PROCESS},fine,tT; ArcLEnd @{{1350,-430}},{PROCESS},fine,tT;"
    (seam,) = convert(small(body, data="VAR robtarget p;"), allow_partial=True).report["welds"]
    assert seam["before_mm"] is None and seam["after_mm"] is None and seam["left"] == 1


def test_hours_of_cycle_time_are_said_in_hours() -> None:
    slow = convert(small("MoveJ @{1350,-500},v100,fine,tT; MoveL @{1350,-420},[0.01,500,5000,1000],fine,tT;"))
    hours = slow.report["cycle_time_s"] / 3600
    assert hours > 2 and f"cycle time {hours:.1f} h" in conversion_document("m", slow).basis


@pytest.mark.parametrize(("shift", "corrected"), [("AInput(ai1)", 0), ("1", 2)])
def test_a_program_of_which_no_weld_was_corrected_says_so(shift: str, corrected: int) -> None:
    weld = f"ArcLStart Offs(p1,nShift,0,0),{PROCESS},fine,tT; ArcLEnd Offs(p2,nShift,0,0),{PROCESS},fine,tT;"
    text = small(f"nShift:={shift}; MoveJ p1,v500,fine,tT; {weld}", "p1 1300 -500, p2 1330 -400", "VAR num nShift;")
    conversion = convert(text)
    sentence = conversion_document("m", conversion).sentence
    assert sentence.startswith("No weld was corrected: ") == (corrected == 0)
    assert [conversion.report[f"{of}weld_statements"] for of in ("", "corrected_")] == [2, corrected]


def test_a_lent_file_that_was_compensated_before_is_found_out() -> None:
    """Statements that use its targets would be corrected twice."""
    program = module("", f"MoveJ {target(1290, -500)},v100,fine,tT;\nMoveL shared,v100,fine,tT;")
    library = module(f"CONST robtarget shared:={target(1300, -500)};", "MoveL shared,v100,fine,tT;")
    library = library.replace("MODULE M", "MODULE Lib").replace("PROC main", "PROC r")
    library = "\n".join(line for line in library.splitlines() if "PERS" not in line or "tT:=" in line)
    program = "\n".join(line for line in program.splitlines() if "tT:=" not in line)
    once = convert(library).outputs["m.mod"]
    assert convert(program, None, [Source("lib.mod", library.encode(), True)]).outputs
    again = convert(program, None, [Source("lib.mod", once, True)])
    ((code, path, help_),) = [(d.code, d.source.path, d.help) for d in again.diagnostics if d.source is not None]
    assert (code, path, help_, again.exit_code) == ("CMP001", "lib.mod", "lend the original", 1)
