"""Data that calibration and teach routines set to what stands in the file, because the user states so."""

from __future__ import annotations

import pytest

from postproc.diagnostics import Diagnostic, Source
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.execution.measured import say_measured
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.program.program import read_program

HEAD = """MODULE M
  PERS tooldata t:=[TRUE,[[0,0,350],[1,0,0,0]],[3,[0,0,100],[1,0,0,0],0,0,0]];
  CONST tooldata t0:=[TRUE,[[60,0,300],[1,0,0,0]],[3,[0,0,100],[1,0,0,0],0,0,0]];
  PERS wobjdata w:=[FALSE,TRUE,"",[[500,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS pose off:=[[7,8,9],[1,0,0,0]];
  PERS num nAway:=12;
  CONST robtarget p:=[[900,0,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pTeach:=[[910,20,900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR robtarget pFound;
  PROC main()
    BODY
  ENDPROC
ENDMODULE
"""
GO = r"MoveL p,v100,fine,t\WObj:=w;"
SEARCH = r"SearchL di1,pFound,p,v100,t\WObj:=w;"


def followed(body: str, *taught: str) -> tuple[list[MotionEvent], list[Diagnostic]]:
    program = read_program(Source("m.mod", HEAD.replace("BODY", body).encode()), taught)
    walked = walk_program(program)
    found = [*program.diagnostics, *walked.diagnostics, *say_measured(program, walked.events).values()]
    return walked.events, [d for d in found if d.code in ("RAP023", "RAP034", "RAP035")]


CALIBRATIONS = {
    "tool": ("BEUpdateTcp t;" + GO, "t"),
    "reset, then measured": ("t:=t0; BEUpdateTcp t;" + GO, "t"),
    "in every turn": (f"WHILE TRUE DO {GO} t:=t0; BEUpdateTcp t; ENDWHILE", "t"),
    "where asked": (f"IF DInput(di1)=1 THEN BEUpdateTcp t; ENDIF {GO}", "t"),
    "frame of points": (SEARCH + "w.uframe:=DefFrame(pFound,p,pTeach);" + GO, "w"),
    "one component": (SEARCH + "w.oframe.trans.x:=pFound.trans.x;" + GO, "w"),
    "displacement": (SEARCH + "off.trans:=pFound.trans; PDispSet off;" + GO, "off"),
    "offset": (SEARCH + r"nAway:=pFound.trans.z; MoveL Offs(p,0,0,nAway),v100,fine,t\WObj:=w;", "nAway"),
    "target": (r"pTeach:=CRobT(\Tool:=t\WObj:=w); MoveL pTeach,v100,fine,t\WObj:=w;", "pTeach"),
}


STATED = "if the values in the files are what such routines set, say `--taught {}`"
ADVICE = {  # by whether a search has found the data, and whether it is a work object
    (False, False): STATED,
    (True, True): STATED + " with `--wobj-taught w`",
    (True, False): "a search of this arm holds its error already",
}


@pytest.mark.parametrize("body, name", CALIBRATIONS.values(), ids=CALIBRATIONS)
def test_the_advice_names_what_a_calibration_sets_and_works_when_copied(body: str, name: str) -> None:
    events, found = followed(body)
    assert any(event.reason for event in events if not event.statement.instruction.startswith("Search"))
    (said,) = found
    assert said.code == "RAP023" and said.severity == "warning"
    assert said.help.startswith(ADVICE[SEARCH in body, name == "w"].format(name))
    events, found = followed(body, name)
    assert not found
    last = [event for event in events if event.statement.instruction == "MoveL"][-1]
    assert (last.reason, last.assumed) == (None, ())
    assert last.tool.tframe.trans == (0.0, 0.0, 350.0) and last.wobj.uframe.trans == (500.0, 0.0, 0.0)
    expected = {"off": ((7.0, 8.0, 9.0), (900.0, 0.0, 900.0)), "nAway": ((0.0, 0.0, 0.0), (900.0, 0.0, 912.0))}
    displaced, place = expected.get(name, ((0.0, 0.0, 0.0), (910.0, 20.0, 900.0) if name == "pTeach" else p_place()))
    assert last.displacement.trans == displaced and getattr(last.target, "trans", None) == place


def p_place() -> tuple[float, float, float]:
    return (900.0, 0.0, 900.0)


MOVED = {
    "another value at the end": (f"BEUpdateTcp t; {GO} t:=t0;", "t"),
    "on from bead to bead": (f"WHILE TRUE DO {GO} w.oframe.trans.z:=w.oframe.trans.z+nAway; ENDWHILE", "w"),
    "on by what an input gives": (f"w.oframe.trans.z:=w.oframe.trans.z+GInput(gi1); {GO}", "w"),
    "a counter": (r"MoveL Offs(p,0,0,nAway),v100,fine,t\WObj:=w; Add nAway,4;", "nAway"),
    "on one of two ways": (f"IF DInput(di1)=1 THEN BEUpdateTcp t; ELSE t:=t0; ENDIF {GO}", "t"),
    "in some turns": (f"WHILE DInput(di1)=1 DO {GO} IF DInput(di2)=1 t:=t0; ENDWHILE", "t"),
    "behind a jump": (
        f"again: {GO} t:=t0; IF DInput(di1)=1 GOTO again; IF DInput(di2)=1 GOTO again; BEUpdateTcp t;",
        "t",
    ),
    "another text": (f'w.ufmec:="STN1"; {GO}', "w"),
}


@pytest.mark.parametrize("body, name", MOVED.values(), ids=MOVED)
def test_what_the_program_moves_is_refused_and_not_offered(body: str, name: str) -> None:
    _, found = followed(body, name)
    assert [(d.code, d.severity) for d in found] == [("RAP035", "error")]
    assert f"`{name}`" in found[0].message and f"`--taught {name}`" in (found[0].help or "")
    assert not any("--taught" in (d.help or "") for d in followed(body)[1])


def test_what_is_offered_is_not_refused_where_other_data_is_left_out() -> None:
    """A frame worked out of data that the program moves is moved with it, unless that data is stated, too."""
    body = f"WHILE TRUE DO off.trans:=pFound.trans; w.oframe.trans:=off.trans; {GO} PDispSet off; off:=[t0.tframe.trans,[1,0,0,0]]; {GO} ENDWHILE"
    assert any(d.code == "RAP035" for d in followed(body, "w")[1])
    assert not any("--taught" in (d.help or "") for d in followed(body)[1])


def test_a_known_value_counts_until_it_is_measured_again() -> None:
    events, found = followed(f"t:=t0; {GO} BEUpdateTcp t; {GO}", "t")
    assert [event.tool.tframe.trans[0] for event in events] == [60.0, 0.0] and not found


def test_names_that_fit_nothing_are_said_with_the_nearest() -> None:
    _, found = followed(GO, "pTeech", "pFound", "xyz")
    assert [(d.code, d.message.split("`")[1], d.help) for d in found] == [
        ("RAP034", "pTeech", "did you mean `pTeach`?"),
        ("RAP034", "pFound", "give the file that declares it with a value, or leave it out"),
        ("RAP034", "xyz", "give the file that declares it with a value, or leave it out"),
    ]
