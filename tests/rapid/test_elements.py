"""Targets that a number of the controller chooses among the elements of an array."""

from __future__ import annotations

import pytest

from postproc.rapid.data.events import MotionEvent
from postproc.rapid.execution.walk import walk
from tests.rapid.build import module, program, target

PLACES = f"CONST robtarget p{{3}}:=[{target(100, 0, 0)},{target(200, 0, 0)},{target(300, 0, 0)}];"
DATA = f"{PLACES} CONST robtarget home:={target(0, 0, 500)}; VAR num n; VAR num m;"


def events(body: str, data: str = DATA) -> list[MotionEvent]:
    return [e for e in walk(program(module(body, data))) if e.resumes_from is None]


def places(body: str, data: str = DATA) -> list[float | None]:
    """x of every goal, None where it is not known."""
    return [None if e.target is None else e.target.trans[0] for e in events(body, data)]


def test_each_element_may_be_meant() -> None:
    assert places("n:=GInput(gi); MoveL p{n},v5,fine,tool0;") == [100, 200, 300]
    assert places("MoveL Offs(p{GInput(gi)},0,0,1),v5,fine,tool0;") == [None]  # no number to name


def test_motions_by_one_number_go_on_from_one_another() -> None:
    found = walk(
        program(module("n:=GInput(gi); MoveL p{n},v5,fine,tool0; MoveL Offs(p{n},0,0,9),v5,fine,tool0;", DATA))
    )
    starts = [found[i - 1].target for i, e in enumerate(found) if e.target is not None and e.target.trans[2] == 9]
    assert [start.trans[0] for start in starts if start is not None] == [100, 200, 300]


@pytest.mark.parametrize(
    "between", ["n:=GInput(gi);", "Unseen n;", "Unseen;", "n:=n+GInput(gi);", "IF di1=1 n:=2;", "Incr n;"]
)
def test_a_number_that_is_read_anew_chooses_anew(between: str) -> None:
    found = events(f"n:=GInput(gi); MoveL p{{n}},v5,fine,tool0; {between} MoveL Offs(p{{n}},0,0,9),v5,fine,tool0;")
    assert [e.first for e in found] == [True] * 6


def test_numbers_beside_the_index_move_the_range() -> None:
    assert places("n:=GInput(gi); MoveL p{n+1},v5,fine,tool0;") == [100, 200, 300]
    assert places("n:=GInput(gi); MoveL p{n},v5,fine,tool0; MoveL p{n+1},v5,fine,tool0;") == [
        100,
        200,
        300,
        100,
        200,
        300,
    ]
    assert places("n:=GInput(gi); MoveC p{n},p{n+1},v5,fine,tool0;") == [200, 300]


@pytest.mark.parametrize(
    "body",
    [
        "n:=GInput(gi); p{2}:=CRobT(); MoveL p{n},v5,fine,tool0;",
        "n:=GInput(gi); Teach p{n}; MoveL p{n},v5,fine,tool0;",
        "MoveL p{n},v5,fine,tool0; n:=GInput(gi); p{n}.trans.z:=5;",
    ],
)
def test_what_something_writes_is_left(body: str) -> None:
    assert None in places(body, DATA.replace("CONST robtarget p{", "PERS robtarget p{"))


def test_elements_that_were_never_taught_are_none() -> None:
    untaught = target(300, 0, 0).replace("[0,1,0,0]", "[0,0,0,0]")
    data = DATA.replace(target(300, 0, 0), untaught)
    assert data != DATA
    assert places("n:=GInput(gi); MoveL p{n},v5,fine,tool0;", data) == [100, 200]


def test_a_further_turn_with_another_load_counts() -> None:
    body = "FOR i FROM 1 TO 2 DO n:=GInput(gi); MoveL p{n},v5,fine,tool0; GripLoad [5,[0,0,9],[1,0,0,0],0,0,0]; ENDFOR"
    assert [e.gripload.mass for e in events(body)] == [0, 0, 0, 5, 5, 5]
    assert len(events(body.replace("GripLoad [5,[0,0,9],[1,0,0,0],0,0,0];", ""))) == 3


def test_too_many_elements_are_left() -> None:
    many = f"CONST robtarget p{{201}}:=[{','.join(target(i, 0, 0) for i in range(201))}]; VAR num n;"
    assert places("n:=GInput(gi); MoveL p{n},v5,fine,tool0;", many) == [None]


def test_records_that_are_known_in_part_are_written_and_doubted() -> None:
    data = f"VAR robtarget q:={target(1, 2, 3)}; VAR robtarget r; VAR robtarget unset;"
    body = "r:=q; r.trans.x:=GInput(gi); q:=r; Unseen; MoveL q,v5,fine,tool0; unset:=r; MoveL unset,v5,fine,tool0;"
    assert places(body, data) == [None, None]
