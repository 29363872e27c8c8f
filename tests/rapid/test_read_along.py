"""Declarations near a program of what it lacks: which are taken, and which are not."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from postproc.diagnostics import Source
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import OtherTaskData, read_program
from postproc.rapid.program.read_along import ReadAlong, read_along
from tests.rapid.build import module, places, target

P = f"p:={target(500, 0, 400)};"
OTHER = f"p:={target(700, 0, 400)};"
MOVE = module("MoveL p,v5,z0,tool0;")


def lent(own: bytes, same: Sequence[str], other: Sequence[str] = ()) -> ReadAlong:
    """What is read along with a program, from files of its own task and from files of other tasks."""
    files, foreign = (
        [Source(f"{name}{i}.mod", text.encode("latin-1")) for i, text in enumerate(texts)]
        for name, texts in (("same", same), ("other", other))
    )
    return read_along(read_program(Source("own.mod", own)), lambda name: (files, foreign))


def followed(own: bytes, along: ReadAlong) -> list[MotionEvent]:
    """Motions of the program with what is read along."""
    return walk(
        read_program([Source("own.mod", own), *along.sources], other_tasks=OtherTaskData(read_along=along.written))
    )


def near(data: str, body: str = "", name: str = "Near") -> str:
    return f"MODULE {name}\n  {data}\n  PROC rNear()\n    {body}\n  ENDPROC\nENDMODULE\n"


STATION = """MODULE B
  RECORD station
    robtarget place;
    count n;
  ENDRECORD
  ALIAS num count;
  CONST num half:=250;
  CONST extjoint xNone:=[9E9,9E9,9E9,9E9,9E9,9E9];
ENDMODULE
"""
MOVES = {
    "": "MoveL p,v5,z0,tool0;",
    "of its own": f"VAR robtarget {P} MoveL p,v5,z0,tool0;",
    "by record": "VAR station st:=[[[a,0,400],[0,1,0,0],[0,0,0,0],xNone],1]; MoveL st.place,v5,z0,tool0;",
}
SAME, ELSEWHERE = (
    "`same0.mod` near it is read along: it declares `p`",
    "`other0.mod` near it is read along: it declares `p`",
)
RECORD = ["`same0.mod` near it is read along: it declares `a`, `twice`"]
RECORD += ["`same1.mod` near it is read along: it declares `count`, `half`, `station`, `xNone`"]
DIFFER = "`same0.mod` and `same1.mod` near it declare different values of `p`: none is taken"
SPACED = near(f"CONST robtarget {P.replace(',', ', ')}", name="B")
# Own declarations and motion, files of the same task, files of other tasks, what is said; nothing where none is taken.
ROWS: list[tuple[str, str, list[str], list[str], list[str]]] = [
    ("", "", [near(f"CONST robtarget {P}")], [], [SAME]),
    ("", "", [near(f"TASK PERS robtarget {P}")], [], [SAME]),
    ("", "", [near(f"CONST robtarget {P}")], [near(f"PERS robtarget {OTHER}", name="Far")], [SAME]),
    ("", "", [], [near(f"PERS robtarget {P}")], [ELSEWHERE]),
    ("PERS robtarget p;", "", [], [near(f"PERS robtarget {P}")], [ELSEWHERE]),
    ("", "", [near(f"PERS robtarget {P}", name="A"), SPACED], [], [SAME]),
    ("", "by record", [near("LOCAL CONST num twice:=2*half; CONST num a:=twice;", name="A"), STATION], [], RECORD),
    ("", "", [near(f"PERS robtarget {P}", name="A"), near(f"CONST robtarget {OTHER}", name="B")], [], [DIFFER]),
    ("", "", [], [near(f"TASK PERS robtarget {P}")], []),
    ("", "", [], [near(f"CONST robtarget {P}")], []),
    ("", "", [], [near(f"VAR robtarget {P}")], []),
    (f"PERS robtarget {P}", "", [near(f"CONST robtarget {OTHER}")], [], []),
    (f"LOCAL CONST robtarget {P}", "", [near(f"CONST robtarget {OTHER}")], [], []),
    ("", "of its own", [near(f"CONST robtarget {OTHER}")], [], []),
    ("PERS robtarget p;", "", [near(f"CONST robtarget {P}")], [], []),
    ("PERS robtarget p;", "", [], [near("PERS num p:=5;")], []),
]


@pytest.mark.parametrize(("data", "move", "same", "other", "messages"), ROWS)
def test_what_is_taken_moves_the_arm_and_is_said(
    data: str, move: str, same: list[str], other: list[str], messages: list[str]
) -> None:
    own = module(MOVES[move], data)
    along = lent(own, same, other)
    assert [d.message for d in along.findings] == messages
    assert (along == ReadAlong()) is (not messages)
    if along.sources:
        assert places(followed(own, along)) == [(500, 0, 400)]


NOT_SEEN = [
    near(f"LOCAL PERS robtarget {P}"),
    near("PERS robtarget p;"),
    near("", f"VAR robtarget {P}"),  # of a routine
    near(f"PERS robtarget {P}", "IF TRUE THEN"),  # cannot be parsed
    near(f"PERS robtarget {P} PERS robtarget {OTHER}"),  # nor loaded
    near(f"PERS robtarget {P}", name="m"),  # another version of the program's own module
    "no RAPID at all: PERS robtarget " + P,
]


@pytest.mark.parametrize("text", NOT_SEEN)
def test_data_that_the_program_would_not_see_is_not_taken(text: str) -> None:
    assert lent(MOVE, [text]) == lent(MOVE, [], [text]) == ReadAlong()


def test_a_copy_holds_nothing_but_what_is_read_along() -> None:
    (copy,) = lent(MOVE, [near(f"PERS robtarget {P}")]).sources
    assert copy.read_only and copy.data.split() == f"MODULE Near PERS robtarget {P} ENDMODULE".encode().split()


@pytest.mark.parametrize(
    ("data", "body", "written"),
    [
        ("PERS num n:=5;", "n:=7;", True), ("PERS num n:=5;", "rOther n;", True), ("VAR num n:=5;", "", True),
        ("PERS num n:=5;", "k:=n;", False), ("CONST num n:=5;", "rOther n;", False),
    ],
)  # fmt: skip
def test_what_routines_near_it_write_is_assumed(data: str, body: str, written: bool) -> None:
    own = module("MoveL Offs(q,0,0,n),v5,z0,tool0;", f"CONST robtarget q:={target(500, 0, 400)};")
    (event,) = followed(own, lent(own, [near(f"{data} PERS num k:=1;", body)]))
    assert bool(event.assumed) is written and places([event]) == [(500, 0, 405)]
