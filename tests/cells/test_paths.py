"""Programs with tracks, gantries and positioners: the real arm keeps the programmed path on the moving work.

The checker is an independent arm on an independent cell. Every test is repeated with that cell altered (another gravity,
a base beside its place, an axis the other way round): then the same check has to fail.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.diagnostics import Source
from postproc.model.arm import Model
from postproc.model.file import parse_model
from postproc.robot.cells.mechanical_units import read_cell
from postproc.robot.cells.station import station_of
from postproc.robot.controller import Backup, read_entries
from postproc.runtime.passes import correct_program
from tests.cells import world as W
from tests.independent import arm as A
from tests.independent import rapid as R
from tests.independent.legal import check_text

FORCE = (200.0, -200.0, -200.0)
LIMIT = 0.01  # [mm]
MODEL = """robot = "irb4600_60_205"
{mounting}
[effects.joint_compliance]
compliance_rad_per_Nm = [{compliance}]
{axes}
"""
DOWN = np.array([0.0, 1.0, 0.0, 0.0])  # the torch's tool0 looks at the floor


def axis(letter: str, kind: str, carries: str, **more: object) -> str:
    lines = {"axis": f'"{letter}"', "kind": f'"{kind}"', "carries": f'"{carries}"', **more}
    return "[[external_axes]]\n" + "\n".join(f"{key} = {value}" for key, value in lines.items()) + "\n"


def quaternion(about: tuple[float, float, float], degrees: float) -> np.ndarray:
    return R.matrix_quaternion(A.rotation(np.array(about), np.radians(degrees)))


def turned(about: tuple[float, float, float], degrees: float, first: np.ndarray = DOWN) -> np.ndarray:
    return R.matrix_quaternion(A.rotation(np.array(about), np.radians(degrees)) @ R.quaternion_matrix(first))


@dataclass(frozen=True)
class Case:
    """A cell as a model file states it, the same in plain numpy, and a program on it; worlds that are not that one."""

    axes: str
    world: W.World
    text: str
    wrong: dict[str, W.World]
    mounting: str = ""


def corrected(case: Case) -> str:
    result = converted(case, force=FORCE)
    assert result.output is not None, [str(d) for d in result.diagnostics]
    assert not [s for s in result.report["statements"] if s["status"] == "skipped"]
    return result.output.decode()


def model(axes: str = "", mounting: str = "") -> Model:
    """The arm of these tests, carried as a model file states it."""
    compliance = ",".join(f"{c:.12g}" for c in A.TABLE_2)
    text = MODEL.format(mounting=mounting, compliance=compliance, axes=axes)
    return parse_model(Source("m.toml", text.encode()))


def converted(case: Case, **options: Any) -> Conversion:
    stated = Options(**{"tolerance_m": 1e-5, "inertia": False, **options})
    return correct_program(Source("p.mod", case.text.encode()), model(case.axes, case.mounting), stated)


ARM = A.irb4600()


def wrong(world: W.World, letter: int, unit: str = "") -> dict[str, W.World]:
    """Worlds that are not the one of a program: other gravity, other base, and an axis that goes the other way."""

    def backward(place: W.Place) -> W.Place:
        return lambda axes: place(axes * np.where(np.arange(6) == letter, -1.0, 1.0))

    moved = W.after(lambda axes: W.still(axes) @ A.shift(0.2, 0.1, -0.2), world.base)
    turned_back = {"units": {unit: backward(world.units[unit])}} if unit else {"base": backward(world.base)}
    return {
        "gravity": replace(world, down=np.array([0.0, 9.81, 0.0])),
        "base": replace(world, base=moved),
        "sign": replace(world, **turned_back),
    }


def track(*extax: float) -> Case:
    world = W.World(base=W.slide(0, (1.0, 0.0, 0.0)))
    x = [1100.0 + value for value in extax]
    goals = [
        W.Goal((x[0], -400, 700), DOWN, {0: extax[0]}, "MoveJ"),
        W.Goal((x[0], -400, 600), DOWN, {0: extax[0]}, "ArcLStart"),
        W.Goal((x[1] + 100, 350, 620), turned((0, 0, 1), 20), {0: extax[1]}, "ArcL"),
        W.Goal((x[2], 400, 620), turned((0, 0, 1), 40), {0: extax[2]}, "ArcLEnd"),
        W.Goal((x[2], 400, 720), turned((0, 0, 1), 40), {0: extax[2]}, "MoveL"),
    ]
    text = W.program(ARM, world, goals)
    return Case(axis("a", "linear", "robot", unit='"TRACK_1"'), world, text, wrong(world, 0))


def placed(
    xyz: tuple[float, float, float], about: tuple[float, float, float], degrees: float
) -> tuple[np.ndarray, str]:
    """A frame (4, 4) [m], and the same as keys of a model file [mm]."""
    q = np.round(quaternion(about, degrees), 9)
    T = A.transform(R.quaternion_matrix(q), np.array(xyz) / 1000)
    return T, f"xyz_mm = {list(xyz)}\nquat = {q.tolist()}\n"


def gantry() -> Case:
    """Two axes, along x and y, carry an arm that hangs: the world of the program is its base with both at zero."""
    world = W.World(base=W.after(W.slide(0, (1.0, 0, 0)), W.slide(1, (0, 1.0, 0))), down=np.array([0, 0, 9.81]))
    steps = ((400, 300, "MoveJ"), (400, 300, "ArcLStart"), (900, 700, "ArcL"), (1600, 500, "ArcLEnd"))
    goals = [
        W.Goal((a + 1000, b + 250 - 120 * k, 650 if k else 750), turned((0, 0, 1), 15 * k), {0: a, 1: b}, move)
        for k, (a, b, move) in enumerate(steps)
    ]
    _, frame = placed((0, 0, 0), (0, 0, 1), 90)
    axes = axis("a", "linear", "robot", unit='"GANTRY"') + axis("b", "linear", "robot", unit='"GANTRY"') + frame
    others = wrong(world, 0) | {"standing": replace(world, down=-world.down)}
    return Case(axes, world, W.program(ARM, world, goals), others, "[mounting]\nrpy_deg = [180, 0, 0]")


def positioner(*degrees: float) -> Case:
    """One axis, leaning by 20 degrees, carries the work; the seam is a line on it, then an arc."""
    frame, keys = placed((1150, 150, 450), (1, 0, 0), 20)
    world = W.World(units={"STN1": W.turn(1, (0, 0, 1.0), frame)})
    start, middle, end = degrees
    goals = [
        W.Goal((150, -250, 250), DOWN, {1: start}, "MoveJ"),
        W.Goal((150, -250, 150), DOWN, {1: start}, "ArcLStart"),
        W.Goal((180, 200, 150), turned((0, 0, 1), 10), {1: middle}, "ArcL"),
        W.Goal((60, 320, 150), turned((0, 0, 1), 30), {1: end}, "ArcCEnd", (140, 285, 150)),
        W.Goal((60, 320, 250), turned((0, 0, 1), 30), {1: end}, "MoveL"),
    ]
    text = W.program(ARM, world, goals, "STN1")
    axes = axis("b", "rotary", "work", unit='"STN1"', speed=90) + keys
    return Case(axes, world, text, wrong(world, 1, "STN1"))


def two_axes() -> Case:
    """Axis b tilts the table (about the world's -y), axis c turns the plate on it."""
    tilt, tilt_keys = placed((1150, 0, 500), (1, 0, 0), 90)
    plate = A.transform(A.rotation(np.array([1.0, 0, 0]), np.radians(-90)), np.array([0, 0.12, 0]))
    at_zero, plate_keys = placed((1150, 0, 620), (0, 0, 1), 0)
    assert np.abs(tilt @ plate - at_zero).max() < 1e-9
    chain = W.after(W.turn(1, (0, 0, 1.0), tilt), W.turn(2, (0, 0, 1.0), plate))
    world = W.World(units={"STN1": chain})
    steps = ((0.0, 0.0, "MoveJ"), (0.0, 0.0, "ArcLStart"), (15.0, 40.0, "ArcL"), (-10.0, 90.0, "ArcLEnd"))
    goals = [
        W.Goal((100 + 40 * k, -200 + 90 * k, 120 if k else 200), turned((0, 0, 1), 12 * k), {1: b, 2: c}, move)
        for k, (b, c, move) in enumerate(steps)
    ]
    text = W.program(ARM, world, goals, "STN1", "[[20,-30,40],[1,0,0,0]]")
    axes = axis("b", "rotary", "work", unit='"STN1"') + tilt_keys
    axes += axis("c", "rotary", "work", unit='"STN1"') + plate_keys
    return Case(axes, world, text, wrong(world, 2, "STN1"))


CASES = {
    "a track that stands at 1500 mm": lambda: track(1500.0, 1500.0, 1500.0),
    "a track that moves while it welds": lambda: track(1500.0, 2700.0, 2300.0),
    "a hanging gantry of two axes": gantry,
    "a positioner at 30 degrees": lambda: positioner(30.0, 30.0, 30.0),
    "a positioner that turns while it welds": lambda: positioner(20.0, -30.0, -55.0),
    "a positioner of two axes": two_axes,
}


def check(case: Case, output: str, world: W.World | None = None) -> W.Found:
    """How far the real arm is from the programmed path on the work, in the cell of the case or in another one."""
    return W.check(case.text, output, world or case.world, ARM, np.array(FORCE))


def holds(case: Case, output: str) -> bool:
    """Whether the path was wrong on the cell, is right on it, and would be wrong on every other one."""
    kept = check(case, output)
    others = [check(case, output, world) for world in case.wrong.values()]
    right = not kept.problems and kept.before > 0.1 and kept.after <= LIMIT
    return right and all(other.problems or other.after > 2 * LIMIT for other in others)


@pytest.mark.parametrize("name", CASES)
def test_the_path_on_the_work_is_kept(name: str) -> None:
    case = CASES[name]()
    assert holds(case, corrected(case))


@pytest.mark.parametrize("name", [*CASES][1::2])  # a track, a positioner, two axes
def test_the_function_for_run_time_corrects_targets_whatever_carries_arm_and_work(name: str) -> None:
    """The proof drives the arm with the targets that the module gives, external axes where the targets have them."""
    result = converted(CASES[name](), force=FORCE, run_time="all")
    assert result.outputs, [str(d) for d in result.diagnostics]
    assert {row["status"] for row in result.report["statements"]} == {"run_time"}
    assert result.report["run_time"]["known_targets"] == len(result.outcomes)
    assert result.report["run_time"]["max_known_error_mm"] < 0.003 and result.report["max_error_before_mm"] > 0.2


def test_the_function_for_run_time_refuses_an_arm_that_an_external_axis_tilts() -> None:
    """Gravity follows the axis, and the module knows one direction of it."""
    _, keys = placed((0, 0, 0), (1, 0, 0), 90)
    case = replace(track(0.0, 0.0, 0.0), axes=axis("a", "rotary", "robot", unit='"ORBIT"') + keys)
    result = converted(case, force=FORCE, run_time="all")
    assert result.outputs == {} and "RUN011" in [d.code for d in result.diagnostics]


def test_a_unit_that_is_not_active_stays_where_it_is() -> None:
    """The positioner stands at 30 degrees; while it is off, targets leave its axis open or say anything."""
    case = positioner(30.0, 30.0, 30.0)
    first, rest = re.split(r"(?<=fine,tTorch\\WObj:=wWork;\n)", case.text, maxsplit=1)
    idle = [
        line.replace("[9E9,30,9E9", "[9E9,9E9,9E9" if i % 2 else "[9E9,77,9E9")
        for i, line in enumerate(rest.splitlines(keepends=True))
    ]
    off = replace(case, text=f"{first}    DeactUnit STN1;\n{''.join(idle)}")

    def places(of: Case) -> list[str]:
        return [line.partition("],[")[0] for line in corrected(of).split("\n") if line not in of.text]

    assert len(places(off)) > 3 and places(off) == places(case)


MOC = """ROBOT:

      -name "ROB_1" -use_robot_type "ROB1_4600_2.05_60"

      -name "ROB_2" -use_robot_type "ROB2_4600_2.05_60" -base_frame_pos_x 2.6 -base_frame_pos_y 0.1\\
      -base_frame_orient_u0 0 -base_frame_orient_u3 1
#
"""
SYS = """CAB_TASKS:

      -Name "T_ROB1" -Type "NORMAL" -UseMechanicalUnitGroup "rob1" -MotionTask

      -Name "T_ROB2" -Type "NORMAL" -UseMechanicalUnitGroup "rob2" -MotionTask
#
MECHANICAL_UNIT_GROUP:

      -Name "rob1" -Robot "ROB_1"

      -Name "rob2" -Robot "ROB_2"
#
"""


@pytest.mark.parametrize(("task", "side"), [("T_ROB1", 1.0), ("T_ROB2", -1.0)])
def test_two_robots_on_one_work(task: str, side: float) -> None:
    """Each arm has its own base; both weld on one work object that stands between them."""
    far = A.transform(A.rotation(np.array([0, 0, 1.0]), np.pi), np.array([2.6, 0.1, 0.0]))
    worlds = {1.0: W.World(), -1.0: W.World(base=lambda axes: W.still(axes) @ far)}
    toward = DOWN if side > 0 else turned((0, 0, 1), 180)
    goals = [
        W.Goal((-80 * side, -300, 200), toward, {}, "MoveJ"),
        W.Goal((-80 * side, -300, 100), toward, {}, "ArcLStart"),
        W.Goal((-60 * side, 300, 120), toward, {}, "ArcLEnd"),
    ]
    text = W.program(ARM, worlds[side], goals, uframe="[[1250,0,500],[1,0,0,0]]")
    station = station_of(read_cell(Backup(system=read_entries(SYS), motion=read_entries(MOC))), task)
    assert station is not None
    options = Options(tolerance_m=1e-5, force=FORCE, inertia=False)
    result = correct_program(Source("p.mod", text.encode()), model().at_station(station), options)
    assert result.output is not None, [d.message for d in result.diagnostics]
    assert holds(Case("", worlds[side], text, {"other": worlds[-side]}), result.output.decode())


def named(text: str) -> str:
    """The program with its targets declared by name, and zones in the place of stops on the seam."""
    targets = re.findall(r"(\[\[[^\]]*\],\[[^\]]*\],\[[^\]]*\],\[[^\]]*\]\]),(?=v\d)", text)
    for k, target in enumerate(targets, 1):
        text = text.replace(f"{target},v", f"p{10 * k},v", 1)
        text = text.replace("  PROC main", f"  CONST robtarget p{10 * k}:={target};\n  PROC main")
    return re.sub(r"(ArcL p.*wd),fine", r"\1,z1", text)


@pytest.mark.parametrize("name", ["a track that moves while it welds", "a positioner that turns while it welds"])
def test_named_targets_and_zones_on_moving_work(name: str) -> None:
    case = CASES[name]()
    case = replace(case, text=named(case.text), wrong={})
    output = corrected(case)
    assert holds(case, output) and check(case, output).added > 0 and not check_text(case.text, output)


def test_synchronised_motion_keeps_its_statements() -> None:
    """Each \\ID has a partner in another task: targets are corrected, nothing is added, and what remains is said."""
    case = track(1500.0, 2700.0, 2300.0)
    text, count = re.subn(r"\]\],v20", r"]]\\ID:=10,v20", case.text)
    assert count == 3
    result = converted(replace(case, text=text), force=FORCE)
    assert result.output is not None and result.report["added_targets"] == 0
    assert result.output.decode().count("\\ID:=10") == 3
    assert "CMP006" in [d.code for d in result.diagnostics]
    assert any("`\\ID` would act on each of its parts" in f"{d.message} {d.help}" for d in result.diagnostics)


@pytest.mark.parametrize(
    "case", [track(1500.0, 2700.0, 2300.0), positioner(20.0, -30.0, -55.0)], ids=["track", "positioner"]
)
def test_a_taught_work_object_moves_with_what_carries_it(case: Case) -> None:
    """Where the axes turn the work in gravity the error is no rigid motion of it: what differs is corrected."""
    done = converted(case, wobj_taught=("all",))
    report = done.report
    assert done.exit_code == 0
    assert report["max_arc_error_after_mm"] < 0.01 < report["max_arc_error_before_mm"]
    full = converted(case).report
    assert report["from_programmed_path"]["before_mm"] == pytest.approx(full["figures"][0]["before_mm"], abs=1e-5)
