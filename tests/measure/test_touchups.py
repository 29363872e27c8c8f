"""Targets that a person taught anew: which they are, and what a table of them tells of an arm in plain numpy."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.effects.registry import effect_library
from postproc.identification.add import fit_effects
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.measure.touchups import (
    DISPLACED_IN_STATEMENT,
    JOINTS,
    PROGRAMMED_ANEW,
    ROBOT_HOLDS,
    SEVERAL_CONDITIONS,
    TURNED,
    TouchUps,
    find_touchups,
    share_deviation,
    touchup_findings,
    touchup_table,
    with_kept_originals,
)
from postproc.model.arm import Model
from postproc.model.equilibrium import equilibrium, predict
from postproc.model.file import default_model, parse_model
from postproc.rapid.program.program import read_program
from postproc.robot.cells.station import Station
from tests.independent import arm as A
from tests.independent import touched_up as S

NAME = "irb4600_60_205"
TYPE = default_model(NAME)
ARM = A.ARMS[NAME]()
FITTED = ("instrument_frame", "joint_offset", "joint_compliance")
X = "[9E9,9E9,9E9,9E9,9E9,9E9]"
DATA = """  PERS tooldata tA:=[TRUE,[[0,0,300],[1,0,0,0]],[4,[10,0,80],[1,0,0,0],0,0,0]];
  PERS tooldata tB:=[TRUE,[[0,0,200],[1,0,0,0]],[4,[10,0,80],[1,0,0,0],0,0,0]];
  PERS tooldata tStands:=[FALSE,[[1200,0,900],[1,0,0,0]],[4,[0,0,80],[1,0,0,0],0,0,0]];
  PERS wobjdata wHeld:=[TRUE,TRUE,"",[[0,0,100],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS wobjdata wA:=[FALSE,TRUE,"",[[800,100,300],[0.9659258,0,0,0.2588190]],[[0,50,0],[1,0,0,0]]];
  PERS loaddata part:=[6,[0,0,100],[1,0,0,0],0,0,0];
"""


def target(x: float = 400, y: float = 0, z: float = 100, turn: str = "0,1,0,0") -> str:
    return f"[[{x},{y},{z}],[{turn}],[0,0,0,0],{X}]"


def found(before: str, after: str) -> TouchUps:
    programs = [
        read_program(Source("m.mod", f"MODULE M\n{DATA}{text}ENDMODULE\n".encode())) for text in (before, after)
    ]
    assert [d for program in programs for d in program.diagnostics if d.severity == "error"] == []
    return find_touchups(*programs, TYPE.robot, Station())


def body(*lines: str, targets: str = "") -> str:
    steps = "".join(f"    {line}\n" for line in lines)
    return f"{targets}  PROC main()\n{steps}  ENDPROC\n"


def moved(by: str, statement: str = "MoveL {},v100,fine,tA\\WObj:=wA;", was: str = target()) -> TouchUps:
    return found(body(statement.format(was)), body(statement.format(by)))


def test_a_touched_target_has_its_joints_now_and_its_place_before() -> None:
    one = moved(target(401, 0.5, 100.25))
    (use,) = one.rows
    assert (
        one.compared == 1 and use.moved == pytest.approx([1, 0.5, 0.25]) and use.nominal == pytest.approx([400, 0, 100])
    )
    assert use.move is not None
    tcp = ARM.forward(use.move.q, A.shift(0, 0, 0.3)).tcp[0]
    wobj = A.transform(A.rotation(np.array([0, 0, 1.0]), np.array(np.pi / 6)), np.array([0.8, 0.1, 0.3])) @ A.shift(
        0, 0.05
    )
    assert np.linalg.inv(wobj) @ tcp @ [0, 0, 0, 1] == pytest.approx([0.401, 0.0005, 0.10025, 1], abs=1e-6)


@pytest.mark.parametrize(
    ("touched", "reason"),
    [
        (target(400.04), ""),
        (target(turn="0,1,0.01,0"), TURNED),
        (target(460), PROGRAMMED_ANEW),
        (target(400.05, turn="0,1,0.01,0"), None),
        (target(449), None),
    ],
)
def test_what_is_no_touch_up_gives_no_row(touched: str, reason: str | None) -> None:
    """None: it is one; empty: the target was not changed."""
    one = moved(touched)
    assert len(one.rows) == (reason is None) and +one.omitted == ({reason: 1} if reason else {})


@pytest.mark.parametrize(
    ("lines", "rows", "omitted"),
    [
        (["MoveL p,v100,fine,tA\\WObj:=wA;", "MoveL p,v50,fine,tA\\WObj:=wA;"], 1, {}),
        (
            ["MoveL p,v100,fine,tA\\WObj:=wA;", "MoveL Offs(p,0,0,50),v50,fine,tA\\WObj:=wA;"],
            1,
            {DISPLACED_IN_STATEMENT: 1},
        ),
        (["MoveL RelTool(p,0,0,-50),v50,fine,tA\\WObj:=wA;"], 0, {DISPLACED_IN_STATEMENT: 1}),
        (["MoveL p,v100,fine,tA\\WObj:=wA;", "MoveL p,v50,fine,tB\\WObj:=wA;"], 0, {SEVERAL_CONDITIONS: 1}),
        (
            ["MoveL p,v100,fine,tA\\WObj:=wA;", "GripLoad part;", "MoveL p,v50,fine,tA\\WObj:=wA;"],
            0,
            {SEVERAL_CONDITIONS: 1},
        ),
        (["MoveL p,v100,fine,tStands\\WObj:=wHeld;"], 0, {ROBOT_HOLDS: 1}),
        (["MoveJ p2,v100,fine,tA\\WObj:=wA;", "MoveC p,p3,v50,fine,tA\\WObj:=wA;"], 1, {}),
        (["rTo p;"], 1, {}),
        (["MoveAbsJ j,v100,fine,tA;"], 0, {JOINTS: 1}),
    ],
)
def test_a_target_counts_once_where_it_is_known_with_what_it_was_taught(
    lines: list[str], rows: int, omitted: dict[str, int]
) -> None:
    def program(p: str, j: float) -> str:
        joints = f"  CONST jointtarget j:=[[0,{j},10,0,40,0],{X}];\n"
        others = f"  CONST robtarget p2:={target(380, -100)};\n  CONST robtarget p3:={target(380, 100)};\n"
        route = "  PROC rTo(robtarget q)\n    MoveL q,v100,fine,tA\\WObj:=wA;\n  ENDPROC\n"
        return body(*lines, targets=f"  CONST robtarget p:={p};\n{others}{joints}") + route

    one = found(program(target(), 10), program(target(401), 10.2))
    assert (len(one.rows), +one.omitted) == (rows, omitted)
    assert [use.name for use in one.rows] == ["p"] * rows


def test_inserted_statements_leave_the_pairs_as_they_are() -> None:
    lines = [f"MoveL p{i},v100,fine,tA\\WObj:=wA;" for i in range(6)]

    def program(lines: list[str], dx: float) -> str:
        places = [target(300 + 20 * i + dx * (i in (1, 4)), 30 * i) for i in range(6)]
        return body(*lines, targets="".join(f"  CONST robtarget p{i}:={p};\n" for i, p in enumerate(places)))

    one = found(
        program(lines, 0.0), program([*lines[:2], "MoveL " + target(350, 45) + ",v9,fine,tA;", *lines[2:]], 0.7)
    )
    assert [use.name for use in one.rows] == ["p1", "p4"]


@pytest.mark.parametrize(("together", "shifted"), [(2, 0), (3, 3), (5, 5)])
def test_targets_that_were_moved_by_one_vector_give_no_rows(together: int, shifted: int) -> None:
    before = [target(300 + 20 * i, 30 * i) for i in range(6)]
    after = [target(300.5 + 20 * i if i < together else 300.2 + 20.11 * i, 30 * i) for i in range(6)]
    line = "MoveL {},v100,fine,tA\\WObj:=wA;"
    one = found(body(*map(line.format, before)), body(*map(line.format, after)))
    assert (len(one.shifted), len(one.rows)) == (shifted, 6 - shifted)
    codes = [f.code for f in touchup_findings(one, None, [])]
    assert codes == ["DAT050"] * (shifted > 0)


def test_originals_that_the_controller_keeps_beside_targets() -> None:
    targets = f"  CONST robtarget o_p50:={target()};\n  CONST robtarget p50:={target(401)};\n"
    targets += f"  CONST robtarget o_only:={target()};\n  CONST robtarget p60:={target(300)};\n"
    lines = [f"MoveL {name},v100,fine,tA\\WObj:=wA;" for name in ("p50", "p60")]
    touched = read_program(Source("m.mod", f"MODULE M\n{DATA}{body(*lines, targets=targets)}ENDMODULE\n".encode()))
    nominal = read_program(with_kept_originals(touched))
    one = find_touchups(nominal, touched, TYPE.robot, Station())
    assert [(use.name, use.moved.tolist()) for use in one.rows] == [("p50", [1, 0, 0])]


def shop(
    seed: int, zero: float = 0.0, objects: int = 1, count: int = 30, fixed: bool = False
) -> tuple[S.Job, S.Real, TouchUps]:
    g = np.random.default_rng(seed)
    real, job = S.draw_real(g, zero), S.draw_job(g, ARM, count, objects)
    stands = (
        A.small(0.0 if fixed else g.normal(0, 1e-3, (objects, 6))) if not fixed else np.tile(np.eye(4), (objects, 1, 1))
    )
    T = S.touch_up(job, real, stands, g.normal(0, 0.25e-3, (count, 3)))
    texts = S.program(job, job.T), S.program(job, T, 2)
    programs = [read_program(Source("m.mod", text.encode())) for text in texts]
    return job, real, find_touchups(*programs, TYPE.robot, Station())


def as_read(touched: TouchUps, free: bool = True) -> Measurements:
    return read_measurements(Source("t.csv", touchup_table(touched, [], 0.3, free).encode()), TYPE.robot)


def test_the_table_states_where_the_work_is_and_with_what_it_was_touched() -> None:
    job, _, touched = shop(0, objects=2)
    rows = list(csv.DictReader(io.StringIO(touchup_table(touched, [], 0.25, True))))
    assert {row["session"] for row in rows} == {"wFix0", "wFix1"} and {row["sigma_mm"] for row in rows} == {"0.25"}
    data = as_read(touched)
    assert data.tool_known and data.state.T_flange_tcp[0] == pytest.approx(S.TOOL)
    at = {f"p{10 * i + 10}": T[:3, 3] for i, T in enumerate(job.T)}
    assert data.position == pytest.approx(np.array([at[name] for name in data.pose_id]), abs=2e-6)
    in_base = as_read(touched, free=False)
    assert in_base.position == pytest.approx(data.position, abs=1e-6) and in_base.state.session is None
    frame = np.linalg.inv(job.frames[job.which[0]])
    stated = [float(rows[0][f"{axis}_mm"]) for axis in "xyz"]
    assert stated == pytest.approx(1e3 * (frame @ job.T[0])[:3, 3], abs=1e-3)


def rigid_part(points: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """What is left (n, 3) of small shifts after the best rigid motion of the points: where work stands is not told."""
    x, y, z = points.T
    zero, one = np.zeros_like(x), np.ones_like(x)
    by = [[one, zero, zero, zero, z, -y], [zero, one, zero, -z, zero, x], [zero, zero, one, y, -x, zero]]
    columns = np.transpose(np.array(by), (2, 0, 1)).reshape(-1, 6)
    return (shifts.ravel() - columns @ np.linalg.lstsq(columns, shifts.ravel(), rcond=None)[0]).reshape(-1, 3)


def off(job: S.Job, real: S.Real, model: Model | None) -> float:
    """Rms distance [m] of the real arm from the targets of another program that the model corrects, without rigid part."""
    q, place = S.joints(job, job.T), job.T[:, :3, 3]
    shifts = S.bent(job, q, real) - place
    if model is not None:
        effects = [e for e in model.effects if e.key in ("joint_offset", "joint_compliance")]
        n = len(q)
        state = model.state(q, payload_mass=np.full(n, S.LOAD.mass), payload_center=np.tile(S.LOAD.center, (n, 1)))
        state = state.with_(T_flange_tcp=S.TOOL)
        shifts = shifts - (predict(model.with_effects(*effects), state)[:, :3, 3] - place)
    return float(np.sqrt(np.mean(np.sum(rigid_part(place, shifts) ** 2, axis=1))))


@pytest.mark.parametrize(("zero", "objects"), [(0.0, 1), (5e-4, 3)])
def test_thirty_touch_ups_take_away_half_of_what_the_arm_is_off_anywhere(zero: float, objects: int) -> None:
    """On three arms with springs off by 0.4 to 2.5, without and with joint zeros that are off, judged on other targets."""
    library, before, after = effect_library(), [], []
    for seed in range(3):
        _, real, touched = shop(seed, zero, objects)
        fit = fit_effects(Model(TYPE.robot, robot_name=NAME), as_read(touched), [library[key] for key in FITTED])
        others = S.draw_job(np.random.default_rng(1000 + seed), ARM, 30)
        before.append(off(others, real, None))
        after.append(off(others, real, fit.model))
    assert np.sum(after) < 0.5 * np.sum(before)


def test_few_targets_in_each_of_many_work_objects_still_tell_something() -> None:
    """Two targets a fixture leave nothing to the arm but their distance, and what no fixture stands off by."""
    _, real, touched = shop(3, 1e-3, objects=10, count=20)
    library = effect_library()
    fit = fit_effects(Model(TYPE.robot, robot_name=NAME), as_read(touched), [library[key] for key in FITTED])
    others = S.draw_job(np.random.default_rng(1003), ARM, 30)
    assert off(others, real, fit.model) < 0.8 * off(others, real, None)
    assert len(fit.model.effect("work_object").vector()) == 9 * 6


def test_how_well_the_arm_is_told_from_its_work() -> None:
    """Work that stands where the program says tells it better; poses side by side tell nothing."""
    _, _, wide = shop(1)
    near = TouchUps(wide.rows[:1] * 3)
    free, fixed = share_deviation(wide, TYPE, 0.3, True), share_deviation(wide, TYPE, 0.3, False)
    assert fixed < free < 0.5 and share_deviation(near, TYPE, 0.3, True) > 1e3
    assert [f.code for f in touchup_findings(near, share_deviation(near, TYPE, 0.3, True), [])] == ["DAT051"]
    assert list(touchup_findings(wide, free, [])) == []


TRACK = '[[external_axes]]\naxis = "a"\nkind = "linear"\ncarries = "robot"\nlimits = [-100, 4000]\n'
TABLE = '[[external_axes]]\naxis = "b"\nkind = "rotary"\ncarries = "work"\nunit = "STN1"\nxyz_mm = [1200, 0, 300]\n'
ON_TABLE = '  PERS wobjdata wT:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[30,0,40],[1,0,0,0]]];\n'


@pytest.mark.parametrize(("wobj", "axes"), [("wA", "700,9E9"), ("wT", "700,25")])
def test_rows_of_an_arm_on_a_track_and_of_work_on_a_table(wobj: str, axes: str) -> None:
    """The nominal arm, where the table is read with its cell, stands at the place before plus the way it was moved."""
    station = parse_model(Source("m.toml", f'robot = "{NAME}"\n{TRACK}{TABLE}'.encode())).station
    assert station is not None
    texts = []
    for dx in (0.0, 0.8):
        y = 30 if wobj == "wT" else -300
        place = target(100 + dx if wobj == "wT" else 900 + dx, y, 300).replace("9E9,9E9", axes, 1)
        line = f"MoveJ {place},v100,fine,tA\\WObj:={wobj};"
        texts.append(f"MODULE M\n{DATA}{ON_TABLE}{body(line)}ENDMODULE\n")
    one = find_touchups(*(read_program(Source("m.mod", text.encode())) for text in texts), TYPE.robot, station)
    assert len(one.rows) == 1
    table = Source("t.csv", touchup_table(one, [], 0.3, True).encode())
    data = read_measurements(table, TYPE.robot, terms=Reading(station=station))
    tcp = equilibrium(Model(TYPE.robot, station=station), data.state).T_reference_tcp[0, :3, 3]
    assert data.T_frame_object is not None
    assert tcp - data.position[0] == pytest.approx(data.T_frame_object[0, :3, :3] @ [8e-4, 0, 0], abs=2e-6)
