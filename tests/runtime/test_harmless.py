"""What is not safe to correct comes back as it came, is counted, and no error leaves the function."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from postproc.runtime.module import runtime_module
from tests.build import refused
from tests.independent import arm as A
from tests.runtime.arms import CENTER, FORCE, TOOL, load, pose, springs
from tests.runtime.controller import Controller, metres
from tests.worlds.arm_functions import ERR_OUTSIDE_REACH, ERR_ROBLIMIT

Q = np.radians([20.0, 30, -20, 40, 60, 10])
STRAIGHT = np.radians([20.0, 30, -20, 40, 0.5, 10])
BEYOND = np.radians([-100.0, 30, -20, 40, 60, 10])


@pytest.fixture(scope="module")
def text() -> bytes:
    real = springs()
    lower = real.model.robot.lower.copy()
    lower[0] = np.radians(-90.0)
    return real.written(force=FORCE, force_on="arc", lower=lower).text


@pytest.fixture
def task(text: bytes) -> Controller:
    return springs().controller(text)


def returned(task: Controller, target: list[Any], routine: str = "object") -> float:
    """Why a target came back as it came, after everything that must then be so."""
    before = task.get("ppCorrectedCount"), task.get("ppReturnedCount")
    answer = task.ask(target, routine)
    assert str(answer) == str(task.get("pIn"))  # NaN is not equal to itself
    assert (task.get("ppCorrectedCount"), task.get("ppReturnedCount")) == (before[0], before[1] + 1)
    return float(task.get("ppReason"))


NAN = float("nan")
TARGETS: dict[str, tuple[np.ndarray, dict[int, list[float]], float, list[int]]] = {
    "out of reach": (Q, {0: [4000.0, 0.0, 1000.0]}, 1, [ERR_OUTSIDE_REACH]),
    "a configuration that does not exist": (Q, {2: [0.0, 3.0, -3.0, 6.0]}, 1, [ERR_ROBLIMIT]),
    "a place that is no number": (Q, {0: [NAN, 0.0, 0.0]}, 1, []),
    "an orientation that is no number": (Q, {1: [NAN, 0.0, 0.0, 0.0]}, 1, []),
    "never taught": (Q, {0: [9e9, 0.0, 0.0]}, 1, []),
    "all zero": (Q, {0: [0.0, 0.0, 0.0], 1: [0.0] * 4}, 1, []),
    "an orientation of zeros": (Q, {1: [0.0] * 4}, 1, []),
    "outside the region": (BEYOND, {}, 3, []),
    "a straight wrist": (STRAIGHT, {}, 4, []),
}


@pytest.mark.parametrize(("q", "change", "reason", "raised"), TARGETS.values(), ids=TARGETS)
def test_a_target_that_is_not_safe_to_correct_comes_back(
    task: Controller, q: np.ndarray, change: dict[int, list[float]], reason: float, raised: list[int]
) -> None:
    """As the end of a move, and, but for its configuration and the region, as a circle point."""
    target = task.target(q, TOOL)
    for part, value in change.items():
        target[part] = value
    assert returned(task, target) == reason
    assert not raised or task.kinematics.raised == raised
    if 2 not in change and reason != 3:
        end = task.target(Q, TOOL)
        task.set("pTo", end)
        assert returned(task, target, "circle") == reason
        assert task.ask(end, "circle")[0] != end[0] and task.get("ppCorrectedCount") == 1


def tool(mass: float, held: bool = True) -> list[Any]:
    return [held, pose(np.eye(4)), load(mass, CENTER)]


DATA = {
    "a correction that is too large": ("ppMaxCorrection", 0.05, "object", 5),
    "a negative mass": ("tUsed", tool(-1.0), "object", 2),
    "too heavy": ("tUsed", tool(1e6), "object", 2),
    "a mass that is no number": ("tUsed", tool(NAN), "object", 2),
    "a negative load in the call": ("lUsed", load(-1.0, CENTER), "loaded", 2),
    "a tool that the robot does not hold": ("tUsed", tool(5.0, held=False), "object", 2),
}


@pytest.mark.parametrize(("name", "value", "routine", "reason"), DATA.values(), ids=DATA)
def test_data_with_which_nothing_is_corrected(
    task: Controller, name: str, value: Any, routine: str, reason: float
) -> None:
    task.set(name, value)
    assert returned(task, task.target(Q, TOOL), routine) == reason


def test_external_axes_that_are_not_there_do_no_harm(task: Controller) -> None:
    assert task.ask(task.target(Q, TOOL))[3] == task.get("pIn")[3]
    assert task.get("ppCorrectedCount") == 1


def test_one_bool_switches_it_off(task: Controller) -> None:
    task.set("ppOn", False)
    target = task.target(Q, TOOL)
    assert task.ask(target)[:3] == target[:3]
    assert (task.get("ppCorrectedCount"), task.get("ppReturnedCount")) == (0, 0)


def test_the_log_says_what_came_back(task: Controller) -> None:
    assert task.get("ppLog")
    returned(task, task.target(STRAIGHT, TOOL))
    task.ask(task.target(Q, TOOL))
    assert [e.name for e in task.task.events] == ["errwrite"]


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


def test_a_tool_without_tcp_is_corrected_too(task: Controller) -> None:
    task.set("tUsed", [True, pose(np.eye(4)), load(0.001, [0, 0, 0])])
    target = task.target(Q, np.eye(4))
    answer = task.ask(target)
    q = task.kinematics.solved(metres(answer), answer[2])
    real = A.equilibrium(A.irb4600(), q, np.eye(4), A.Load(0.001), A.joint_springs(A.TABLE_2)).frames.tcp[0]
    assert np.linalg.norm(1e3 * real[:3, 3] - np.array(target[0])) < 0.005


@pytest.mark.parametrize("name", ["", "9lives", "a" * 33, "pp Model"])
def test_the_name_of_a_module_is_one_of_rapid(name: str) -> None:
    (finding,) = refused(lambda: runtime_module({}, name=name))
    assert finding.code == "RUN001"
