"""Targets that look jogged with this arm, corrections that may not help, motions that take hours: one warning each."""

from __future__ import annotations

from postproc.compensation.conversion import Conversion
from postproc.results.conversion import conversion_document
from tests.build import AXES, convert, module


def target(x: str, y: str, z: str) -> str:
    return f"[[{x},{y},{z}],[0.300294,-0.015738,0.95241,0.049914],[-1,0,-1,0],{AXES}]"


JOGGED = [("0.37", "1.25", "700.1"), ("80", "-0.48", "699.95"), ("151.22", "0.5", "700")]


def program(places: list[tuple[str, str, str]]) -> str:
    moves = (f"MoveL {target(*place)},v100,fine,tT\\WObj:=wT;" for place in places)
    return module("", "\n".join(moves))


def warned(found: Conversion, code: str) -> list[str]:
    return [d.message for d in found.diagnostics if d.code == code and d.severity == "warning"]


def test_a_motion_that_takes_hours_is_named() -> None:
    text = program(JOGGED).replace("v100,fine", "[0.01,500,5000,1000],fine", 2)
    found = convert(text)
    (said,) = warned(found, "CMP025")
    assert said == "this motion alone takes more than an hour, programmed at 0.01 mm/s"
    hours = found.report["cycle_time_s"] / 3600
    assert hours > 2 and f"cycle time {hours:.1f} h" in conversion_document("m", found).basis
    assert warned(convert(program(JOGGED)), "CMP025") == []


SEAM = r"""MoveJ p1,v500,fine,tT\WObj:=wT;
    ArcLStart Offs(p1,nShift,0,0),v100,sm,wd,fine,tT\WObj:=wT;
    ArcLEnd Offs(p2,nShift,0,0),v100,sm,wd,fine,tT\WObj:=wT;
    MoveL p2,v500,fine,tT\WObj:=wT;"""
DATA = (
    f"CONST robtarget p1:={target('0', '0', '700')};\nCONST robtarget p2:={target('120', '0', '700')};\nVAR num nShift;"
)


def test_a_program_of_which_no_weld_was_corrected_says_so() -> None:
    lost = convert(module(DATA, f"nShift:=AInput(ai1);\n{SEAM}"))
    sentence = conversion_document("m", lost).sentence
    assert sentence.startswith("No weld was corrected: ")
    assert (lost.report["weld_statements"], lost.report["corrected_weld_statements"]) == (2, 0)
    done = convert(module(DATA, f"nShift:=1;\n{SEAM}"))
    assert not conversion_document("m", done).sentence.startswith("No weld")
    assert (done.report["weld_statements"], done.report["corrected_weld_statements"]) == (2, 2)
