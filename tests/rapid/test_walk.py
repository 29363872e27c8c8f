"""Programs followed in the order in which they run."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from postproc.diagnostics import PostprocError
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.pose import pose_mult
from postproc.rapid.data.records import JointTarget, LoadData, Pose, RobTarget
from postproc.rapid.data.values import Data
from postproc.rapid.execution import all_ways as execution
from postproc.rapid.execution.path_splitting import SplitBranches
from postproc.rapid.execution.walk import walk, walk_program
from postproc.rapid.unknown import Kind, Unknown
from tests.rapid.build import UNUSED, events, module, places, program, target

P = f"CONST robtarget p:={target(0, 0, 0)};CONST robtarget q:={target(10, 0, 0)};"
LOADS = "PERS loaddata part:=[5,[0,0,80],[1,0,0,0],0.1,0.2,0.3];"
TOOL = "PERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[2,[0,0,50],[1,0,0,0],0,0,0]];"


def x(body: str, data: str = P) -> list[float | None]:
    """x coordinates of the events, None where the target is not known."""
    return [None if place is None else place[0] for place in places(events(body, data))]


def move(offset: str) -> str:
    return f"MoveL Offs(p,{offset},0,0),v100,z10,tool0;"


def test_calls_with_arguments() -> None:
    data = P + f"PROC go(robtarget a,num b\\num c) IF Present(c) {move('c')} MoveL Offs(a,b,0,0),v5,z0,tool0; ENDPROC"
    assert x("go p,1; go q,2\\c:=7; go Offs(q,1,0,0),1;", data) == [1, 7, 12, 12]


def test_a_declared_target_stays_declared_through_a_parameter() -> None:
    data = P + "PROC go(robtarget a) MoveL a,v5,z0,tool0; ENDPROC"
    found = events("go q; go Offs(q,1,0,0);", data)
    assert [(e.target_origin.kind, e.target_origin.declaration) for e in found] == [
        ("declared", "m..q"),
        ("expression", None),
    ]


def test_parameters_by_reference_write_to_the_caller() -> None:
    data = P + "PROC up(INOUT num a,VAR num b) a:=a+1; b:=b+10; ENDPROC"
    body = f"VAR num n:=1; VAR num m{{2}}:=[0,5]; up n,m{{2}}; {move('n')} {move('m{2}')} {move('m{1}')}"
    assert x(body, data) == [2, 15, 0]


def test_parameters_by_value_do_not() -> None:
    data = P + f"PROC up(num a) a:=a+1; {move('a')} ENDPROC"
    assert x(f"VAR num n:=1; up n; {move('n')}", data) == [2, 1]


def test_a_persistent_parameter_that_is_only_read_is_no_write() -> None:
    data = P + TOOL + "PROC go(PERS tooldata tool) MoveL p,v5,z0,tool; ENDPROC"
    found = events("go t; MoveL q,v5,z0,t;", data)
    assert [e.tool.name for e in found] == ["t", "t"]
    assert [e.reason for e in found] == [None, None]


def test_functions_of_the_program() -> None:
    data = P + "FUNC robtarget above(robtarget a,num h) IF h<0 RETURN a; RETURN Offs(a,h,0,0); ENDFUNC"
    assert x("MoveL above(q,5),v5,z0,tool0; MoveL above(q,-5),v5,z0,tool0;", data) == [15, 10]


@pytest.mark.parametrize("target", ["next()", "Offs(next(),0,5,0)", "Offs(p,next().trans.x,0,0)"])
def test_a_function_that_counts_runs_once_in_each_statement(target: str) -> None:
    data = P + "VAR num n:=0; FUNC robtarget next() n:=n+1; RETURN Offs(p,10*n,0,0); ENDFUNC"
    assert x(f"n:=0; {f'MoveL {target},v5,z0,tool0; ' * 3}", data) == [10, 20, 30]


def test_a_function_that_moves_does_so_once() -> None:
    data = P + "FUNC robtarget seen() MoveL q,v5,z0,tool0; RETURN p; ENDFUNC"
    assert x("MoveL Offs(seen(),5,0,0),v5,z0,tool0;", data) == [10, 5]


def test_a_function_that_depends_on_a_signal_is_not_known() -> None:
    data = P + "FUNC num f() IF di1=1 RETURN 1; RETURN 2; ENDFUNC"
    assert x(move("f()"), data) == [None]


def test_assignments_to_parts() -> None:
    body = "VAR robtarget a; VAR num m{2,2}; a:=q; a.trans.x:=a.trans.x+3; m{1,2}:=4; MoveL a,v5,z0,tool0;"
    assert x(body + move("m{1,2}+m{2,2}")) == [13, 4]


SIGNAL = "FUNC num f() IF di1=1 RETURN 1; RETURN 2; ENDFUNC "
ROW = "VAR num m{2}:=[1,2]; VAR num n:=5; "


@pytest.mark.parametrize(
    ("body", "routine", "values"),
    [
        (f"m{{f()}}:=9; {move('m{1}')}", "", [None]),  # either may have been written
        (f"m{{3}}:=9; {move('m{1}')}", "", [None]),  # what the controller does then nobody knows
        (f"m{{2}}:=f(); {move('m{1}')} {move('m{2}')}", "", [1, None]),
        ("go n;", f"PROC go(num k) IF di1=1 k:=3; {move('k')} ENDPROC", [None]),
        (f"go n; {move('n')}", f"PROC go(VAR num k) IF di1=1 k:=3; {move('k')} ENDPROC", [None, None]),
        (f"go n; {move('n')}", f"PROC go(num k) k:=3; {move('k')} ENDPROC", [3, 5]),
        (f"Clear n; {move('n')} Add n,3; {move('n')} Decr n; {move('n')}", "", [0, 3, 2]),
        (f"n:=f(); Incr n; {move('n')} Clear n; {move('n')}", "", [None, 0]),
        (f"FOR i FROM 1 TO 2 DO FOR i FROM 7 TO 8 DO n:=i; ENDFOR {move('i')} ENDFOR", "", [1, 2]),
        (f"WHILE n>2 DO Decr n; IF n=3 RETURN; {move('n')} ENDWHILE", "", [4]),
    ],
)
def test_what_may_have_been_written_is_not_known(body: str, routine: str, values: list[float | None]) -> None:
    assert x(f"{ROW}{body}", P + SIGNAL + routine) == values


def test_arrays_of_targets_in_a_loop() -> None:
    data = P + f"CONST robtarget a{{3}}:=[{target(1, 0, 0)},{target(2, 0, 0)},{target(3, 0, 0)}];"
    found = events("FOR i FROM 1 TO Dim(a,1) DO MoveL a{i},v5,z0,tool0; ENDFOR", data)
    assert places(found) == [(1, 0, 0), (2, 0, 0), (3, 0, 0)]
    assert {e.target_origin.kind for e in found} == {"element"}
    assert len({e.target_origin.spans.whole for e in found if e.target_origin.spans}) == 3


@pytest.mark.parametrize(
    ("head", "values"),
    [("FOR i FROM 1 TO 3", [1, 2, 3]), ("FOR i FROM 3 TO 1 STEP -1", [3, 2, 1]), ("FOR i FROM 3 TO 1", [3, 2, 1]),
     ("FOR i FROM 1 TO 2 STEP 0.5", [1, 1.5, 2]), ("FOR i FROM 2 TO 1 STEP 1", []), ("FOR i FROM 0 TO n", [None])],
)  # fmt: skip
def test_counting_loops(head: str, values: list[float | None]) -> None:
    found = [e for e in events(f"{head} DO {move('i')} ENDFOR", P) if not e.conditional or values == [None]]
    assert [None if e.target is None else e.target.trans[0] for e in found] == values  # type: ignore[union-attr]


def test_a_conditional_loop_with_known_values() -> None:
    assert x(f"VAR num n:=1; WHILE n<4 DO {move('n')} Incr n; ENDWHILE {move('n')}") == [1, 2, 3, 4]


@pytest.mark.parametrize("head", ["WHILE TRUE DO", "WHILE di1=1 DO", "FOR i FROM 1 TO n DO"])
@pytest.mark.parametrize(
    ("body", "masses"),
    [
        ("{1} GripLoad part; {2} GripLoad load0; {3}", [0, 5, 0]),
        ("{1} GripLoad part; {2}", [None, 5]),
        ("GripLoad part; {1} IF di2=1 GripLoad load0; {2}", [5, 0]),
        # What a turn leaves shows in the turn after the next.
        ("GripLoad two; {1} two:=one; one:=heavy;", [None]),
        ("pick; {1} GripLoad load0;", [5]),
    ],
)
def test_what_every_turn_of_a_loop_finds_alike_is_known(head: str, body: str, masses: list[float | None]) -> None:
    loads = "VAR loaddata one; VAR loaddata two; CONST loaddata heavy:=[9,[0,0,80],[1,0,0,0],0,0,0];"
    data = P + LOADS + loads + "VAR num n; PROC pick() GripLoad part; ENDPROC PROC count() n:=DInput(di3); ENDPROC"
    for number in "123":
        body = body.replace(f"{{{number}}}", move(number))
    end = head.split()[0].replace("WHILE", "ENDWHILE").replace("FOR", "ENDFOR")
    found = events(f"count; one:=part; two:=part; {head} {body} {end}", data)
    assert [e.gripload.mass if e.reason is None else None for e in found[: len(masses)]] == masses


def test_a_loop_that_known_values_never_end_is_not_run_ten_thousand_times() -> None:
    body = f"VAR num n:=0; WHILE n<3 DO IF di1=1 THEN n:=n; ENDIF {move('n')} ENDWHILE {move('7')}"
    assert len(x(body)) <= 10
    assert x(f"VAR num n:=0; WHILE n<3 DO {move('n')} n:=n+1; ENDWHILE") == [0, 1, 2]


def test_loops_in_one_another_cost_no_more_than_their_depth() -> None:
    deep = 40
    found = events("WHILE di1=1 DO " * deep + move("1") + " ENDWHILE" * deep, P)
    assert 1 < len(found) < 10 * deep


def test_a_turn_of_a_loop_begins_where_the_one_before_ended() -> None:
    found = events(f"{move('0')} WHILE TRUE DO IF di1=1 THEN {move('1')} ENDIF {move('2')} {move('3')} ENDWHILE", P)
    assert shown(found) == ["0 from nowhere", "1", "2", "at 0", "2", "3", "1", "at 3", "2"]


def test_an_endless_loop_runs_once_and_forgets_what_it_changes() -> None:
    found = events(f"VAR num n:=0; WHILE TRUE DO {move('n')} n:=n+1; n:=5; {move('n')} ENDWHILE", P)
    assert [None if e.target is None else e.target.trans[0] for e in found] == [None, 5]  # type: ignore[union-attr]
    assert found[0].reason == "`n` is changed in a loop"
    assert not found[0].conditional


def test_both_ways_of_an_unknown_condition() -> None:
    body = f"VAR num n:=0; IF di1=1 THEN n:=1; {move('n')} ELSEIF di2=1 THEN n:=1; ELSE {move('n+7')} n:=1; ENDIF {move('n')}"
    found = events(body, P)
    assert shown(found) == ["1 from nowhere", "7 from nowhere", "1", "at 1", "1"]
    assert [e.conditional for e in found] == [True, True, False, True, False]
    assert [e.detached for e in found if e.resumes_from is None] == [True, True, True, True]
    body = f"VAR num n:=0; IF di1=1 THEN n:=1; ENDIF {move('n')}"
    assert x(body) == [1, 0]
    assert events(body.replace("n:=1", "n:=AInput(ai1)"), P)[0].reason == "`n` depends on a condition that is not known"


def test_a_way_that_returns_does_not_count_afterwards() -> None:
    assert x(f"VAR num n:=0; IF di1=1 THEN n:=1; {move('n')} RETURN; ENDIF {move('n')}") == [1, 0]


def test_only_the_first_event_after_a_gap_is_detached() -> None:
    found = events(move("1") + move("2") + f"IF di1=1 THEN {move('3')} ENDIF {move('4')} {move('5')}", P)
    assert [(e.detached, e.first) for e in found if e.resumes_from is None] == [
        (True, True), (False, False), (False, False), (True, False), (True, False), (False, False),
    ]  # fmt: skip
    found = events(move("1") + "IF di1=1 THEN SetDO do1,1; ENDIF " + move("2"), P)
    assert [e.detached for e in found] == [True, False]


def shown(found: list[MotionEvent]) -> list[str]:
    """Where every event goes, or stands again before another way goes on."""
    x = [f"{e.target.trans[0]:g}" for e in found if isinstance(e.target, RobTarget)]
    return [
        f"at {name}" if e.resumes_from is not None else f"{name} from nowhere" if e.first else name
        for e, name in zip(found, x, strict=True)
    ]


@pytest.mark.parametrize(
    ("body", "data", "ways"),
    [
        ("IF di1=1 THEN {1} {2} ELSE {3} ENDIF {4} {5}", "", "0 1 2 @0 3 4 @2 4 5"),
        ("IF di1=1 {1} {4}", "", "0 1 4 @0 4"),
        ("TEST GInput(g) CASE 1: {1} CASE 2: {2} DEFAULT: {3} ENDTEST {4}", "", "0 1 @0 2 @0 3 4 @1 4 @2 4"),
        ("IF di1=1 THEN IF di2=1 THEN {1} ENDIF {2} ENDIF {3}", "", "0 1 2 @0 2 3 @0 3"),
        ("IF di1=1 THEN {1} ELSE MoveL nowhere,v5,z0,tool0; ENDIF", "", "0 1 @0"),
        ("early; {4}", "PROC early() {1} IF di1=1 RETURN; {2} ENDPROC", "0 1 2 4 @1 4"),
        ("FOR i FROM 1 TO 2 DO {1} IF di1=1 THEN {2} ENDIF ENDFOR {3}", "", "0 1 2 1 @1 1 2 3 @1 3"),
        ("WHILE di1=1 DO {1} {2} ENDWHILE {3}", "", "0 1 2 1 @0 3 @2 3"),
        ("IF di1=1 THEN {1} ENDIF IF di2=1 THEN {2} ENDIF {3}", "", "0 1 2 @0 2 3 @0 3 @1 3"),
        # Turns of a loop that end at one place are one way.
        ("FOR i FROM 1 TO 3 DO IF di1=1 THEN {1} {2} ENDIF ENDFOR {3}", "", "0 1 2 1 @0 1 2 1 @0 1 2 3 @0 3"),
    ],
)
def test_every_way_goes_on_from_where_it_has_brought_the_arm(body: str, data: str, ways: str) -> None:
    """`@` stands again at that target; the events of a way follow each other."""
    for number in "12345":
        body, data = (text.replace(f"{{{number}}}", move(number)) for text in (body, data))
    found = events(move("0") + body, P + "VAR robtarget nowhere; PROC teach() nowhere:=CRobT(); ENDPROC " + data)
    names = shown([e for e in found if e.target is not None])
    assert [name.replace("at ", "@").replace(" from nowhere", "") for name in names] == ways.split()
    for event in found:
        if event.resumes_from is not None:
            assert found[event.resumes_from].target == event.target and found[event.resumes_from].resumes_from is None


def test_many_ways_are_not_all_followed() -> None:
    cases = "".join(f"CASE {k}: {move(str(k))}" for k in range(30))
    found = events(move("0") + f"TEST GInput(g) {cases} ENDTEST {move('99')}", P)
    last = [e for e in found if e.target is not None and e.target.trans[0] == 99]  # type: ignore[union-attr]
    assert len(last) == 8 and all(e.detached for e in last)


def test_main_first_then_what_it_does_not_reach() -> None:
    data = P + f"PROC a() {move('1')} ENDPROC PROC b(num n) {move('n')} ENDPROC TRAP t {move('3')} ENDTRAP"
    found = events("a;", data)
    assert [(e.statement.routine, e.detached) for e in found] == [("a", True), ("b", True), ("t", True)]
    assert found[1].reason == "the parameter `n` is not known"


def test_without_main_every_routine_that_nobody_calls() -> None:
    text = f"MODULE M {P} PROC b() c; {move('1')} ENDPROC PROC c() {move('2')} ENDPROC PROC a() {move('3')} ENDPROC ENDMODULE"
    assert [e.statement.routine for e in walk(program(text))] == ["c", "b", "a"]


def test_a_chosen_entry() -> None:
    text = f"MODULE M {P} PROC main() a; {move('1')} ENDPROC PROC a() {move('2')} ENDPROC ENDMODULE"
    assert places(walk(program(text), "A")) == [(2, 0, 0)]
    with pytest.raises(PostprocError, match="there is no routine `nowhere`"):
        walk(program(text), "nowhere")


def test_a_routine_that_calls_itself() -> None:
    assert x("again;", P + f"PROC again() {move('1')} again; ENDPROC") == [1]


# -- written data ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("storage", ["PERS", "VAR"])
def test_data_that_nobody_writes_is_as_good_as_constant(storage: str) -> None:
    event = events("MoveL a,v5,z0,tool0;", f"{storage} robtarget a:={target(4, 0, 0)};")[0]
    assert (event.target_origin.kind, event.target_origin.storage) == ("declared", storage)


@pytest.mark.parametrize(
    "write",
    ["a:=CRobT();", "a.trans.x:=CPos();", "GetPos a;", "SearchL di1,a,p,v5,tool0;", "teach a;", "outer a;"],
)
def test_data_that_the_program_writes_is_known_only_at_run_time(write: str) -> None:
    """Before that it is taken as it stands in the file, which the last run of the program may have changed."""
    data = P + f"PERS robtarget a:={target(4, 0, 0)};"
    data += "PROC teach(INOUT robtarget r) r:=CRobT(); ENDPROC PROC outer(PERS robtarget r) teach r; ENDPROC"
    found = events(f"MoveL a,v5,z0,tool0; {write} MoveL a,v5,z0,tool0;", data)
    assert places(found[:1]) == [(4, 0, 0)] and found[0].reason is None
    assert [text.split(" ")[0] for text in found[0].assumed] == ["`a`"]
    event = found[-1]
    assert event.target is None
    assert event.target_origin.kind == "runtime"
    assert event.target_origin.declaration == "m..a"
    assert "`a`" in (event.reason or "") or "known only at run time" in (event.reason or "")


def test_a_value_assigned_on_the_way_is_known_from_there_on() -> None:
    found = events("MoveL a,v5,z0,tool0; a:=Offs(q,1,0,0); MoveL a,v5,z0,tool0;", P + "VAR robtarget a;")
    assert places(found) == [None, (11, 0, 0)]
    assert found[1].target_origin.kind == "expression"


@pytest.mark.parametrize(
    "write",
    [
        'SetDataVal "a",CRobT();', 'SetDataVal "A"+part,p;', 'SetDataVal name\\Block:=block,p;', 'SetDataVal name,p.trans;',
        'SetAllDataVal "robtarget"\\TypeMod:=part,p;',
    ],
)  # fmt: skip
def test_what_is_written_by_its_name_in_a_text_is_not_known(write: str) -> None:
    data = P + f"PERS robtarget a:={target(4, 0, 0)}; PERS string part; VAR string name; VAR datapos block;"
    body = f"name:=StrPart(part,1,1); part:=name; {write} MoveL a,v5,z0,tool0;"
    assert places(events(body, data)) == [None]
    other = data.replace(" a:", " b:") + f"PERS robtarget a:={target(4, 0, 0)};"
    named = "name" in write or "All" in write
    assert places(events(body.replace("MoveL a", "MoveL b"), other)) == [None if named else (4, 0, 0)]


def test_what_has_another_type_is_not_written_by_name() -> None:
    data = P + f"PERS robtarget a:={target(4, 0, 0)}; VAR num n; PERS string part;"
    assert places(events("SetDataVal part,n; MoveL a,v5,z0,tool0;", data)) == [(4, 0, 0)]


def test_data_is_read_and_written_by_a_known_name() -> None:
    data = P + f"PERS robtarget a1:={target(4, 0, 0)}; PERS robtarget a2:={target(6, 0, 0)}; VAR robtarget r;"
    get = 'FOR i FROM 1 TO 2 DO GetDataVal "a"+ValToStr(i),r; MoveL r,v5,z0,tool0; ENDFOR'
    assert places(events(get, data)) == [(4, 0, 0), (6, 0, 0)]
    assert places(events('SetDataVal "A1",a2; MoveL a1,v5,z0,tool0;', data)) == [(6, 0, 0)]


@pytest.mark.parametrize(
    ("choice", "found"),
    [
        ("IF di1=1 THEN s:=a; RETURN; ENDIF s:=CRobT();", [(1, 0, 0), None]),
        ("IF di1=1 THEN n:=n+1; s:=a; RETURN; ENDIF s:=b;", [None]),
        ("TEST n CASE 1: s:=a; RETURN; DEFAULT: ENDTEST s:=b;", [(1, 0, 0), (2, 0, 0)]),
        ("WHILE TRUE DO IF di1=1 THEN s:=a; RETURN; ENDIF s:=b; ENDWHILE", [(1, 0, 0)]),
        ("FOR i FROM 1 TO 3 DO IF i=2 THEN s:=b; RETURN; ENDIF s:=a; ENDFOR", [(2, 0, 0)]),
        ("IF di1=1 THEN s:=b; RETURN; ENDIF s:=b;", [(2, 0, 0)]),
        ("s:=a; IF di1=1 EXIT; s:=b;", [(2, 0, 0)]),
    ],
)
def test_what_ways_out_of_a_routine_leave_different_is_not_known(
    choice: str, found: list[tuple[int, ...] | None]
) -> None:
    data = f"CONST robtarget a:={target(1, 0, 0)}; CONST robtarget b:={target(2, 0, 0)}; VAR robtarget s;"
    data += f"VAR num n; PROC choose() WaitUntil di1=1; n:=GInput(gi1); {choice} ENDPROC "
    assert places(events("choose; MoveL s,v5,z0,tool0;", data)) == found


CHOICES = [
    "IF di1=1 THEN s:=a; ELSE s:=b; ENDIF",
    "TEST GInput(gi1) CASE 1: s:=a; CASE 2: s:=b; DEFAULT: EXIT; ENDTEST",
    "IF di1=1 THEN s:=a; RETURN; ENDIF s:=b;",
]


@pytest.mark.parametrize("choice", CHOICES)
@pytest.mark.parametrize("loop", [False, True])
def test_a_choice_that_moves_nothing_is_followed_both_ways_to_the_end(choice: str, loop: bool) -> None:
    data = f"CONST robtarget a:={target(1, 0, 0)}; CONST robtarget b:={target(2, 0, 0)}; VAR robtarget s;"
    data += f"PROC choose() {choice} ENDPROC "
    body = "choose; MoveL s,v5,z0,tool0; MoveL Offs(s,5,0,0),v5,z0,tool0;"
    found = events(f"WHILE TRUE DO {body} ENDWHILE" if loop else body, data)
    back = [e for e in found if e.detached and not e.first]  # the next turn may follow another choice
    assert len(back) == (2 if loop else 0)
    assert places([e for e in found if e not in back]) == [(1, 0, 0), (6, 0, 0), (2, 0, 0), (7, 0, 0)]


def test_a_branch_of_which_an_arm_once_ended_the_routine_is_not_followed_apart() -> None:
    """Met again where that arm is not possible: what follows it is still left out on one way."""
    choices, place, written = SplitBranches(), ("weld.mod", 5), [{"wact"}, {"wact"}]
    ends: dict[int, dict[str, Data] | None] = {0: {"wact": 1.0}, 1: {"wact": 2.0}}
    choices.met(place, ends, {"wact", "count"}, written, left=True)
    assert choices.found[place].left and choices.found[place].certain == {"wact"}
    choices.met(place, ends, {"wact", "count"}, written, left=False)
    assert choices.found[place].left


def test_a_branch_that_was_followed_apart_is_not_asked_for_again() -> None:
    """Whatever still lacks what it sets: the program would be followed for ever."""
    text = program(module("", "VAR num n;"))
    (n,) = {d.key for d in text.names.values()}
    lacks = [SimpleNamespace(unknowns=[Unknown(Kind.UNDECIDED, n, key=n)])]
    choices, place = SplitBranches(), ("weld.mod", 5)
    choices.met(place, {0: {n: 1.0}, 1: {n: 2.0}}, {n}, [{n}, {n}], left=False)
    assert choices.lacking(lacks) == {place: (0, 1)}
    assert SplitBranches({place: 0}, choices.found).lacking(lacks) == {}


def test_choices_that_no_motion_needs_or_that_are_too_many_are_not_followed_apart() -> None:
    data = P + "VAR num k1; VAR num k2; VAR num k3; VAR num k4; VAR bool on:=FALSE;"
    assert len(events("IF di1=1 on:=TRUE; MoveL p,v5,z0,tool0;", data)) == 1
    sets = [f"k{i}:=0; IF di{i}=1 k{i}:={i}; " for i in range(1, 5)]
    assert x("".join(sets) + move("k1+k2+k3+k4"), data) == [None]
    assert sorted(x("".join(sets[:3]) + move("k1+k2+k3"), data)) == [0, 1, 2, 3, 3, 4, 5, 6]


@pytest.mark.parametrize(
    "body",
    [
        "FOR i FROM 1 TO 3 DO IF di1=1 k:=k+1; ENDFOR {}",  # any number up to 3
        "FOR i FROM 1 TO 3 DO IF di1=1 k:=i; ENDFOR {}",
        "FOR i FROM 1 TO 2 DO IF di1=1 THEN k:=1; ELSE n:=2; ENDIF ENDFOR {}",  # 1 and 2 in turn
    ],
)
def test_what_choices_in_turn_may_leave_is_not_told_from_one_choice_alone(body: str) -> None:
    assert set(x("k:=0; n:=0; " + body.format(move("k+n")), P + "VAR num k; VAR num n;")) == {None}


def test_what_one_arm_alone_sets_may_be_of_the_choice_before() -> None:
    data = f"CONST robtarget a:={target(1, 0, 0)}; CONST robtarget b:={target(2, 0, 0)}; VAR robtarget s; VAR num k; "
    data += "PROC choose() IF di1=1 THEN s:=a; k:=5; ELSE s:=b; ENDIF ENDPROC "
    body = "choose; MoveL s,v5,z0,tool0; choose; MoveL Offs(s,k,0,0),v5,z0,tool0;"  # also to (7, 0, 0)
    assert places(events(body, data)) == [(1, 0, 0), None, (2, 0, 0), None]


@pytest.mark.parametrize(
    ("end", "known"), [("TRYNEXT;", 0), ("RETRY;", 0), ("RETURN;", 0), ("RAISE;", 1), ("EXIT;", 1)]
)
def test_what_a_handler_writes_that_goes_on_is_not_certain(end: str, known: int) -> None:
    """A correction may be worked out for the place that the text gives; a run after an error goes elsewhere."""
    data = P + f"CONST robtarget a:={target(4, 0, 0)}; LOCAL VAR robtarget s;"
    body = f"s:=a; WaitTime 1; MoveL s,v5,z0,tool0; ERROR IF ERRNO=ERR_X THEN s:=p; {end} ENDIF"
    (event,) = events(body, data)
    assert places([event]) == [(4, 0, 0)]
    assert event.assumed == (() if known else ("`s` is written by a trap routine or an error handler",))


def test_what_a_trap_writes_is_never_certain() -> None:
    data = P + "VAR num n;TRAP t n:=5; ENDTRAP"
    (event,) = events(f"n:=1; {move('n')}", data)
    assert places([event]) == [(1, 0, 0)]
    assert event.assumed == ("`n` is written by a trap routine or an error handler",)
    assert x(f"n:=1; IF n=1 THEN {move('n')} ELSE {move('7')} ENDIF", data) == [1, 7]


# -- state -----------------------------------------------------------------------------------------------------------


def test_payload_in_program_order() -> None:
    data = P + LOADS + "PROC grip() GripLoad part; ENDPROC"
    found = events("MoveL p,v5,z0,tool0; grip; MoveL p,v5,z0,tool0; GripLoad load0; MoveL p,v5,z0,tool0;", data)
    assert [e.gripload.mass for e in found] == [0, 5, 0]
    assert found[1].gripload == LoadData(5, (0, 0, 80), (1, 0, 0, 0), (0.1, 0.2, 0.3))


def test_payload_that_depends_on_a_signal() -> None:
    body = "IF di1=1 GripLoad part; MoveL p,v5,z0,tool0; GripLoad load0; MoveL p,v5,z0,tool0;"
    assert [e.gripload.mass for e in events(body, P + LOADS)] == [5, 0, 0, 0]
    found = events(
        body.replace("=1 ", "=1 THEN nLoads:=nLoads+1; ", 1).replace(
            "part;", "[nLoads,[0,0,80],[1,0,0,0],0,0,0]; ENDIF", 1
        ),
        P + LOADS + "VAR num nLoads;",
    )
    assert [e.reason for e in found] == [
        "the payload is not known: what GripLoad sets depends on a condition that is not known", None,
    ]  # fmt: skip
    found = events("IF di1=1 THEN GripLoad part; GripLoad load0; ENDIF MoveL p,v5,z0,tool0;", P + LOADS)
    assert found[0].reason is None


def test_total_load_of_a_move() -> None:
    event = events("GripLoad part; MoveL p,v5,z0,t\\TLoad:=part;", P + LOADS + TOOL)[0]
    assert (event.tool.tload.mass, event.gripload.mass) == (5, 0)
    nothing = events("GripLoad part; MoveL p,v5,z0,t\\TLoad:=load0;", P + LOADS + TOOL)[0]
    assert (nothing.tool.tload.mass, nothing.gripload.mass) == (2, 5)


def test_program_displacement() -> None:
    found = events(
        f"PDispSet [[1,2,3],[1,0,0,0]]; MoveL p,v5,z0,tool0; PDispOff; MoveL p,v5,z0,tool0;"
        f"PDispOn \\ExeP:={target(5, 0, 1)}, p, tool0; MoveL p,v5,z0,tool0; PDispOn q, tool0; MoveL p,v5,z0,tool0;",
        P,
    )
    assert [e.displacement.trans for e in found] == [(1, 2, 3), (0, 0, 0), (5, 0, 1), (0, 0, 0)]
    assert (found[3].reason or "").startswith("the program displacement is not known: ")


def test_state_that_is_set_by_what_a_function_returns() -> None:
    data = (
        P + "FUNC pose fPlace(num x) VAR pose there; there.trans:=[x,0,0]; there.rot:=[1,0,0,0]; RETURN there; ENDFUNC"
    )
    data += " FUNC num fShare() RETURN 40; ENDFUNC"
    found = events("PDispSet fPlace(7); VelSet fShare(),800; MoveL p,v5,z0,tool0;", data)
    assert (found[0].displacement.trans, found[0].velocity_override) == ((7, 0, 0), 40)


def test_rotated_displacement_carries_the_programmed_onto_the_executed_point() -> None:
    executed = target(5, 0, 1, "[0,0.8,0.6,0]")
    event = events(f"PDispOn \\Rot \\ExeP:={executed}, q, tool0; MoveL p,v5,z0,tool0;", P)[0]
    assert event.displacement != Pose()
    there = pose_mult(event.displacement, Pose((10, 0, 0), (0, 1, 0, 0)))
    assert there.trans == pytest.approx((5, 0, 1))
    assert there.rot == pytest.approx((0, 0.8, 0.6, 0))


def test_monitoring_speed_and_acceleration() -> None:
    body = "MoveL p,v5,z0,tool0; ConfL\\Off; ConfJ \\Off; SingArea\\Wrist; VelSet 50,800; AccSet 60,100; MoveL p,v5,z0,tool0;"
    before, after = events(body, P)
    assert before.options == {"conf_l": True, "conf_j": True, "wrist_in_joints": False}
    assert after.options == {"conf_l": False, "conf_j": False, "wrist_in_joints": True}
    assert (before.velocity_override, before.velocity_limit, before.acceleration) == (100, None, 100)
    assert (after.velocity_override, after.velocity_limit, after.acceleration) == (50, 800, 60)


def test_axis_offsets_are_refused() -> None:
    assert events("EOffsOn p; MoveL p,v5,z0,tool0;", P)[0].reason is None
    track = P.replace("[9E9", "[500")
    assert events("EOffsOn p; MoveL p,v5,z0,tool0;", track)[0].reason == "an offset of the external axes may be active"
    assert events("EOffsSet [5,0,0,0,0,0]; MoveL p,v5,z0,tool0;", track)[0].reason is None
    assert events("EOffsSet [5,0,0,0,0,0]; MoveL p,v5,z0,tool0;", track)[0].axis_offset == (5, 0, 0, 0, 0, 0)
    assert events("ActUnit STN1; DeactUnit STN1; MoveL p,v5,z0,tool0;", track)[0].units == (
        ("stn1", True),
        ("stn1", False),
    )
    assert events("EOffsSet [0,0,0,0,0,0]; MoveL p,v5,z0,tool0;", track)[0].reason is None
    assert events("EOffsSet 5; MoveL p,v5,z0,tool0;", track)[0].reason is not None
    assert events("EOffsOn p; EOffsOff; MoveL p,v5,z0,tool0;", track)[0].reason is None


# -- arguments ---------------------------------------------------------------------------------------------------------


def test_speeds_zones_and_times() -> None:
    data = P + "PERS speeddata slow:=[12,500,5000,1000];PERS zonedata zw:=[FALSE,2,3,3,0.3,3,0.3];VAR num s;"
    found = events(
        "MoveL p,slow,zw,tool0; MoveL p,v1000\\T:=4,z200,tool0; MoveJ p,vmax,fine,tool0; s:=Read(); MoveL p,[s,1,1,1],z0,tool0;",
        data,
    )
    assert [e.speed.v_tcp for e in found[:3]] == [12, 1000, 7000]
    assert (found[0].zone.pzone_tcp, found[1].zone.zone_ori, found[1].duration) == (2, 30, 4)
    # Where the arm goes does not depend on how fast.
    assert (found[3].reason, found[3].speed.v_tcp) == (None, 100)
    (finding,) = found[3].diagnostics
    assert finding.code == "RAP021" and "`Read` is a function this version does not know" in finding.message


def test_a_zone_from_elsewhere_does_not_keep_a_target_from_being_known() -> None:
    (found,) = events("MoveL p,v100,zoneAir,tool0;", P)
    assert (found.reason, found.zone.finep, found.zone.pzone_tcp) == (None, False, 50)
    (finding,) = found.diagnostics
    assert finding.code == "RAP021" and "the zone that `zoneAir` states is not known" in finding.message
    broken = "CONST zonedata zoneAir:=[FALSE,1,2];"
    assert events("MoveL p,v100,zoneAir,tool0;", P + broken)[0].reason is not None  # a typing error


def test_every_controller_has_speeds_of_external_axes() -> None:
    found = events("MoveJ p,vrot20,z0,tool0; MoveJ p,vlin1000,z0,tool0;", P)
    assert [(e.speed.v_leax, e.speed.v_reax) for e in found] == [(5000, 20), (1000, 1000)]
    assert not any(e.diagnostics for e in found)
    assert events("MoveJ p,vrot200,z0,tool0;", P)[0].diagnostics[0].code == "RAP021"


def test_a_speed_from_elsewhere_is_reported_once() -> None:
    data = (
        P
        + "CONST seamdata sm:=[0.5,0.2,[0,0,0,0,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0];"
    )
    found = events("MoveL p,vCell,z1,tool0; MoveJ p,vcell,z1,tool0; ArcL p,v10,sm,wdCell,z1,tool0;", data)
    said = [d.message for e in found for d in e.diagnostics if d.code == "RAP021"]
    assert [e.reason for e in found] == [None] * 3
    assert len(said) == 2 and "`vCell`" in said[0] and "`wdCell`" in said[1]
    assert found[2].weld is not None and found[2].weld.speed is None


def test_joint_targets() -> None:
    data = f"CONST jointtarget home:=[[1,2,3,4,5,6],{UNUSED}];VAR jointtarget j;"
    found = events(
        f"MoveAbsJ home\\NoEOffs,v5,z0,tool0; MoveAbsJ [[0,0,0,0,0,90],{UNUSED}],v5,z0,tool0; j:=CJointT(); MoveAbsJ j,v5,z0,tool0;",
        data,
    )
    assert found[0].target == JointTarget((1, 2, 3, 4, 5, 6), (9e9,) * 6)
    assert [e.target_origin.kind for e in found] == ["declared", "inline", "runtime"]
    assert found[0].statement.interpolation == "absjoint"


def test_circular_moves() -> None:
    event = events("MoveC p,q,v5,z0,tool0;", P)[0]
    assert event.via is not None
    assert (event.via.trans, places([event])) == ((0, 0, 0), [(10, 0, 0)])
    assert event.via_origin is not None
    assert event.via_origin.declaration == "m..p"
    unknown = events("MoveC CRobT(),q,v5,z0,tool0;", P)[0]
    assert unknown.target is None


@pytest.mark.parametrize(
    ("statement", "interpolation", "roles"),
    [
        ("MoveLDO p,v5,z0,t,do1,1", "line", "to speed zone tool signal value"),
        ("MoveCDO p,q,v5,z0,t,do1,1", "arc", "via to speed zone tool signal value"),
        ("MoveJSync p,v5,z0,t,\"go\"", "joint", "to speed zone tool procedure"),
        ("TriggL p,v5,on1\\T2:=on2,z0,t\\WObj:=wobj0", "line", "to speed trigg \\t2 zone tool \\wobj"),
        ("TriggC p,q,v5,on1,z0,t", "arc", "via to speed trigg zone tool"),
        ("SearchL\\Stop,di1,found,q,v5,t", "line", "\\stop signal found to speed tool"),
        ("SearchC di1,found,p,q,v5,t", "arc", "signal found via to speed tool"),
        ("Search_1D\\NotOff,found\\SearchStop:=q,p,q,v5,t", "line", "\\notoff found \\searchstop extra extra extra extra"),
        ("Search_Part found,p,q,v5,t\\WObj:=wobj0", "line", "found extra extra extra extra \\wobj"),
        ("ArcLStart p,v5,s,w,fine,t\\SeamName:=\"a\"", "line", "to speed seam weld zone tool \\seamname"),
        ("ArcCEnd p,q,v5,s,w\\Weave:=e,fine,t", "arc", "via to speed seam weld \\weave zone tool"),
        ("ArcL1 p,v5,s,w,z1,t", "line", "to speed seam weld zone tool"),
        ("ArcL2Start p,v5,s,w,fine,t", "line", "to speed seam weld zone tool"),
        ("CapL p,v5,c,ws,e,z1,t", "line", "to speed cap weavestart weave zone tool"),
        ("MoveExtJ [[0,0,0,0,0,0],[1,2,3,4,5,6]],v5,fine", "none", "to speed zone"),
        ("ArcMoveL p,v5,z0,t", "line", "to speed zone tool"),
    ],
)  # fmt: skip
def test_signatures(statement: str, interpolation: str, roles: str) -> None:
    data = P + TOOL + "VAR robtarget found;PERS seamdata s:=[0];PERS welddata w:=[9,0];"
    found = program(module(statement + ";", data))
    assert found.diagnostics == ()
    assert found.statements[0].interpolation == interpolation
    assert [a.role for a in found.statements[0].arguments] == roles.split()
    assert walk(found)[0].tool.name in ("t", "tool0")


def test_a_search_is_never_certain() -> None:
    event = events("SearchL\\Stop,di1,a,q,v5,tool0;", P + "VAR robtarget a;")[0]
    assert event.reason == "where a search stops is known only at run time"


def test_motion_without_known_arguments() -> None:
    found = events("ArcRepL \\Start,1,v5,s,w,e,z0,t; EGMMoveL e,p,v5,z0,t; Search_1D r,p,q,v5,t;", P)
    assert all(e.target is None and e.reason for e in found)


def test_every_statement_has_an_event_even_in_dead_code() -> None:
    body = f"IF FALSE THEN {move('1')} ENDIF RETURN; {move('2')}"
    result = walk_program(program(module(body, P)))
    assert [e.conditional for e in result.events] == [True, True]
    assert places(result.events) == [(1, 0, 0), (2, 0, 0)]


def test_loops_that_wait_do_not_hang() -> None:
    data = P + "PERS bool busy:=TRUE;VAR num n;"
    body = f"WHILE busy DO WaitTime 0.1; ENDWHILE WHILE n>=0 DO n:=n+1; ENDWHILE FOR i FROM 1 TO 1E9 DO n:=i; ENDFOR {move('1')}"
    assert x("n:=0;" + body, data) == [1]


def test_calls_that_multiply_are_cut_off_and_still_accounted_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(execution, "MAX_STEPS", 3000)
    routines = [f"PROC r{n}() r{n + 1}; r{n + 1}; ENDPROC " for n in range(24)]
    found = walk_program(program(module("r0;", P + "".join(routines) + f"PROC r24() {move('1')} ENDPROC")))
    assert [d.code for d in found.diagnostics] == ["RAP033"]
    assert len(found.events) > 0


def test_a_loop_index_in_a_handler_is_not_missing_data() -> None:
    found = walk_program(program(module(f"ERROR FOR i FROM 1 TO 2 DO {move('i')} ENDFOR", P)))
    assert [(e.reason, e.target.trans[0]) for e in found.events if e.target] == [(None, 1), (None, 2)]
    hidden = walk_program(program(module(f"RETURN; FOR i FROM 1 TO 2 DO {move('i')} ENDFOR", P)))
    assert [e.reason for e in hidden.events] == ["the loop index `i` is not known"]
    assert found.diagnostics == ()


def test_an_optional_parameter_hides_data_of_the_same_name() -> None:
    data = P + TOOL + "PERS tooldata u:=[TRUE,[[0,0,200],[1,0,0,0]],[3,[0,0,50],[1,0,0,0],0,0,0]];"
    data += "PROC go(\\PERS tooldata t) MoveL p,v5,z0,t; ENDPROC"
    assert [e.tool.tload.mass for e in events("go; go\\t:=u; go;", data)] == [2, 3, 2]


def test_turns_of_a_loop_run_with_what_is_in_force_and_their_own_numbers() -> None:
    body = f"VAR num n:=0; FOR i FROM 1 TO 6 DO {move('0')} {move('i')} {move('n')} IF i=3 THEN GripLoad part; n:=7; ENDIF ENDFOR"
    found = [e for e in events(body, P + LOADS)]
    still, index, data = found[0::3], found[1::3], found[2::3]
    assert [e.gripload.mass for e in still] == [0, 0, 0, 5, 5, 5]
    assert [e.target.trans[0] for e in index] == [1, 2, 3, 4, 5, 6]  # type: ignore[union-attr]
    assert [e.target.trans[0] for e in data] == [0, 0, 0, 7, 7, 7]  # type: ignore[union-attr]
    assert [dict(e.numbers)["i"] for e in still] == [1, 2, 3, 4, 5, 6]


GO = f"PROC go(num n) IF n<3 THEN {move('n')} ELSE {move('5')} ENDIF ENDPROC"


def test_a_branch_that_no_call_takes_makes_no_other_run_of_the_rest() -> None:
    found = events("go 1; go 2;", P + GO)
    assert [e.target.trans[0] if e.target else None for e in found] == [1, 2, 5]
    assert not any(e.has_unresolved_runs for e in found)


@pytest.mark.parametrize(
    "more",
    [
        "ERROR go 2; RETRY; ENDPROC PROC other()",
        "ENDPROC TRAP stopped go 2; ENDTRAP PROC other()",
    ],
)
def test_handlers_and_traps_call_with_what_they_know(more: str) -> None:
    data = P + f"VAR num n; PROC go(num n) {move('n')} ENDPROC PROC work() go 1; {more} ENDPROC"
    found = [e for e in events("work;", data) if e.statement.routine == "go"]
    assert [(e.target.trans[0], e.unreachable, e.first, e.has_unresolved_runs) for e in found if e.target] == [
        (1, False, True, False),
        (2, True, True, False),
    ]
    found = events("work;", data.replace("go 2", "go CPos().x"))
    assert [e.has_unresolved_runs for e in found if e.statement.routine == "go"] == [True]


def test_the_motions_of_a_handler_are_one_way() -> None:
    found = events(
        f"{move('1')} ERROR {move('2')} {move('3')} IF ERRNO=ERR_A THEN {move('4')} ENDIF {move('5')} RETRY;", P
    )
    assert [(e.target.trans[0], e.first, e.resumes_from) for e in found if e.target] == [
        (1, True, None), (2, True, None), (3, False, None), (4, False, None), (5, False, None), (3, False, 2),
        (5, False, None),
    ]  # fmt: skip


def test_a_routine_that_nobody_calls_hands_its_own_targets_on() -> None:
    data = P + f"PROC go(num n) {move('n')} MoveL p,v5,z0,tool0; ENDPROC PROC other() go 2; ENDPROC"
    found = [e for e in events("go 1;", data) if e.statement.routine == "go"]
    assert [(e.target.trans[0], e.unreachable, e.has_unresolved_runs) for e in found] == [
        (1, False, False),
        (0, False, False),
        (2, True, False),
    ]
    alone = walk(program(module("go 1;", data)), "main")
    assert [(e.target.trans[0], e.has_unresolved_runs) for e in alone] == [(1, True), (0, False)]


def test_a_routine_that_calls_itself_runs_elsewhere_too() -> None:
    data = P + f"PROC go(num n) {move('n')} IF DInput(d)=1 go n+1; ENDPROC"
    assert [(e.target.trans[0], e.has_unresolved_runs) for e in events("go 1;", data) if e.target] == [(1, True)]
    data = P + f"PROC go(num n) {move('n')} go n+1; ENDPROC"  # the controller stops some day
    assert {e.has_unresolved_runs for e in events("go 1;", data)} == {True}


def test_a_routine_that_calls_itself_is_followed_while_its_conditions_are_known() -> None:
    data = P + f"PROC go(num n) VAR num k:=0; k:=k+n; IF n<3 go n+1; {move('n+10*k')} ENDPROC"
    assert [(e.target.trans[0], e.has_unresolved_runs) for e in events("go 1;", data) if e.target] == [
        (33, False), (22, False), (11, False),
    ]  # fmt: skip
    data = P + "FUNC num fac(num n) IF n<2 RETURN 1; RETURN n*fac(n-1); ENDFUNC"
    assert x(move("fac(4)"), data) == [24]
    data = P + f"VAR num m:=2; PROC go(VAR num n) VAR num k; n:=n-1; k:=n; IF n>0 go k; {move('k')} ENDPROC"
    assert [e.reason is None for e in events("go m;", data)] == [False]  # it hands its own data to itself


MEASURED = 'PERS wobjdata w:=[FALSE,TRUE,"",[[1,2,3],[1,0,0,0]],[[4,5,6],[1,0,0,0]]];'
AT = "MoveL p,v5,z0,tool0\\WObj:=w;"


@pytest.mark.parametrize(
    "body, known",
    [
        (f"w.uframe:=[[7,0,0],[1,0,0,0]]; {AT} w.oframe:=[[9,0,0],[1,0,0,0]]; {AT}", [(7, 4), (7, 9)]),
        (f"w.uframe.trans:=[7,0,0]; w.uframe.rot:=[1,0,0,0]; w.oframe:=[[9,0,0],[1,0,0,0]]; {AT}", [(7, 9)]),
        (f"w.oframe.trans.x:=9; {AT}", [(1, 9)]),
        (f"w.oframe.trans.x:=CPos().x; {AT} w.oframe.trans.x:=8; {AT}", [None, (1, 8)]),
        (f"w.oframe.trans.x:=9; measure w; {AT}", [None]),
        (f"measure w; w.uframe:=[[7,0,0],[1,0,0,0]]; w.oframe:=[[9,0,0],[1,0,0,0]]; {AT}", [None]),
        (f"w.oframe.trans.x:=9; IF DInput(d)=1 w.oframe.trans.x:=8; {AT}", [(1, 8), (1, 9)]),
        (f"FOR i FROM 1 TO 2 DO w.oframe.trans.x:=i; {AT} ENDFOR", [(1, 1), (1, 2)]),
        (f"w.oframe.trans.x:=9; WHILE DInput(d)=1 DO {AT} w.oframe.trans.x:=CPos().x; ENDWHILE", [None]),
        (f"w.oframe.trans.x:=9; WHILE DInput(d)=1 DO w.uframe.trans.x:=7; {AT} w.oframe.trans.x:=3; ENDWHILE", [None]),
        (f"WHILE DInput(d)=1 DO w.oframe.trans.x:=9; {AT} w.oframe.trans.x:=3; ENDWHILE", [(1, 9), (1, 9)]),
    ],
)
def test_parts_that_nothing_writes_are_as_declared(body: str, known: list[tuple[float, float] | None]) -> None:
    """x of the user frame and of the object frame at every motion; None where the work object is not known."""
    found = events(body, P + MEASURED)
    seen = [None if e.reason else (e.wobj.uframe.trans[0], e.wobj.oframe.trans[0]) for e in found]
    assert seen == known


def test_the_root_of_what_a_function_displaces_is_its_target_among_others() -> None:
    data = (
        f"CONST robtarget row{{2}}:=[{target(0, 0, 0)},{target(10, 0, 0)}]; VAR num i; VAR num j; VAR num k;"
        "FUNC robtarget above(robtarget a) a.trans.z:=a.trans.z+5; RETURN a; ENDFUNC"
    )
    (found,) = events("i:=1; j:=2; k:=0; MoveL RelTool(above(row{i+j-1+k}),0,0,3),v5,z0,tool0;", data)
    root = found.target_origin.root
    assert root is not None and root.target.trans == (10, 0, 0)
    assert root.lever == pytest.approx((0, 0, -3))


def test_what_is_in_force_is_one_value_until_something_sets_it() -> None:
    data = f"CONST robtarget p:={target(1, 2, 3)};\nVAR speeddata v:=[100,500,5000,1000];"
    plain = f"MoveL p,v100,z10,tool0;\nMoveL {target(4, 5, 6)},v100,z10,tool0;\n"
    first, second, third, fourth = events(f"{plain}VelSet 50,400;\n{plain}", data)
    assert first.in_force is second.in_force and third.in_force is fourth.in_force
    assert [(e.velocity_override, e.velocity_limit) for e in (second, third)] == [(100.0, None), (50.0, 400.0)]
    assert first.tool is third.tool and first.zone == third.zone
    slow, fast = events("v.v_tcp:=50;\nMoveL p,v,z10,tool0;\nv.v_tcp:=900;\nMoveL p,v,z10,tool0;", data)
    assert (slow.speed.v_tcp, fast.speed.v_tcp) == (50.0, 900.0)
    on, off = events("MoveL p,v100,z10,tool0;\nMoveL p,v100,z10,tool0\\NoEOffs;", f"{data}\nVAR num n;")
    assert on.in_force is not off.in_force
