"""The written module, run by an interpreter and an arm that share nothing with the package: where the real TCP goes."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from postproc.runtime.written import RunTimeModule
from tests.independent import arm as A
from tests.runtime.arms import CENTER, FORCE, TOOL, Real, load, mapped, on_the_arc, soft_bodies, springs
from tests.runtime.controller import Controller, metres
from tests.worlds.parser import parse
from tests.worlds.values import matrix_pose, pose_matrix

FRAME = A.transform(A.rotation_vector(np.array([[0.1, -0.2, 1.1]]))[0], np.array([0.4, -0.3, 0.2]))
LOW, HIGH = np.radians([-170, -60, -120, -300, -110, -300]), np.radians([170, 100, 60, 300, 110, 300])
RESERVED = frozenset(re.findall(r"\w+", """
    alias and backward case connect const default div do else elseif endfor endfunc endif endmodule endproc endrecord
    endtest endtrap endwhile error exit false for from func goto if inout local mod module nostepin not noview or pers
    proc raise readonly record retry return step sysmodule task test then to trap true trynext undo var viewonly while
    with xor
"""))  # fmt: skip


def misses(real: Real, text: bytes, count: int, routine: str, given: A.Load, seed: int = 11) -> tuple[np.ndarray, int]:
    """(n,) distances [mm] from targets to the real TCP, and how many targets came back as they were."""
    task, g = real.controller(text), np.random.default_rng(seed)
    mm = FRAME.copy()
    mm[:3, 3] *= 1e3
    frame = [pose_matrix([[0, 0, 0], [1, 0, 0, 0]]), mm]
    task.set("wUsed", [False, True, "", *(list(matrix_pose(f)) for f in frame)])
    limits = np.maximum(LOW, real.arm.lower), np.minimum(HIGH, real.arm.upper)
    distances, returned = [], 0
    for _ in range(count):
        q = g.uniform(*limits)
        q[4] += np.copysign(0.05, q[4])
        target, task.kinematics.near = task.target(q, TOOL, FRAME), q
        answer = task.ask(target, routine)
        if answer[:3] == target[:3]:
            returned += 1
            continue
        commanded = task.kinematics.solved(FRAME @ metres(answer) @ np.linalg.inv(TOOL), answer[2])
        off = real.place(commanded, given)[:3, 3] - (FRAME @ metres(target))[:3, 3]
        distances.append(1e3 * np.linalg.norm(off))
    assert int(task.get("ppReturnedCount")) == returned
    assert int(task.get("ppCorrectedCount")) == count - returned
    return np.array(distances), returned


@dataclass(frozen=True)
class Made:
    """An arm with the module that is written of it; joint angles [rad] in its room, and how far its TCP may miss [mm]."""

    real: Real
    module: RunTimeModule
    middle: np.ndarray
    most: float


MIDDLE = np.radians([20.0, 30, -20, 40, 60, 10])
ARMS: dict[Callable[[], Real], tuple[Callable[[], RunTimeModule], np.ndarray, float]] = {
    springs: (on_the_arc, MIDDLE, 0.005),
    soft_bodies: (lambda: soft_bodies().written(force=FORCE, bound_m=0.02), MIDDLE, 0.02),
    mapped: (lambda: mapped().written(), np.array([0.3, -1.2, 1.0, 0.2, 1.0, 0.1]), 0.01),
}
"""How the module of each arm is written, and the rest of what is made of it."""


@pytest.fixture(scope="module", params=ARMS, ids=lambda f: f.__name__)
def made(request: pytest.FixtureRequest) -> Made:
    write, middle, most = ARMS[request.param]
    return Made(request.param(), write(), middle, most)


def test_the_cost_is_what_the_interpreter_counts(made: Made) -> None:
    """Statements of one call, counted by the interpreter while it runs."""
    task = made.real.controller(made.module.text)
    task.kinematics.near = made.middle
    task.ask(task.target(made.middle, TOOL), "weld")
    assert task.get("ppReason") == 0
    stated = max(check.steps for check in made.module.checks)
    assert abs(task.task.steps - stated) <= 0.03 * task.task.steps
    assert f"one target takes {stated} statements, about" in made.module.text.decode()


def test_names_and_statements_are_what_a_controller_takes(made: Made) -> None:
    text = made.module.text.decode()
    (module,) = parse(text)
    names = [d.name for d in module.data] + [r.name for r in module.routines]
    assert all(name.startswith("pp") for name in names)
    for scope in (names, *([p.name for p in r.parameters] + [d.name for d in r.data] for r in module.routines)):
        assert len(scope) == len(set(scope))
        assert all(len(name) <= 32 and name not in RESERVED for name in scope)
    assert {r.name for r in module.routines if not r.local} == {"ppcorrected", "ppcorrectedcirc"}
    called = {s.parts["name"] for r in module.routines for s in r.flat if s.kind == "call"}
    assert called <= {"ppreturned", "errwrite"}
    code = "\n".join(line.split("!")[0] for line in text.splitlines())
    assert not re.search(r"\b(Move|Arc|Set|Reset|WaitDI|GOTO|WHILE)", code)
    assert max(map(len, text.splitlines())) < 200


def test_the_real_tcp_comes_to_the_target(made: Made) -> None:
    """Anywhere in the room of the arm, with the force of the arc where it has one; few targets come back as they were."""
    force = np.zeros(3) if made.real.mass < 30 else FORCE
    given = A.Load(made.real.mass, CENTER, force)
    distances, returned = misses(made.real, made.module.text, 40, "weld" if force.any() else "object", given)
    assert returned <= 8
    assert distances.max() <= made.most


def test_the_force_of_the_arc_counts_where_the_call_says_so() -> None:
    distances, returned = misses(springs(), on_the_arc().text, 40, "object", A.Load(30.0, CENTER))
    assert returned <= 4
    assert distances.max() <= 0.005


@pytest.fixture
def task() -> Controller:
    return springs().controller(on_the_arc().text)


def off(task: Controller, q: np.ndarray, routine: str, given: A.Load) -> float:
    """How far [m] the real TCP is off a target with a load."""
    target = task.target(q, TOOL)
    commanded = task.kinematics.solved(metres(task.ask(target, routine)) @ np.linalg.inv(TOOL), target[2])
    return float(np.linalg.norm(springs().place(commanded, given)[:3, 3] - 1e-3 * np.array(target[0])))


def test_another_tool_load_is_read_from_the_call(task: Controller) -> None:
    heavy = A.Load(55.0, np.array([-0.05, 0.1, 0.2]))
    task.set("lUsed", load(heavy.mass, heavy.center))
    assert off(task, MIDDLE, "loaded", heavy) < 5e-6
    assert off(task, MIDDLE, "loaded", A.Load(30.0, CENTER)) > 1e-4


def test_load0_in_the_call_is_the_load_of_the_tool(task: Controller) -> None:
    """As the manual has it, and as the correction by numbers takes it: what is gripped counts, too."""
    task.set("lUsed", load(0.001, np.array([0.0, 0.0, 0.001])))
    task.set("ppPayload", load(12.0, np.zeros(3)))
    target = task.target(MIDDLE, TOOL)
    assert task.ask(target, "loaded") == task.ask(target) != target


def test_a_gripped_part_weighs_where_the_tool_holds_it(task: Controller) -> None:
    center = np.array([0.01, 0.03, 0.05])
    task.set("ppPayload", load(12.0, center))
    both = (30.0 * CENTER + 12.0 * (TOOL[:3, :3] @ center + TOOL[:3, 3])) / 42.0
    assert off(task, np.radians([-60.0, 10, 10, -70, 70, 100]), "object", A.Load(42.0, both)) < 5e-6


def test_the_circle_point_takes_external_axes_from_the_end(task: Controller) -> None:
    task.set("pTo", task.target(MIDDLE, TOOL))
    middle = task.target(MIDDLE + np.radians(2.0), TOOL)
    scrawled: list[Any] = [*middle[:2], [0.0, 3.0, -2.0, 5.0], [1.0, 2, 3, 4, 5, 6]]
    assert task.ask(scrawled, "circle") == [*task.ask(middle)[:2], *scrawled[2:]]
