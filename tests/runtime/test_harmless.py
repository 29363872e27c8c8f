"""What is not safe to correct comes back as it came, is counted, and no error leaves the function."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from postproc.diagnostics import PostprocError
from postproc.runtime.module import runtime_module
from postproc.runtime.written import RunTimeModule
from tests.independent import arm as A
from tests.runtime.arms import CENTER, FORCE, TOOL, load, pose, springs
from tests.runtime.controller import Controller
from tests.worlds.arm_functions import ERR_OUTSIDE_REACH, ERR_ROBLIMIT

Q = np.radians([20.0, 30, -20, 40, 60, 10])


@pytest.fixture(scope="module")
def module() -> RunTimeModule:
    real = springs()
    lower, upper = real.model.robot.lower.copy(), real.model.robot.upper.copy()
    lower[0] = np.radians(-90.0)
    return real.written(force=FORCE, force_on="arc", lower=lower, upper=upper)


@pytest.fixture
def task(module: RunTimeModule) -> Controller:
    return springs().controller(module.text)


def returned(task: Controller, target: list[Any], routine: str = "object") -> float:
    """Why a target came back as it came, after everything that must then be so."""
    before = task.get("ppCorrectedCount"), task.get("ppReturnedCount")
    answer = task.ask(target, routine)
    given = task.get("pIn")
    assert str(answer) == str(given)  # NaN is not equal to itself
    assert (task.get("ppCorrectedCount"), task.get("ppReturnedCount")) == (before[0], before[1] + 1)
    return float(task.get("ppReason"))


def test_out_of_reach(task: Controller) -> None:
    target = task.target(Q, TOOL)
    target[0] = [4000.0, 0.0, 1000.0]
    assert returned(task, target) == 1
    assert task.kinematics.raised == [ERR_OUTSIDE_REACH]


def test_a_configuration_that_does_not_exist(task: Controller) -> None:
    target = task.target(Q, TOOL)
    target[2] = [0.0, 3.0, -3.0, 6.0]
    assert returned(task, target) == 1
    assert task.kinematics.raised == [ERR_ROBLIMIT]


@pytest.mark.parametrize("part", [0, 1])
def test_what_is_no_number(task: Controller, part: int) -> None:
    target = task.target(Q, TOOL)
    target[part] = [float("nan"), *target[part][1:]]
    assert returned(task, target) == 1


@pytest.mark.parametrize("part", [[[9e9, 0.0, 0.0]], [[0.0, 0.0, 0.0], [0.0] * 4]])
def test_a_target_that_was_never_taught(task: Controller, part: list[Any]) -> None:
    target = task.target(Q, TOOL)
    target[: len(part)] = part
    assert returned(task, target) == 1


def test_external_axes_that_are_not_there_do_no_harm(task: Controller) -> None:
    plain = task.ask(task.target(Q, TOOL))
    assert plain[3] == task.get("pIn")[3]
    assert task.get("ppCorrectedCount") == 1


def test_a_straight_wrist(task: Controller) -> None:
    assert returned(task, task.target(np.radians([20.0, 30, -20, 40, 0.5, 10]), TOOL)) == 4


def test_outside_the_region(task: Controller) -> None:
    q = Q.copy()
    q[0] = np.radians(-100.0)
    assert returned(task, task.target(q, TOOL)) == 3


def test_a_correction_that_is_too_large(task: Controller) -> None:
    task.set("ppMaxCorrection", 0.05)
    assert returned(task, task.target(Q, TOOL)) == 5


@pytest.mark.parametrize(
    ("mass", "routine"), [(-1.0, "object"), (1e6, "object"), (-1.0, "loaded"), (float("nan"), "object")]
)
def test_a_load_that_cannot_be(task: Controller, mass: float, routine: str) -> None:
    task.set("lUsed" if routine == "loaded" else "tUsed", load(mass, CENTER) if routine == "loaded" else [True, pose(np.eye(4)), load(mass, CENTER)])  # fmt: skip
    assert returned(task, task.target(Q, TOOL), routine) == 2


def test_a_tool_that_the_robot_does_not_hold(task: Controller) -> None:
    task.set("tUsed", [False, *task.get("tUsed")[1:]])
    assert returned(task, task.target(Q, TOOL)) == 2


@pytest.mark.parametrize(
    ("change", "reason"),
    [((0, [4000.0, 0.0, 1000.0]), 1), ((0, [float("nan"), 0.0, 0.0]), 1), ((1, [0.0] * 4), 1), (None, 4)],
    ids=["out of reach", "no number", "never taught", "straight wrist"],
)
def test_a_circle_point_comes_back_as_it_came(task: Controller, change: tuple[int, Any] | None, reason: float) -> None:
    task.set("pTo", task.target(Q, TOOL))
    point = task.target(np.radians([20.0, 30, -20, 40, 0.5, 10]) if change is None else Q, TOOL)
    if change is not None:
        point[change[0]] = change[1]
    assert returned(task, point, "circle") == reason
    assert task.ask(task.target(Q, TOOL), "circle")[0] != task.target(Q, TOOL)[0]
    assert task.get("ppCorrectedCount") == 1


def test_one_bool_switches_it_off(task: Controller) -> None:
    task.set("ppOn", False)
    target = task.target(Q, TOOL)
    assert task.ask(target)[:3] == target[:3]
    assert (task.get("ppCorrectedCount"), task.get("ppReturnedCount")) == (0, 0)


def test_the_log_says_what_came_back(task: Controller) -> None:
    assert task.get("ppLog")
    returned(task, task.target(np.radians([20.0, 30, -20, 40, 0.5, 10]), TOOL))
    assert [e.name for e in task.task.events] == ["errwrite"]
    returned_once = len(task.task.events)
    task.ask(task.target(Q, TOOL))
    assert len(task.task.events) == returned_once


@pytest.mark.parametrize("seed", range(3))
def test_whatever_comes_no_error_leaves_and_nothing_moves_far(task: Controller, seed: int) -> None:
    g = np.random.default_rng(seed)
    for _ in range(40):
        target = task.target(g.uniform(-3.5, 3.5, 6), TOOL)
        part = int(g.integers(0, 4))
        if g.random() < 0.7:
            size = float(g.choice([1.0, 100.0, 1e9, np.nan, np.inf]))
            target[part] = [float(x + size * g.normal()) for x in target[part]]
        answer = task.ask(target)
        changed = str(answer) != str(task.get("pIn"))
        assert not changed or np.linalg.norm(np.array(answer[0]) - np.array(target[0])) <= 5.01
        assert changed == (task.get("ppReason") == 0)


def test_the_name_of_a_module_is_one_of_rapid() -> None:
    for name in ("", "9lives", "a" * 33, "pp Model"):
        with pytest.raises(PostprocError, match="RUN001"):
            runtime_module({}, name=name)


def test_a_tool_without_tcp_is_corrected_too(task: Controller) -> None:
    task.set("tUsed", [True, pose(np.eye(4)), load(0.001, [0, 0, 0])])
    target = task.target(Q, np.eye(4))
    answer = task.ask(target)
    commanded = task.kinematics.solved(_metres(answer), answer[2])
    real = A.equilibrium(A.irb4600(), commanded, np.eye(4), A.Load(0.001), A.joint_springs(A.TABLE_2)).frames.tcp[0]
    assert np.linalg.norm(1e3 * real[:3, 3] - np.array(target[0])) < 0.005


def _metres(target: list[Any]) -> np.ndarray:
    from tests.worlds.values import pose_matrix

    mm = pose_matrix(target)
    mm[:3, 3] *= 1e-3
    return mm
