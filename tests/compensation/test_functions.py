"""Functions in expressions: what they write is not known afterwards, and what else they do stays in the program."""

from __future__ import annotations

import pytest

from tests.compensation.build import convert, module, target, written

A, B, C = target(1300, -500), target(1350, -450), target(1290, -440, 730)
DATA = f"  CONST robtarget a:={A};\n  CONST robtarget b:={B};\n  VAR robtarget q;\n  VAR num x:=0;\n  VAR bool ok;\n  VAR string s;\n"
MOVES = f"MoveJ {C},v200,fine,tT;\nMoveL Offs(a,0,0,x),v50,fine,tT;\nMoveL Offs(b,0,0,x),v50,fine,tT;\n"


@pytest.mark.parametrize(
    "call",
    [
        "ok:=StrToVal(s,x);",
        "IF StrToVal(s,x) TPWrite s;",
        "ok:=LibraryRead(s,x);",
        "WaitGI giPart\\GT,3\\MaxTime:=5\\ValueAtTimeout:=x;",
        "WaitDI diReady,1\\MaxTime:=5\\TimeFlag:=ok;\nIF ok THEN\n  TPReadNum x,s;\nENDIF",
        "TPWrite s+ValToStr(LibraryRead(s,x));",
        "WHILE NOT StrToVal(s,x) DO\n  WaitTime 1;\nENDWHILE",
    ],
)
def test_what_a_function_may_write_is_not_known(call: str) -> None:
    """Else the target would be replaced by numbers with x = 0."""
    found = convert(module(DATA, f"x:=0;\n{call}\n{MOVES}"))
    assert [o.status for o in found.outcomes] == ["compensated", "skipped", "skipped"]
    assert any(word in (found.outcomes[1].reason or "") for word in ("may be written by `", "`x` depends on"))
    assert written(found).count("(a,0,0,x)") == 1


@pytest.mark.parametrize("call", ["TPWrite s\\Num:=StrFind(s,1,s);", 'TPWrite "x(x)";', "ok:=StrMemb(s,1,s);"])
def test_functions_that_read_leave_what_they_are_given(call: str) -> None:
    found = convert(module(DATA, f"x:=0;\n{call}\n{MOVES}"))
    assert [o.status for o in found.outcomes] == ["compensated"] * 3


@pytest.mark.parametrize(
    "call", ["UINumEntry()", "ReadNum(ioDev)", "GetModalPayLoadMode()", "TestSignRead(1)", "GInput(gi1)"]
)
def test_functions_of_the_controller_are_known_at_run_time_alone(call: str) -> None:
    found = convert(
        module(DATA, f"MoveJ {C},v200,fine,tT;\nMoveL Offs(a,0,0,{call}),v50,fine,tT;\nMoveL b,v50,fine,tT;")
    )
    assert [o.status for o in found.outcomes] == ["compensated", "skipped", "compensated"]
    assert found.outcomes[1].reason == f"`{call.split('(')[0]}` is known only at run time"


STEP = "  FUNC bool further()\n    x:=x+25;\n    RETURN TRUE;\n  ENDFUNC\n"


@pytest.mark.parametrize(
    "call", ["ok:=further();", "TPWrite ValToStr(further());", "IF further() TPWrite s;", "note further();"]
)
def test_the_next_turn_finds_what_a_function_has_written(call: str) -> None:
    note = "  PROC note(bool known)\n    TPWrite s;\n  ENDPROC\n"
    found = convert(module(DATA, f"x:=0;\nWHILE DInput(di1)=1 DO\n{MOVES}{call}\nENDWHILE", STEP + note))
    assert [o.status for o in found.outcomes] == ["compensated", "skipped", "skipped"]


@pytest.mark.parametrize("act", ["WaitDI diReady,1;", "x:=x+1;", "Incr x;", "note;", "SetDO doPart,1;"])
@pytest.mark.parametrize("move", ["MoveL next(b),v50,fine,tT;", "go next(b);"])
def test_a_function_that_does_more_than_calculate_stays_in_the_program(act: str, move: str) -> None:
    """Numbers in its place would take away the wait, and a target that is added would move before it."""
    more = f"  FUNC robtarget next(robtarget p)\n    {act}\n    RETURN Offs(p,0,0,20);\n  ENDFUNC\n"
    more += "  PROC note()\n    TPWrite s;\n  ENDPROC\n  PROC go(robtarget p)\n    MoveL p,v50,fine,tT;\n  ENDPROC\n"
    found = convert(module(DATA, f"MoveJ {C},v200,fine,tT;\nMoveL a,v50,fine,tT;\n{move}", more))
    assert "next(b)" in written(found)
    told = "`next` does more than calculate: assign what it gives before the move"
    assert next(o.reason for o in found.outcomes if o.status == "skipped") == told
    assigned = convert(
        module(DATA, f"MoveJ {C},v200,fine,tT;\nMoveL a,v50,fine,tT;\nq:=next(b);\nMoveL q,v50,fine,tT;", more)
    )
    assert "q:=next(b);" in written(assigned)
    assert [o.status for o in assigned.outcomes][:3] == ["compensated"] * 3


def test_a_function_that_calculates_gives_way_to_numbers() -> None:
    more = "  FUNC robtarget next(robtarget p)\n    VAR num n;\n    n:=20;\n    Incr n;\n    RETURN Offs(p,0,0,n);\n  ENDFUNC\n"
    found = convert(module(DATA, f"MoveJ {C},v200,fine,tT;\nMoveL a,v50,fine,tT;\nMoveL next(b),v50,fine,tT;", more))
    assert [o.status for o in found.outcomes] == ["compensated"] * 3
