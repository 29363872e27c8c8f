"""What stays as it is: seams that are never corrected in part, statements that cannot be run, and the way out of each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.reading import IN_SEAM, OUT_OF_REACH
from postproc.diagnostics import Source
from postproc.results.conversion import conversion_document
from tests.build import codes, convert, module, target
from tests.compensation.build import PROCESS, errors, found, small, statuses

HULL = (Path(__file__).parents[2] / "samples" / "hull_seam.mod").read_bytes()
MISTYPED = HULL.replace(b"ArcL pSeam40", b"ArcL pSeam4o")
LOOSE = {"tolerance_m": 1e-4, "air_tolerance_m": 2e-4}


def test_a_seam_with_a_typing_error_stays_as_it_is() -> None:
    """Its targets keep their numbers; what is derived from them in the air is corrected in its own amounts."""
    conversion = convert(MISTYPED, **LOOSE)
    (stop,) = found(conversion, "CMP020")
    assert conversion.exit_code == 0 and stop.severity == "warning" and "pSeam4o" in stop.message
    assert "--allow-partial" in stop.help
    seam = [line for line in MISTYPED.splitlines() if b"ArcL" in line or b"robtarget pSeam" in line]
    assert set(seam) <= set((conversion.output or b"").splitlines())
    (line,) = [i for i, text in enumerate(MISTYPED.splitlines(), 1) if b"pSeam4o" in text]
    welds = [o for o in conversion.outcomes if o.statement.signature.phase]
    assert {o.status for o in welds} == {"skipped"}
    assert sum(f"for line {line} cannot be corrected: `pSeam4o`" in str(o.reason) for o in welds) == len(welds) - 1
    assert codes(conversion).count("CMP005") == 1
    assert {o.status for o in conversion.outcomes if o not in welds} == {"compensated", "unchanged"}


def test_a_seam_is_corrected_in_part_where_that_is_asked_for() -> None:
    conversion = convert(MISTYPED, allow_partial=True, **LOOSE)
    assert conversion.exit_code == 0 and conversion.outputs
    assert [d.severity for d in found(conversion, "CMP020")] == ["warning"]
    assert conversion.report["welds"][0]["left"] == 1


def test_the_seam_is_told_by_its_lines() -> None:
    conversion = convert(HULL, **LOOSE)
    (seam,) = conversion.report["welds"]
    lines = HULL.decode("latin-1").splitlines()
    assert "ArcLStart" in lines[seam["line_from"] - 1] and "ArcLEnd" in lines[seam["line_to"] - 1]
    assert seam["length_mm"] == pytest.approx(1380.0, abs=3.0)
    assert seam["before_mm"] > 1.0 and seam["after_mm"] <= 0.01 and seam["left"] == 0
    assert "CMP021" not in codes(conversion)


def test_the_scope_of_welds_leaves_moves_in_the_air() -> None:
    conversion = convert(HULL, scope="welds", **LOOSE)
    status = {a.text: o.status for o in conversion.outcomes if (a := o.statement.argument("to"))}
    assert status["pSeam50"] == "compensated" and status["pAbove"] == "unchanged"
    assert conversion.report["max_arc_error_after_mm"] <= 0.01


@pytest.mark.parametrize(
    ("instruction", "words"),
    [(b"ArcLEnd", "is not ended"), (b"ArcLStart", "nothing on the way here starts the arc")],
)
def test_a_seam_without_start_or_end_is_told(instruction: bytes, words: str) -> None:
    doubts = found(convert(HULL.replace(instruction + b" ", b"ArcL "), **LOOSE), "CMP021")
    assert doubts and all(d.severity == "warning" for d in doubts)
    assert words in doubts[0].message


def test_a_seam_ends_with_its_routine() -> None:
    """An arc that one routine does not put out is a seam of its own, and so is what the next one burns."""
    more = (
        f"PROC one() ArcLStart a,{PROCESS},fine,tT; ArcL g,{PROCESS},z1,tT; ENDPROC\n"
        f"PROC two() ArcL a,{PROCESS},z1,tT; ArcLEnd g,{PROCESS},fine,tT; ENDPROC"
    )
    conversion = convert(small("MoveJ a,v300,fine,tT; one; two;", "a 1300 -500, g 1350 -430", more=more))
    assert [weld["name"] for weld in conversion.report["welds"]] == ["one", "two"]


DOWN, E9 = "[0,0,1,0]", "[9E9,9E9,9E9,9E9,9E9,9E9]"
OUT = f"""CONST robtarget pA:=[[1500,100,900],{DOWN},[0,0,0,0],{E9}];
CONST robtarget pB:=[[1500,-100,900],{DOWN},[-1,0,-1,0],{E9}];
CONST robtarget pMid:=[[1500,0,900],{DOWN},[0,0,0,0],{E9}];
CONST robtarget pFar:=[[4500,100,900],{DOWN},[0,0,0,0],{E9}];
CONST robtarget pFlip:=[[1576.58,212.87,620.69],[0.2235147,0.0669765,0.9675635,0.0968308],[0,2,-2,1],{E9}];
"""
TO_A, TO_B, TO_FAR = (f"MoveJ {name},v100,fine,tT;" for name in ("pA", "pB", "pFar"))
WELD = f"ArcLStart pA,{PROCESS},fine,tT; ArcL pMid,{PROCESS},z1,tT; ArcLEnd pB,{PROCESS},fine,tT;"


def reaching(body: str, more: str = "", **options: Any) -> Conversion:
    """The conversion of a program whose tool is 300 mm long and which goes to targets in and out of reach."""
    text = small(body, data=OUT, more=more).replace("[[0,0,350],[1,0,0,0]]", "[[0,0,300],[1,0,0,0]]")
    return convert(text, force=(0.0, 0.0, -200.0), **{**LOOSE, **options})


def test_one_bad_target_is_told_with_what_corrects_the_rest() -> None:
    body = f"{TO_A} MoveL pFar,v100,fine,tT; {TO_B}"
    (stop,) = [d for d in reaching(body).diagnostics if d.severity == "error"]
    assert stop.help.endswith("or correct all but such statements: `--allow-partial`")
    conversion = reaching(body, allow_partial=True)
    assert conversion.exit_code == 0 and statuses(conversion) == ["compensated", "skipped", "compensated"]
    assert "RUN007" not in codes(conversion), "nor does the function correct it"


def test_where_nothing_would_be_left_the_rest_is_not_offered() -> None:
    conversion = reaching(TO_FAR)
    assert errors(conversion) and not any("--allow-partial" in d.help for d in conversion.diagnostics)


def test_targets_of_the_run_alone_are_told_with_the_function_that_corrects_them() -> None:
    body = "VAR num n;\nn:=GInput(giX); MoveJ Offs(pA,n,0,0),v100,fine,tT;"
    (stop,) = [d for d in reaching(body).diagnostics if d.severity == "error"]
    assert stop.code == "CMP003" and "`--run-time where-needed` corrects 1 of its motion statements" in stop.help
    assert stop.source is not None and stop.span is not None
    assert stop.source.data[slice(*stop.span)].startswith(b"MoveJ Offs")
    assert reaching(body, run_time="where-needed").exit_code == 0


def test_where_the_arm_reaches_nothing_that_is_the_cause() -> None:
    conversion = reaching("WaitTime 1;", f"PROC rNever() {TO_FAR} ENDPROC")
    stop = conversion.diagnostics[-1]
    assert (stop.code, stop.severity) == ("CMP003", "error") and "cannot reach" in stop.message
    warned = [d for d in conversion.diagnostics if d.severity == "warning" and d.place == stop.place]
    assert warned and all("it is left as it is: nothing leads here" in d.message for d in warned)


@pytest.mark.parametrize("way", ["MoveL pFlip,v100,fine,tT;", TO_B + "MoveL pFlip,v100,fine,tT;"])
def test_errors_that_show_one_after_the_other_are_all_left(way: str) -> None:
    """A target out of reach hides that a way in the air cannot be followed; both are left, and the weld is corrected."""
    conversion = reaching(f"{TO_A} {WELD} {way} {TO_B} {TO_FAR}", allow_partial=True)
    assert errors(conversion) == [] and conversion.exit_code == 0
    assert {"KIN001", "MOT004"} <= {d.code for d in conversion.diagnostics if d.severity == "warning"}
    welds = [o.status for o in conversion.outcomes if o.statement.instruction.startswith("Arc")]
    assert welds == ["compensated"] * 3
    assert {o.reason for o in conversion.outcomes if o.status == "skipped"} == {OUT_OF_REACH}


def test_a_seam_of_which_a_statement_cannot_be_run_stays_whole() -> None:
    """Corrected in part the torch would step aside within the seam; the other seam is corrected."""
    broken = WELD.replace("ArcL pMid", "ArcL pFar")
    conversion = reaching(f"{TO_A} {broken} {TO_A} {WELD}", allow_partial=True)
    assert errors(conversion) == [] and "CMP020" not in codes(conversion)
    assert statuses(conversion) == ["compensated", *["skipped"] * 3, "compensated", *["compensated"] * 3]
    assert [o.reason for o in conversion.outcomes[1:4]] == [IN_SEAM.reason, OUT_OF_REACH, IN_SEAM.reason]


def test_a_motion_that_takes_hours_is_named() -> None:
    text = small("".join(f"MoveL @{{{x},0,700}},v100,fine,tT\\WObj:=wT;" for x in (0, 80, 151)))
    slow = convert(text.replace("v100,fine", "[0.01,500,5000,1000],fine", 2))
    (finding,) = found(slow, "CMP025")
    assert finding.severity == "warning"
    assert finding.message == "this motion alone takes more than an hour, programmed at 0.01 mm/s"
    hours = slow.report["cycle_time_s"] / 3600
    assert hours > 2 and f"cycle time {hours:.1f} h" in conversion_document("m", slow).basis
    assert found(convert(text), "CMP025") == []


@pytest.mark.parametrize(("shift", "corrected"), [("AInput(ai1)", 0), ("1", 2)])
def test_a_program_of_which_no_weld_was_corrected_says_so(shift: str, corrected: int) -> None:
    work = "fine,tT\\WObj:=wT;"
    conversion = convert(
        small(
            f"nShift:={shift}; MoveJ p1,v500,{work} ArcLStart Offs(p1,nShift,0,0),{PROCESS},{work}"
            f"ArcLEnd Offs(p2,nShift,0,0),{PROCESS},{work} MoveL p2,v500,{work}",
            "p1 0 0, p2 120 0",
            "VAR num nShift;",
        )
    )
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
