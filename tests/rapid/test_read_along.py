"""Declarations near a program of what it lacks: which are taken, and which are not."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from postproc.diagnostics import Source
from postproc.rapid.data.records import RobTarget
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import Elsewhere, read_program
from postproc.rapid.program.read_along import ReadAlong, read_along
from tests.rapid.build import module, target

P = f"p:={target(500, 0, 400)};"
OTHER = f"p:={target(700, 0, 400)};"


def lent(own: bytes, same: Sequence[str], other: Sequence[str] = ()) -> ReadAlong:
    """What is read along with a program, from files of its own task and from files of other tasks."""
    files, foreign = (
        [Source(f"{name}{i}.mod", text.encode("latin-1")) for i, text in enumerate(texts)]
        for name, texts in (("same", same), ("other", other))
    )
    return read_along(read_program(Source("own.mod", own)), lambda name: (files, foreign))


def run(own: bytes, along: ReadAlong) -> list[tuple[float, ...] | None]:
    """Positions of the targets of the program with what is read along."""
    program = read_program([Source("own.mod", own), *along.sources], elsewhere=Elsewhere(read_along=along.written))
    targets = [event.target for event in walk(program)]
    return [t.trans if isinstance(t, RobTarget) else None for t in targets]


def near(data: str, body: str = "", name: str = "Near") -> str:
    return f"MODULE {name}\n  {data}\n  PROC rNear()\n    {body}\n  ENDPROC\nENDMODULE\n"


MOVE = module("MoveL p,v5,z0,tool0;")


@pytest.mark.parametrize("storage", ["PERS", "CONST", "TASK PERS"])
def test_data_of_its_own_task_is_taken(storage: str) -> None:
    along = lent(MOVE, [near(f"{storage} robtarget {P}")])
    assert run(MOVE, along) == [(500, 0, 400)]
    assert [d.message for d in along.findings] == ["`same0.mod` near it is read along: it declares `p`"]
    (copy,) = along.sources
    assert copy.read_only and copy.data.split() == f"MODULE Near {storage} robtarget {P} ENDMODULE".encode().split()


NOT_TAKEN = [
    near(f"LOCAL PERS robtarget {P}"),
    near("PERS robtarget p;"),
    near("", f"VAR robtarget {P}"),  # of a routine
    near(f"PERS robtarget {P}", "IF TRUE THEN"),  # cannot be parsed
    near(f"PERS robtarget {P} PERS robtarget {OTHER}"),  # nor loaded
    near(f"PERS robtarget {P}", name="m"),  # another version of the program's own module
    "no RAPID at all: PERS robtarget " + P,
]


@pytest.mark.parametrize("text", NOT_TAKEN)
def test_data_that_the_program_would_not_see_is_not_taken(text: str) -> None:
    assert lent(MOVE, [text]) == lent(MOVE, [], [text]) == ReadAlong()


@pytest.mark.parametrize("storage", ["TASK PERS", "CONST", "VAR"])
def test_of_another_task_only_global_pers_data_is_taken(storage: str) -> None:
    assert lent(MOVE, [], [near(f"{storage} robtarget {P}")]) == ReadAlong()
    assert run(MOVE, lent(MOVE, [], [near(f"PERS robtarget {P}")])) == [(500, 0, 400)]


def test_its_own_task_comes_before_others() -> None:
    along = lent(MOVE, [near(f"CONST robtarget {P}")], [near(f"PERS robtarget {OTHER}", name="Far")])
    assert run(MOVE, along) == [(500, 0, 400)] and [d.code for d in along.findings] == ["RAP038"]


def test_what_the_program_declares_is_its_own() -> None:
    for data in (f"PERS robtarget {P}", f"LOCAL CONST robtarget {P}"):
        assert lent(module("MoveL p,v5,z0,tool0;", data), [near(f"CONST robtarget {OTHER}")]) == ReadAlong()
    inside = module(f"VAR robtarget {P} MoveL p,v5,z0,tool0;")
    assert lent(inside, [near(f"CONST robtarget {OTHER}")]) == ReadAlong()


def test_shared_data_without_a_value_gets_that_of_another_task() -> None:
    own = module("MoveL p,v5,z0,tool0;", "PERS robtarget p;")
    assert run(own, lent(own, [], [near(f"PERS robtarget {P}")])) == [(500, 0, 400)]
    assert lent(own, [near(f"CONST robtarget {P}")]) == lent(own, [], [near("PERS num p:=5;")]) == ReadAlong()


def test_of_different_values_none_is_taken() -> None:
    along = lent(MOVE, [near(f"PERS robtarget {P}", name="A"), near(f"CONST robtarget {OTHER}", name="B")])
    assert not along.sources
    assert [d.message for d in along.findings] == [
        "`same0.mod` and `same1.mod` near it declare different values of `p`: none is taken"
    ]
    spaced = near(f"CONST robtarget {P.replace(',', ', ')}", name="B")
    assert run(MOVE, lent(MOVE, [near(f"PERS robtarget {P}", name="A"), spaced])) == [(500, 0, 400)]


def test_what_a_declaration_names_is_found_in_turn() -> None:
    own = module("MoveL st.place,v5,z0,tool0;", "VAR station st:=[[[a,0,400],[0,1,0,0],[0,0,0,0],xNone],1];")
    first = near("LOCAL CONST num twice:=2*half; CONST num a:=twice;", name="A")
    second = "MODULE B\n  RECORD station\n    robtarget place;\n    count n;\n  ENDRECORD\n  ALIAS num count;\n  CONST num half:=250;\n  CONST extjoint xNone:=[9E9,9E9,9E9,9E9,9E9,9E9];\nENDMODULE\n"
    along = lent(own, [first, second])
    assert run(own, along) == [(500, 0, 400)]
    assert [d.message.partition(": ")[2] for d in along.findings] == [
        "it declares `a`, `twice`", "it declares `count`, `half`, `station`, `xNone`",
    ]  # fmt: skip


WRITERS = [
    ("PERS num n:=5;", "n:=7;", True), ("PERS num n:=5;", "rOther n;", True), ("VAR num n:=5;", "", True),
    ("PERS num n:=5;", "k:=n;", False), ("CONST num n:=5;", "rOther n;", False),
]  # fmt: skip


@pytest.mark.parametrize(("data", "body", "written"), WRITERS)
def test_what_routines_near_it_write_is_assumed(data: str, body: str, written: bool) -> None:
    own = module("MoveL Offs(q,0,0,n),v5,z0,tool0;", f"CONST robtarget q:={target(500, 0, 400)};")
    along = lent(own, [near(f"{data} PERS num k:=1;", body)])
    assert (along.written == {"near..n"}) is written
    program = read_program([Source("own.mod", own), *along.sources], elsewhere=Elsewhere(read_along=along.written))
    (event,) = walk(program)
    assert bool(event.assumed) is written and event.target.trans == (500, 0, 405)  # type: ignore[union-attr]
