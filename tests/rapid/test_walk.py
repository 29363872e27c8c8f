"""Following a program: what the rows of ``corpus/`` cannot say."""

from __future__ import annotations

import pickle
from types import SimpleNamespace

import pytest

from postproc.diagnostics import PostprocError
from postproc.rapid.data.pose import pose_mult
from postproc.rapid.data.records import Pose
from postproc.rapid.execution.path_splitting import SplitBranches
from postproc.rapid.execution.walk import walk, walk_program
from postproc.rapid.program.program import read_program
from postproc.rapid.unknown import Kind, Unknown
from tests.rapid.build import events, module, places, program, target

P = f"CONST robtarget p:={target(0, 0, 0)};CONST robtarget q:={target(10, 0, 0)};"


def move(offset: str) -> str:
    return f"MoveL Offs(p,{offset},0,0),v100,z10,tool0;"


def test_many_ways_are_not_all_followed() -> None:
    cases = "".join(f"CASE {k}: {move(str(k))}" for k in range(30))
    run = events(move("0") + f"TEST GInput(g) {cases} ENDTEST {move('99')}", P)
    last = [e for e, place in zip(run, places(run), strict=True) if place == (99, 0, 0)]
    assert len(last) == 8 and all(e.detached for e in last)


def test_a_branch_that_was_followed_apart_is_not_followed_again() -> None:
    """Whatever still lacks what it sets: the program would be followed for ever."""
    lacks = [SimpleNamespace(unknowns=[Unknown(Kind.UNDECIDED, "n", key="m..n")])]
    choices, place = SplitBranches(), ("weld.mod", 5)
    choices.met(place, {0: {"m..n": 1.0}, 1: {"m..n": 2.0}}, {"m..n"}, [{"m..n"}, {"m..n"}], False)
    assert choices.lacking(lacks) == {place: (0, 1)}
    assert SplitBranches({place: 0}, choices.choices).lacking(lacks) == {}


def test_a_chosen_entry_and_a_chosen_constant() -> None:
    text = f"MODULE M {P} VAR num nLayer; PROC main() a; {move('1')} ENDPROC PROC a() {move('2')} ENDPROC ENDMODULE"
    assert places(walk(program(text), "A")) == [(2, 0, 0)]
    with pytest.raises(PostprocError, match=r"(?s)no routine `mian`.*did you mean `main`\? The routines are: a, main"):
        walk(program(text), "mian")
    assert [d.help for d in read_program(program(text).sources, ["nLayr"]).diagnostics] == ["did you mean `nLayer`?"]


def test_rotated_displacement_carries_the_programmed_onto_the_executed_point() -> None:
    executed = target(5, 0, 1, "[0,0.8,0.6,0]")
    event = events(f"PDispOn \\Rot \\ExeP:={executed}, q, tool0; MoveL p,v5,z0,tool0;", P)[0]
    moved = pose_mult(event.displacement, Pose((10, 0, 0), (0, 1, 0, 0)))
    assert (moved.trans, moved.rot) == (pytest.approx((5, 0, 1)), pytest.approx((0, 0.8, 0.6, 0)))


def test_the_root_of_what_a_function_displaces_is_its_target_among_others() -> None:
    data = (
        f"CONST robtarget row{{2}}:=[{target(0, 0, 0)},{target(10, 0, 0)}]; VAR num i; VAR num j; VAR num k;"
        "FUNC robtarget above(robtarget a) a.trans.z:=a.trans.z+5; RETURN a; ENDFUNC"
    )
    (event,) = events("i:=1; j:=2; k:=0; MoveL RelTool(above(row{i+j-1+k}),0,0,3),v5,z0,tool0;", data)
    root = event.target_origin.root
    assert root is not None and root.target.trans == (10, 0, 0) and root.lever == pytest.approx((0, 0, -3))


def test_what_is_in_force_is_one_value_until_something_sets_it() -> None:
    plain = f"MoveL p,v100,z10,tool0;\nMoveL {target(4, 5, 6)},v100,z10,tool0;\n"
    first, second, third, fourth = events(f"{plain}VelSet 50,400;\n{plain}", P)
    assert first.in_force is second.in_force is not third.in_force is fourth.in_force


def test_too_many_elements_are_left() -> None:
    many = f"CONST robtarget p{{201}}:=[{','.join(target(i, 0, 0) for i in range(201))}]; VAR num n;"
    assert places(events("n:=GInput(gi); MoveL p{n},v5,fine,tool0;", many)) == [None]


def test_reasons_are_values_that_can_be_sent_to_another_process() -> None:
    last = events("SearchL di1,r,p,v5,tool0; MoveL r,v5,z0,tool0;", P + "VAR robtarget r;")[-1]
    copy = pickle.loads(pickle.dumps(last.unknowns[0]))
    assert last.searched and (copy.kind, copy.reason) == (Kind.SEARCH_RESULT, last.reason)


def test_blocks_that_are_nested_too_deeply_are_reported() -> None:
    read = program("MODULE M PROC a() " + "IF a THEN " * 150)
    assert read.diagnostics[0].message == "blocks are nested deeper than 100"
    assert walk(read) == []


def test_the_whole_text_of_a_finding() -> None:
    read = program(module("  MoveL p,v5,z0,tTorch\\WObj:=wobj0;", f"CONST robtarget p:={target(1, 2, 3)};"))
    assert "\n".join(d.render() for d in walk_program(read).diagnostics) == (
        "error[RAP020]: the tool `tTorch` has no value in these files\n"
        " --> test.mod:4:17\n"
        "  |\n"
        "4 |   MoveL p,v5,z0,tTorch\\WObj:=wobj0;\n"
        "  |                 ^^^^^^\n"
        "  = help: give the file that declares `tTorch` too (`--with FILE`), often user.sys, CalibData.mod or another task's; "
        "or write a file that declares it, as the pendant shows it: `PERS tooldata tTorch:=..;`"
    )
