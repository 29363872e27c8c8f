"""What the report says of seams; what a seam or statement that stays looks like is a row of ``corpus/seams.txt``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.compensation.correction.deviation import in_seam_axes
from postproc.compensation.seams import seam_names, seams_of
from postproc.diagnostics import Source
from postproc.rapid.program.program import read_program
from postproc.results.convert.conversion import conversion_document
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


def test_each_seam_has_a_name_of_its_own() -> None:
    """A routine with one seam names it; else lines, the columns of those on one line, and modules of equal routines do."""
    weld = f"ArcLStart p,{PROCESS},fine,tT; ArcLEnd p,{PROCESS},fine,tT;"
    one = f"MODULE A\nPROC rOne()\n{weld}\nENDPROC\nPROC rSome()\n{weld}\n{weld} {weld}\nENDPROC\nENDMODULE"
    two = f"MODULE B\nLOCAL PROC rSome()\n{weld}\nENDPROC\nENDMODULE"
    read = read_program([Source("a.mod", one.encode()), Source("b.mod", two.encode())])
    names = seam_names([seam[0] for seam in seams_of(read.statements)])
    assert names == ["rOne", "A.rSome:6", "A.rSome:7:1", f"A.rSome:7:{len(weld) + 2}", "B.rSome"]


def test_a_seam_of_a_loop_says_how_often_it_runs_and_a_start_alone_is_none() -> None:
    rib = f"ArcLStart Offs(a,0,70*k,0),{PROCESS},fine,tT; ArcLEnd Offs(g,0,70*k,0),{PROCESS},fine,tT;"
    body = f"FOR k FROM 0 TO 2 DO MoveJ Offs(a,0,70*k,50),v300,fine,tT; {rib} ENDFOR ArcLStart a,{PROCESS},fine,tT;"
    rows = [(w["runs"], w["length_mm"]) for w in convert(small(body, "a 1300 -500, g 1325 -500")).report["welds"]]
    assert rows == [(3, 25.0)]


def test_a_deviation_is_split_along_the_seam_sideways_and_along_the_stick_out() -> None:
    """The torch leans forward by 20 degrees; written with the axes of a rotation, without the package's cross products."""
    axes = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    torch = axes @ [np.sin(0.35), 0.0, np.cos(0.35)]
    split = in_seam_axes(np.array([axes @ [1.0, 2.0, -3.0]]), axes[None, :, 0], torch[None])
    assert split[0] == pytest.approx([1.0, 2.0, -3.0], abs=1e-12)
    along = in_seam_axes(np.array([axes @ [1.0, 2.0, -3.0]]), axes[None, :, 0], axes[None, :, 0])[0]
    assert along[0] == pytest.approx(1.0) and np.hypot(*along[1:]) == pytest.approx(np.hypot(2.0, 3.0))


def test_the_parts_of_a_seam_make_up_what_the_arc_sees() -> None:
    (seam,) = convert(HULL, **LOOSE).report["welds"]
    for when in ("before", "after"):
        sideways, stick_out, arc = (seam[f"{part}{when}_mm"] for part in ("sideways_", "stick_out_", ""))
        assert max(sideways, stick_out) <= arc <= np.hypot(sideways, stick_out) + 1e-5
    assert seam["along_before_mm"] > 1.0 > 0.1 > seam["along_after_mm"]


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
