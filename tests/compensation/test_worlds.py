"""Original and corrected program in worlds where what the text leaves open differs."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from postproc.compensation.judgement.bounds import Bound, largest_corrections
from postproc.compensation.options import Options
from postproc.compensation.worlds import SEEDS, check_worlds, depends_on_run_time
from postproc.convert import compensate_program
from postproc.diagnostics import Source
from postproc.model.file import default_model
from postproc.rapid.data.records import RobTarget
from postproc.rapid.data.values import RECORDS
from postproc.rapid.execution.follower import WorldMotion, follow
from postproc.rapid.execution.walk import walk
from postproc.rapid.execution.worlds import World
from postproc.rapid.program.program import Program
from postproc.rapid.unknown import Kind, Unknown
from tests.rapid.build import module, program, target

DATA = f"""CONST robtarget p:={target(500, 0, 400)}; CONST robtarget q:={target(600, 50, 400)};
PERS num n:=5; PERS num up:=5; PERS robtarget pOut:={target(500, 0, 400)}; VAR robtarget r;
PERS wobjdata w:=[FALSE,TRUE,"",[[1,2,3],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
LOCAL VAR num k; PROC rSet1()
  n:=50;
ENDPROC
TRAP tSet
  n:=n+7;
ENDTRAP"""


def pair(before: str, after: str, data: str = DATA, changed: str | None = None) -> tuple[Program, Program]:
    return program(module(before, data)), program(module(after, changed or data))


def differing(
    before: str, after: str, bound: float = 0.5, added: Mapping[int, int] = {}, changed: str | None = None
) -> list[str]:
    """What is found when every statement has a correction of ``bound`` [mm]; ``added`` by statement of the original."""
    original, written = pair(before, after, changed=changed)
    keys = [s.key for s in original.statements]
    bounds = {key: Bound(bound, 0.001) for key in keys}
    worlds, findings = check_worlds(original, written, {keys[i]: n for i, n in added.items()}, bounds)
    assert worlds.count == len(SEEDS) and (worlds.differing > 0) == bool(findings)
    return [d.message for d in findings]


RELATIVE = [
    ("rMeasure; MoveL Offs(p,0,0,n),v5,z0,tool0;", "rMeasure; MoveL Offs(p,0.1,-0.02,n+0.3),v5,z0,tool0;"),
    ("n:=10; CallByVar \"rSet\",1; MoveL Offs(p,0,0,n),v5,z0,tool0;",
     "n:=10; CallByVar \"rSet\",1; MoveL Offs(p,0,0.1,n),v5,z0,tool0;"),
    ("IF di1=1 n:=8; MoveL Offs(p,0,0,n),v5,z0,tool0;", "IF di1=1 n:=8; MoveL Offs(p,0,0,n+0.2),v5,z0,tool0;"),
    ("MoveL pOut,v5,z0,tool0\\WObj:=w;", "MoveL Offs(pOut,0.1,0.1,0.1),v5,z0,tool0\\WObj:=w;"),
    ("r:=CRobT(); MoveL r,v5,z0,tool0;", "r:=CRobT(); MoveL Offs(r,0.1,0,0),v5,z0,tool0;"),
    ("WHILE DInput(di)=0 DO MoveL p,v5,z0,tool0; ENDWHILE", "WHILE DInput(di)=0 DO MoveL Offs(p,0,0,0.2),v5,z0,tool0; ENDWHILE"),
    ("FOR i FROM 1 TO n DO MoveL Offs(p,0,0,i),v5,z0,tool0; ENDFOR", "FOR i FROM 1 TO n DO MoveL Offs(p,0,0.1,i),v5,z0,tool0; ENDFOR"),
]  # fmt: skip


@pytest.mark.parametrize(("before", "after"), RELATIVE)
def test_relative_corrections_follow_what_changes(before: str, after: str) -> None:
    assert differing(before, after) == []
    assert differing(before, before, 0.0) == []


VALUES = [
    ("rMeasure; MoveL Offs(p,0,0,n),v5,z0,tool0;", f"rMeasure; MoveL {target(500.1, -0.02, 405.3)},v5,z0,tool0;"),
    ("MoveL Offs(p,0,0,n),v5,z0,tool0;", "MoveL Offs(p,0,0,5.1),v5,z0,tool0;"),
    ("MoveL p,v5,z0,tool0;", f"MoveL {target(500.1, 0, 400)},v5,z0,tool0;"),  # it no longer follows its point
    ("IF di1=1 n:=8; MoveL Offs(p,0,0,n),v5,z0,tool0;", "IF di1=1 n:=8; MoveL Offs(p,0,0,8.1),v5,z0,tool0;"),
    ("r:=CRobT(); MoveL r,v5,z0,tool0;", f"r:=CRobT(); MoveL {target(0, 0, 0)},v5,z0,tool0;"),
    ("MoveL pOut,v5,z0,tool0\\WObj:=w;",
     "MoveL pOut,v5,z0,tool0\\WObj:=[FALSE,TRUE,\"\",[[1,2,3],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];"),
]  # fmt: skip


@pytest.mark.parametrize(("before", "after"), VALUES)
def test_a_value_in_the_place_of_an_expression_is_found(before: str, after: str) -> None:
    (message,) = differing(before, after)
    assert message.startswith("where run-time data differs, the corrected program goes there in another frame" if "w;" in before
                              else "where run-time data differs, the corrected program goes ")  # fmt: skip


def test_changed_numbers_of_a_declaration_are_touched_up_alike() -> None:
    changed = DATA.replace("[[500,0,400],", "[[500.2,0,400],", 1)
    assert differing("MoveL p,v5,z0,tool0;", "MoveL p,v5,z0,tool0;", changed=changed) == []
    (message,) = differing("MoveL p,v5,z0,tool0;", "MoveL p,v5,z0,tool0;", 0.1, changed=changed)
    assert "0.200 mm from where the original goes, its correction is 0.100 mm" in message


def test_a_statement_that_is_left_out_or_run_twice_is_found() -> None:
    before = "MoveL p,v5,z0,tool0; IF DInput(di)=1 THEN MoveL q,v5,z0,tool0; ENDIF MoveL p,v5,z0,tool0;"
    assert differing(before, before.replace("DInput(di)=1", "FALSE"))
    assert differing(before, before.replace("DInput(di)=1", "TRUE"))


def test_added_targets_lie_on_the_way_in_every_world() -> None:
    """A7: with another height the arm would go up first.  A trap that sets the height would move it away as well."""
    before = "MoveL Offs(p,0,0,up),v5,z0,tool0; MoveL p,v5,z0,tool0;"
    follows = "MoveL Offs(p,0,0,up),v5,z0,tool0; MoveL Offs(p,0.1,0,up/2),v5,z0,tool0; MoveL p,v5,z0,tool0;"
    fixed = "MoveL Offs(p,0,0,up),v5,z0,tool0; MoveL Offs(p,0.1,0,2.5),v5,z0,tool0; MoveL p,v5,z0,tool0;"
    assert differing(before, follows, added={1: 1}) == []
    assert "off its way first" in differing(before, fixed.replace("2.5", "25"), added={1: 1})[0]
    stuck = f"MoveL Offs(p,0,0,up),v5,z0,tool0; MoveL {target(500.1, 0, 402.5)},v5,z0,tool0; MoveL p,v5,z0,tool0;"
    assert "off its way first" in differing(before, stuck, added={1: 1})[0]

    assert "off its way first" in differing(before.replace("up", "n"), follows.replace("up", "n"), added={1: 1})[0]


def test_an_endless_program_with_added_targets_is_followed_as_far_as_without() -> None:
    before = "WHILE TRUE DO MoveL p,v5,z0,tool0; MoveL q,v5,z0,tool0; ENDWHILE"
    share = ",".join(f"0.5*(p.trans.{axis}-q.trans.{axis})" for axis in "xyz")
    middle = f"MoveL Offs(q,{share}),v5,z0,tool0;"
    after = before.replace("MoveL q", f"{middle} MoveL q")
    assert differing(before, after, added={1: 1}) == []


def test_statements_of_an_added_function_do_not_end_the_program_earlier() -> None:
    """Between two motions the program counts: statements end what is followed of it, not motions."""
    before = f"WHILE TRUE DO MoveL p,v5,z0,tool0; {'k:=k+1; ' * 60} MoveL q,v5,z0,tool0; ENDWHILE"
    after = before.replace("MoveL q", "MoveL Half(p,q),v5,z0,tool0; MoveL q")
    half = f"""FUNC robtarget Half(robtarget s,robtarget g)
  VAR robtarget m; {"m:=s; " * 8} m.trans.x:=0.5*(s.trans.x+g.trans.x); m.trans.y:=0.5*(s.trans.y+g.trans.y);
  m.trans.z:=0.5*(s.trans.z+g.trans.z);
  RETURN m;
ENDFUNC"""
    assert differing(before, after, added={1: 1}, changed=f"{DATA}\n{half}") == []


@pytest.mark.parametrize(("way", "sound"), [(0.5, True), (0.0, False)])
def test_a_circle_point_may_be_corrected_as_its_way_is(way: float, sound: bool) -> None:
    """Its way may need more than its goal does."""
    arc = "IF di1=1 MoveL p,v5,z0,tool0; MoveL p,v5,z0,tool0; MoveC Offs(p,50,{},0),q,v5,z0,tool0;"
    original, written = pair(arc.format(60), arc.format(60.7))
    bounds = {s.key: Bound(0.1, 0.001, way) for s in original.statements}
    _, findings = check_worlds(original, written, {}, bounds)
    assert (findings == []) is sound


def test_bounds_are_those_of_the_corrected_curve() -> None:
    arc = f"MoveJ {target(1150, -500, 960)},v200,fine,tool0; MoveC {target(1300, -300, 960)},{target(1350, -100, 960)},v50,fine,tool0;"
    options = replace(Options(), inertia=False, force=(600.0, -600.0, -600.0))
    found = compensate_program(Source("a.mod", module(arc)), default_model("irb4600_60_205"), options)
    assert found.plan is not None
    moves, samples = found.plan.motion.moves, found.plan.motion.samples
    apart = 1e3 * np.linalg.norm(found.plan.curve[:, :3, 3] - samples.T_work_tcp[:, :3, 3], axis=1)
    bounds = largest_corrections(found.outcomes, found.plan)
    for i, (first, last) in enumerate(zip(samples.start, [*samples.start[1:], len(apart)], strict=True)):
        most, bound = apart[first:last].max(), bounds[moves[i].event.statement.key]
        assert 0.3 < most <= bound.way < 1.2 * apart.max() + 0.1


def test_other_tools_are_found() -> None:
    assert "another tool" in differing("MoveL p,v5,z0,tool0;", "MoveL p,v5,z0,[TRUE,[[0,0,1],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];")[0]  # fmt: skip


# -- the follower ------------------------------------------------------------------------------------------------------


def followed(body: str, seed: int = 1, data: str = DATA) -> list[WorldMotion]:
    text = program(module(body, data))
    taught = frozenset(d.key for d in text.declarations)
    return follow(text, None, World(seed, taught), {s.key: i for i, s in enumerate(text.statements)})


def heights(body: str, seed: int = 1) -> list[float]:
    """z of every goal above that of p."""
    first, *rest = (m.target.trans[2] for m in followed(f"MoveL p,v5,z0,tool0; {body}", seed))  # type: ignore[union-attr]
    return [pytest.approx(z - first, abs=1e-4) for z in rest]


def test_loops_jumps_and_calls_run_as_they_are_written() -> None:
    at = "MoveL Offs(p,0,0,k),v5,z0,tool0;"
    assert heights(f"FOR i FROM 1 TO 3 DO k:=i; {at} ENDFOR") == [1, 2, 3]
    assert heights(f"FOR i FROM 2 TO 1 DO k:=i; {at} ENDFOR") == [2, 1]
    assert heights(f"k:=0; again: k:=k+1; {at} IF k<3 GOTO again; k:=9; {at}") == [1, 2, 3, 9]
    assert heights(f"k:=0; WHILE k<1 DO k:=k+0.25; {at} ENDWHILE") == [0.25, 0.5, 0.75, 1]
    assert heights(f"k:=4; TEST k CASE 1,2: k:=7; CASE 3,4: k:=8; DEFAULT: k:=9; ENDTEST {at}") == [8]
    assert heights(f"k:=1; RETURN; {at}") == []
    assert heights(f"k:=1; IF TRUE THEN EXIT; ENDIF {at}") == []


def test_worlds_differ_and_one_seed_is_one_world() -> None:
    body = "rMeasure; IF di1=1 THEN MoveL Offs(p,0,0,n),v5,z0,tool0; ENDIF MoveL q,v5,z0,tool0; MoveL p,v5,z0,tool0;"
    runs = [[m.target for m in followed(body, seed)] for seed in SEEDS]
    assert runs == [[m.target for m in followed(body, seed)] for seed in SEEDS]
    assert len({str(run) for run in runs}) == len(SEEDS) and len({len(run) for run in runs}) == 2


def test_what_a_world_answers_does_not_depend_on_other_questions() -> None:
    body = "MoveL Offs(p,0,0,AInput(ai)),v5,z0,tool0;"
    more = "k:=GInput(gi); IF di7=1 k:=2; " + body
    assert [m.target for m in followed(body)] == [m.target for m in followed(more)]


def test_data_that_is_read_once_more_stays_what_it_is() -> None:
    """An added target reads what the original does not, between two calls that may have written it."""
    last = "n:=Seen(); MoveL pOut,v5,z0,tool0;"
    assert differing(f"n:=Seen(); {last}", f"n:=Seen(); r:=pOut; {last}") == []


def test_data_of_which_a_part_is_not_known_has_a_value() -> None:
    open_ = Unknown(Kind.MAY_BE_WRITTEN)
    conf, axes = (0.0, 0.0, open_, 0.0), (9e9,) * 5 + (open_,)
    parts = (open_, 2.0, 3.0), (1.0, open_, 0.0, 0.0), conf, axes
    place, rot, conf, axes = World(1, frozenset()).varied(parts, "robtarget", RECORDS, random.Random(1))  # type: ignore[misc]
    assert np.abs(np.subtract(place, (0, 2, 3))).max() <= 10
    assert (rot, conf, axes) == ((1.0, 0.0, 0.0, 0.0), (0.0,) * 4, (9e9,) * 5 + (0.0,))


PROCESS = (
    "PERS welddata wd:=[9,0,[0,0,26,9],[0,0,0,0]];",
    "PERS seamdata sm:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0];",
    "PERS weavedata wv:=[1,0,3,2,0];",
    "PERS trackdata tr:=[0,FALSE,0,[0,0]];",
    "RECORD station robtarget place; num n; ENDRECORD PERS station st{2,3};",
    "PERS robtarget st{2};",
    "PERS num st{3};",
    "VAR robtarget st{nSize};",
)


@pytest.mark.parametrize(
    ("data", "write"),
    [
        (PROCESS[0], "wd.weld_speed:=10;"), (PROCESS[0], "wd.main_arc.voltage:=25;"), (PROCESS[0], "rAny wd.org_arc;"),
        (PROCESS[1], "sm.purge_time:=1;"), (PROCESS[2], "wv.weave_width:=4;"), (PROCESS[3], "tr.track_system:=1;"),
        (PROCESS[4], "st{1,2}.n:=4;"), (PROCESS[4], "rAny st{2,3}.place;"), (PROCESS[5], "st{2}:=p; rAny st{1};"),
        (PROCESS[6], "st{2}:=4;"), (PROCESS[7], "st{2}.trans.x:=4;"),
    ],
)  # fmt: skip
def test_a_part_of_any_record_or_array_may_be_written(data: str, write: str) -> None:
    """Records of process options differ between versions; data without a value has that of its type in every element."""
    before = f"{write} IF di1=1 MoveL p,v5,z0,tool0; MoveL q,v5,z0,tool0;"
    records, _, rest = data.rpartition("ENDRECORD ")
    data = f"{records + 'ENDRECORD ' if records else ''}{rest} {DATA}"
    text = program(module(before, data))
    worlds, findings = check_worlds(text, text, {}, {})
    assert (worlds.count, worlds.differing, findings) == (len(SEEDS), 0, [])
    for seed in SEEDS:
        assert followed(before, seed, data)[-1].target is not None


def test_elements_of_an_array_without_a_value_are_records() -> None:
    goal = "MoveL st{2,3}.place,v5,z0,tool0; MoveL st{1,1}.place,v5,z0,tool0; "
    targets = [m.target for m in followed(goal * 2, data=f"{PROCESS[4]} {DATA}")]
    assert targets[:2] == targets[2:] and all(isinstance(t, RobTarget) for t in targets), targets


def test_a_program_without_end_is_left() -> None:
    assert len(followed("WHILE TRUE DO MoveL p,v5,z0,tool0; ENDWHILE")) == 3000
    assert followed("k:=0; WHILE TRUE DO k:=k+1; ENDWHILE MoveL p,v5,z0,tool0;") == []


def test_procedures_of_motions_and_traps_run() -> None:
    assert heights('n:=1; MoveLSync p,v5,z0,tool0,"rSet1"; MoveL Offs(p,0,0,n),v5,z0,tool0;')[-1] in (50, 57)
    many = "n:=0; " + "MoveL p,v5,z0,tool0; " * 60 + "MoveL Offs(p,0,0,n),v5,z0,tool0;"
    assert len({str(heights(many, seed)[-1]) for seed in SEEDS}) > 1


@pytest.mark.parametrize(
    ("body", "depends"),
    [
        ("MoveL p,v5,z0,tool0; MoveL q,v5,z0,tool0;", False), ("MoveL Offs(p,0,0,n),v5,z0,tool0;", True),
        ("IF di1=1 THEN MoveL p,v5,z0,tool0; ENDIF", True), ("rGo; MoveL p,v5,z0,tool0;", True),
    ],
)  # fmt: skip
def test_programs_that_run_alike_whatever_happens_are_not_followed(body: str, depends: bool) -> None:
    data = f"CONST robtarget p:={target(5, 0, 4)}; CONST robtarget q:={target(6, 5, 4)}; PERS num n:=5;"
    assert depends_on_run_time(walk(program(module(body, data)))) is depends


def test_a_soft_arm_may_turn_the_tool_as_far_as_its_correction_does() -> None:
    places = [target(400, y, 300, conf="[0,0,2,0]") for y in (10, 60)]
    body = f"IF di1=1 MoveJ {places[0]},v100,fine,tool0; MoveL {places[1]},v100,fine,tool0;"
    soft = replace(Options(), inertia=False, force=(600.0, -600.0, -600.0), largest_correction_m=0.05)
    source = Source("soft.mod", module(body))
    found = compensate_program(source, default_model("irb120_3_058"), soft)
    assert found.plan is not None
    told, wanted = found.plan.exact.T_work_tcp[:, :3, :3], found.plan.motion.samples.T_work_tcp[:, :3, :3]
    turned = np.einsum("nij,nij->n", told, wanted)
    assert np.degrees(np.arccos(np.clip((turned.min() - 1) / 2, -1, 1))) > 1.2
    assert [d.code for d in found.diagnostics if d.severity == "error"] == []
    assert found.report["worlds"]["count"] == len(SEEDS)
