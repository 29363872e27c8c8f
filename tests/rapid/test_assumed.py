"""What is known, what is only assumed, and what is not known while a program is followed."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from postproc.rapid.data.events import MotionEvent
from postproc.rapid.execution.walk import walk, walk_program
from postproc.rapid.unknown import Kind, Unknown
from tests.rapid.build import events, module, places, program, target

P = f"CONST robtarget p:={target(0, 0, 0)}; CONST robtarget q:={target(100, 0, 0)};"
HEIGHT = "MoveL Offs(p,0,0,n),v5,z0,tool0;"


def heights(found: list[MotionEvent]) -> list[tuple[float, tuple[str, ...]] | None]:
    """z of every target and why its data is not certain; a load or a displacement is another matter."""
    causes = [tuple(text for text in e.assumed if not text.startswith("what ")) for e in found]
    return [None if place is None else (place[2], why) for place, why in zip(places(found), causes, strict=True)]


# -- what cannot be seen ---------------------------------------------------------------------------------------------


def test_a_routine_in_none_of_the_files_may_write_what_the_whole_task_sees() -> None:
    """A1: the measured height must not be taken for what stands in the text."""
    found = events(f"n:=7; {HEIGHT} rMeasureHeight; {HEIGHT} n:=8; {HEIGHT}", P + "PERS num n:=0;")
    assert heights(found) == [(7, ()), (7, ("`n` may be written by `rMeasureHeight`",)), (8, ())]


@pytest.mark.parametrize("storage", ["LOCAL VAR", "LOCAL PERS"])
def test_local_data_is_out_of_its_reach(storage: str) -> None:
    found = events(f"n:=7; rMeasureHeight; {HEIGHT}", P + f"{storage} num n:=0;")
    assert heights(found) == [(7, ())]


def test_unless_a_routine_that_it_may_call_writes_it() -> None:
    data = P + "LOCAL VAR num n:=0; PROC rSet() n:=50; ENDPROC"
    assert heights(events(f"n:=7; rMeasureHeight; {HEIGHT}", data)) == [
        (7, ("`n` may be written by `rMeasureHeight`",))
    ]
    own = data.replace("PROC rSet", "LOCAL PROC rSet")
    assert heights(events(f"n:=7; rMeasureHeight; {HEIGHT}", own)) == [(7, ())]


def test_a_function_in_none_of_the_files_may_write_too() -> None:
    found = events(f"n:=7; k:=fMeasure(); {HEIGHT}", P + "PERS num n:=0; VAR num k;")
    assert heights(found) == [(7, ("`n` may be written by `fMeasure`",))]


def test_instructions_of_the_controller_write_nothing_but_what_they_are_given() -> None:
    body = f'n:=7; TPReadNum k,"?"; WaitTime 1; PathRecStart id1; SetDO do1,1; {HEIGHT}'
    assert heights(events(body, P + "PERS num n:=0; VAR num k;")) == [(7, ())]


def test_what_is_assumed_decides_nothing() -> None:
    data = P + "PERS num n:=0;"
    body = f"n:=1; rMeasure; IF n=1 THEN {HEIGHT} ELSE MoveL q,v5,z0,tool0; ENDIF"
    assert [e.conditional for e in events(body, data)] == [True, True]
    test = f"n:=1; rMeasure; TEST n CASE 1: {HEIGHT} DEFAULT: MoveL q,v5,z0,tool0; ENDTEST"
    assert len(events(test, data)) == 2
    loop = "n:=2; rMeasure; FOR i FROM 1 TO n DO MoveL Offs(p,0,0,i),v5,z0,tool0; ENDFOR"
    assert places(events(loop, data)) == [None]


def test_what_is_worked_out_from_it_is_assumed_as_well() -> None:
    data = P + "PERS num n:=0; VAR num k; VAR robtarget r; FUNC num twice(num a) RETURN 2*a; ENDFUNC"
    why = ("`n` may be written by `rMeasure`",)
    start = "n:=3; rMeasure; "
    assert heights(events(start + "k:=twice(n)+1; MoveL Offs(p,0,0,k),v5,z0,tool0;", data)) == [(7, why)]
    assert heights(events(start + "r:=p; r.trans.z:=n; MoveL r,v5,z0,tool0;", data)) == [(3, why)]
    assert heights(events(start + "k:=1; Add k,n; MoveL Offs(p,0,0,k),v5,z0,tool0;", data)) == [(4, why)]
    both = "k:=3; IF DInput(di)=1 k:=n; MoveL Offs(p,0,0,k),v5,z0,tool0;"
    assert heights(events(start + both, data))[:1] == [(3, why)]


def test_tools_loads_and_displacements_are_assumed_too() -> None:
    tool = "PERS tooldata t:=[TRUE,[[0,0,9],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];"
    load = "PERS loaddata l:=[5,[0,0,1],[1,0,0,0],0,0,0]; PERS pose d:=[[1,2,3],[1,0,0,0]];"
    body = "rMeasure; MoveL p,v5,z0,{0}; GripLoad l; MoveL p,v5,z0,tool0; PDispSet d; MoveL p,v5,z0,tool0;"
    first, second, third = events(body.format("t"), P + tool + load)
    assert first.tool.tframe.trans == (0, 0, 9) and "`t` may be written by `rMeasure`" in first.assumed
    assert second.gripload.mass == 5 and "`l` may be written by `rMeasure`" in second.assumed
    assert third.displacement.trans == (1, 2, 3) and "`d` may be written by `rMeasure`" in third.assumed


def test_a_load_that_may_be_set_unseen_is_assumed() -> None:
    load = "CONST loaddata l:=[5,[0,0,1],[1,0,0,0],0,0,0];"
    (event,) = events("GripLoad l; rDrop; MoveL p,v5,z0,tool0;", P + load)
    assert event.gripload.mass == 5 and event.assumed[0] == "what GripLoad sets may be written by `rDrop`"


def test_a_loop_with_a_call_unseen_finds_its_data_assumed_in_every_turn() -> None:
    body = f"n:=7; WHILE DInput(di)=1 DO {HEIGHT} rMeasure; ENDWHILE {HEIGHT}"
    found = heights(events(body, P + "PERS num n:=0;"))
    assert {z for z, _ in filter(None, found)} == {7} and all(why for _, why in filter(None, found))


# -- calls by name ---------------------------------------------------------------------------------------------------

SETS = P + "PERS num n:=0; PROC rSet1() n:=50; ENDPROC PROC rSet2() n:=60; ENDPROC "


@pytest.mark.parametrize(
    ("call", "z"),
    [
        ('CallByVar "rSet",1;', 50),
        ('k:=2; CallByVar "rSet",k;', 60),
        ('%"rSet"+ValToStr(2)%;', 60),
        ('%"M:rSet1"%;', 50),
    ],
)
def test_a_call_by_a_name_that_is_known_is_followed(call: str, z: float) -> None:
    """A2: 40 mm too low."""
    assert heights(events(f"n:=10; {call} {HEIGHT}", SETS + "VAR num k;")) == [(z, ())]


def test_a_call_by_a_name_that_is_not_known_may_write_what_they_all_write() -> None:
    found = events(f'n:=10; k:=GInput(gi); CallByVar "rSet",k; {HEIGHT}', SETS + "VAR num k;")
    assert places(found) == [None]


# -- what runs when nobody knows -------------------------------------------------------------------------------------


@pytest.mark.parametrize("move", ["MoveLSync q,v5,z0,tool0,\"rSet1\";", "MoveJSync q,v5,z0,tool0,\"M:rSet1\";"])  # fmt: skip
def test_what_the_procedure_of_a_motion_writes_is_assumed(move: str) -> None:
    """A3: the same 40 mm."""
    found = heights(events(f"n:=10; {move} {HEIGHT}", SETS))
    assert found[-1] == (10, ("`n` is written by a trap routine or an error handler",))


def test_a_variable_that_an_instruction_goes_on_writing_is_assumed() -> None:
    found = events(f'n:=10; IVarValue "COM1",1,n,i1; n:=11; {HEIGHT}', P + "PERS num n:=0; VAR intnum i1;")
    assert [bool(e.assumed) for e in found] == [True]


# -- one datum under several names -----------------------------------------------------------------------------------


def test_one_datum_that_is_handed_over_twice_is_one() -> None:
    data = P + "VAR num n; PROC both(INOUT num a,INOUT num b) a:=1; b:=2; n:=a; ENDPROC"
    assert heights(events(f"both n,n; {HEIGHT}", data)) == [(2, ())]


def test_an_element_and_its_array_are_one() -> None:
    data = P + "VAR num row{2}:=[1,2]; VAR num n; PROC both(INOUT num a,INOUT num all{*}) all{1}:=5; n:=a; ENDPROC"
    assert places(events(f"both row{{1}},row; {HEIGHT}", data)) == [(0, 0, 5)]


def test_a_component_that_is_handed_over_is_written() -> None:
    data = P + "VAR robtarget r; PROC set(INOUT num a) a:=5; ENDPROC"
    assert heights(events("r:=p; set r.trans.z; MoveL r,v5,z0,tool0;", data)) == [(5, ())]


def test_an_element_that_is_not_known_leaves_none_known() -> None:
    data = P + "VAR num row{2}:=[1,2]; VAR num k; PROC set(INOUT num a) a:=5; ENDPROC"
    body = "row{1}:=3; k:=GInput(gi); set row{k}; MoveL Offs(p,0,0,row{1}),v5,z0,tool0;"
    assert places(events(body, data)) == [None]


def test_a_parameter_by_value_that_is_handed_on_by_reference_is_not_known() -> None:
    data = P + "PROC set(INOUT num a) a:=5; ENDPROC PROC go(num n) set n; " + HEIGHT + " ENDPROC"
    assert places(events("go 1;", data)) == [None]


# -- numbers ---------------------------------------------------------------------------------------------------------


def test_numbers_are_single_precision() -> None:
    """A4: in double precision the loop has eleven turns."""
    data = P + "VAR num k; VAR num n;"
    body = f"k:=0; n:=0; WHILE k<1 DO k:=k+0.1; n:=n+10; ENDWHILE {HEIGHT}"
    assert heights(events(body, data)) == [(100, ())]
    counted = f"n:=0; FOR i FROM 0 TO 1 STEP 0.1 DO n:=n+10; ENDFOR {HEIGHT}"
    assert heights(events(counted, data)) == [(100, ())]


def test_dnum_is_double_precision() -> None:
    data = P + "VAR dnum k; VAR num n;"
    body = f"k:=0; n:=0; WHILE k<1 DO k:=k+0.1; n:=n+10; ENDWHILE {HEIGHT}"
    assert heights(events(body, data)) == [(110, ())]


def test_what_a_num_holds_compares_with_the_literal() -> None:
    data = f"CONST robtarget p:={target(0, 0, 0.1)}; VAR num n; CONST num c:=0.1; VAR num row{{1}}:=[0.1];"
    for equal in ("n=0.1", "p.trans.z=0.1", "c=n", "row{1}=n", "0.1+0.2=n*3"):
        body = f"n:=0.1; IF {equal} THEN MoveL Offs(p,0,0,1),v5,z0,tool0; ENDIF"
        wanted = np.float32(0.1) + np.float32(0.2) == np.float32(0.1) * np.float32(3) if "+" in equal else True
        assert len(events(body, data)) == int(wanted), equal


# -- expressions -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("NOT FALSE AND FALSE", True), ("NOT TRUE OR TRUE", True), ("NOT TRUE XOR TRUE", True),
        ("TRUE OR NOT TRUE", True), ("TRUE AND NOT FALSE", True), ("(NOT FALSE) AND FALSE", False),
        ("NOT 1=2 AND 2=3", True), ("NOT (TRUE AND TRUE)", False),
    ],
)  # fmt: skip
def test_not_takes_the_whole_logical_term(condition: str, holds: bool) -> None:
    """A5."""
    (event,) = events(f"IF {condition} THEN MoveL p,v5,z0,tool0; ENDIF", P)
    assert (not event.unreachable, event.conditional) == (
        holds,
        not holds,
    )  # what is never reached is followed on its own


def test_not_that_may_mean_two_things_is_not_decided() -> None:
    (event,) = events("IF TRUE AND NOT FALSE AND FALSE THEN MoveL p,v5,z0,tool0; ENDIF", P)
    assert event.conditional


def test_a_function_of_the_program_hides_the_built_in_one() -> None:
    """A6."""
    own = "FUNC robtarget Offs(robtarget a,num x,num y,num z) a.trans.x:=a.trans.x-z; RETURN a; ENDFUNC"
    assert places(events("MoveL Offs(p,0,0,5),v5,z0,tool0;", P + own)) == [(-5, 0, 0)]


# -- reasons ---------------------------------------------------------------------------------------------------------


def test_reasons_are_values() -> None:
    (event,) = events("MoveL nowhere,v5,z0,tool0;", P)
    assert [u.kind for u in event.unknowns] == [Kind.NOT_DECLARED] and event.unknowns[0].subject == "nowhere"
    assert event.reason == "`nowhere` is not declared in these files"
    found = events("SearchL di1,r,p,v5,tool0; MoveL r,v5,z0,tool0;", P + "VAR robtarget r;")[-1]
    assert found.searched and found.unknowns[0].kind is Kind.FOUND_BY_SEARCH


def test_reasons_can_be_sent_to_another_process() -> None:
    reason = Unknown(Kind.PAYLOAD, cause=Unknown(Kind.UNSET, "`l`", key="m..l"))
    copy = pickle.loads(pickle.dumps(reason))
    assert (copy.reason, copy.root.key) == (reason.reason, "m..l")


def test_a_call_of_a_routine_in_none_of_the_files_is_reported() -> None:
    walked = walk_program(program(module("rMeasure; MoveL p,v5,z0,tool0;", P)))
    assert [d.code for d in walked.diagnostics] == ["RAP031"]
    assert walk(program(module("rMeasure; MoveL p,v5,z0,tool0;", P)))[0].reason is None


@pytest.mark.parametrize("call", ['TPReadNum n,"?"', 'TPReadFK n,"","","","","",""', "BECheckTcp t", "WaitTime 1"])
def test_an_instruction_of_the_controller_is_no_routine_that_is_missing(call: str) -> None:
    """It has a page in ABB's manuals; what it may write is known, and only what moves the arm begins a new way."""
    walked = walk_program(
        program(module(f"MoveL p,v5,z0,tool0; {call}; MoveL Offs(p,9,0,0),v5,z0,tool0;", P + "VAR num n;"))
    )
    assert walked.diagnostics == () and [e.reason for e in walked.events] == [None, None]
    assert walked.events[1].detached == call.startswith("BE")
