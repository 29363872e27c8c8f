"""What to measure first, without a table: postures, directions and loads, and what an arm is known to afterwards."""

from __future__ import annotations

import csv
import io
import re

import numpy as np
import pytest

from postproc.identification.planning.design import choose
from postproc.identification.planning.setups import SHOP, Request, SetupPlan, plan_setups
from postproc.identification.planning.table import setups_csv
from postproc.model.arm import Model
from postproc.render.measuring import setups_module
from postproc.robot.catalogue import load_robot
from tests.build import refused
from tests.independent.arm import ARMS, Load, equilibrium, joint_springs, shift
from tests.independent.rapid import motions
from tests.rapid.build import program

ARM, TOOL = "irb4600_60_205", shift(z=0.3)


def planned(kind: str, count: int = 12, robot: str = ARM, **asked: float) -> SetupPlan:
    """A plan for an arm of the library with a tool of 0.3 m."""
    return plan_setups(Model(load_robot(robot), T_flange_tcp=TOOL, robot_name=robot), Request(kind, **asked), count)


def rows(plan: SetupPlan) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(setups_csv(plan))))


def places(q: np.ndarray, robot: str = ARM) -> np.ndarray:
    """TCP (n, 3) of the stiff arm, by the independent one."""
    return ARMS[robot]().forward(q, TOOL).tcp[:, :3, 3]


def changes(table: list[dict[str, str]], compliance: np.ndarray, robot: str = ARM) -> np.ndarray:
    """What gauges read from the row without to the row with the load (s,) [m], by the independent arm."""

    def columns(*names: str) -> np.ndarray:
        return np.array([[float(row.get(name) or 0) for name in names] for row in table])

    center, force = columns(*(f"payload_{a}_mm" for a in "xyz")) / 1e3, columns("fx_N", "fy_N", "fz_N")
    load = Load(mass=columns("payload_kg")[:, 0], center=center, force=force)
    q = np.radians(columns(*(f"q{j}_deg" for j in range(1, 7))))
    real = equilibrium(ARMS[robot](), q, TOOL, load, joint_springs(compliance)).frames.tcp[:, :3, 3]
    read = np.sum(real * columns("nx", "ny", "nz"), axis=1)
    return read[1::2] - read[::2]


@pytest.mark.parametrize("robot", [ARM, "ur10"])
@pytest.mark.parametrize("kind", SHOP)
def test_postures_leave_room_for_a_person_and_a_stand(kind: str, robot: str):
    plan, arm = planned(kind, robot=robot, load=5.0), load_robot(robot)
    q, p = plan.state.q, places(plan.state.q, robot)
    assert len(np.unique(q, axis=0)) == 12
    assert (q > arm.lower + np.radians(9.9)).all() and (q < arm.upper - np.radians(9.9)).all()
    assert (p[:, 2] > 0.199).all() and (p[:, 0] > 0.3 * np.linalg.norm(arm.link[2:, :3, 3], axis=1).sum()).all()
    assert (plan.state.T_flange_tcp == TOOL).all()


def test_what_is_touched_is_one_tip_three_faces_and_a_sphere_about_an_anchor():
    tip, plane, bar = (places(planned(kind, load=20.0).state.q) for kind in ("tip", "plane", "distance"))
    assert np.ptp(tip, axis=0).max() < 1e-5
    faces = np.array(planned("plane", load=20.0).names)
    for name, axis in (("top", 2), ("front", 0), ("side", 1)):
        on = plane[faces == name]
        assert len(on) == 4 and np.ptp(on[:, axis]) < 1e-5
    # |p|^2 = 2 c.p + r^2 - |c|^2
    x = np.linalg.lstsq(np.column_stack([2 * bar, np.ones(12)]), np.sum(bar**2, axis=1), rcond=None)[0]
    assert np.sqrt(x[3] + x[:3] @ x[:3]) == pytest.approx(0.3, abs=1e-4)


@pytest.mark.parametrize(("load", "pull"), [(30.0, 0.0), (30.0, 200.0)])
def test_a_gauge_reads_what_is_expected_and_a_pull_alone_loads_joint_1(load: float, pull: float):
    plan = planned("gauge", load=load, pull=pull)
    read = changes(rows(plan), load_robot(ARM).joint_compliance)
    assert (plan.change >= 5e-5).all() and (np.abs(plan.direction).sum(axis=1) == 1).all()
    np.testing.assert_allclose(np.repeat(plan.change, 2), read, rtol=0.03)  # each is read twice
    assert (0 in plan.unloaded) == (pull == 0) and (0 in plan.unknown) == (pull == 0)


def test_chosen_set_ups_tell_more_than_random_ones_and_their_covariance_is_that_of_all_of_them():
    g = np.random.default_rng(0)
    Z, P, posture = g.normal(size=(200, 2, 5)) * [1, 3, 0.1, 1, 1], np.diag([4.0, 1, 1, 1, 9]), np.arange(200) // 4
    groups = np.column_stack([posture, np.arange(200) % 3])
    W = np.diag([1.0, 0, 5, 1, 0.1])

    def known(some: list[int]) -> np.ndarray:
        return np.linalg.inv(np.linalg.inv(P) + sum(Z[i].T @ Z[i] for i in some))

    for weigh, score in ((W, lambda S: np.trace(W @ S)), (None, lambda S: np.linalg.slogdet(S)[1])):
        chosen, S = choose(Z, P, 6, weigh, groups)
        np.testing.assert_allclose(S, known(chosen), rtol=1e-9, atol=1e-12)
        assert len(set(posture[chosen])) == 6 and np.bincount(np.array(chosen) % 3).tolist() == [2, 2, 2]
        assert score(S) < min(score(known(list(g.choice(200, 6, replace=False)))) for _ in range(200))


def test_measurements_narrow_what_is_expected_to_remain():
    few, many, pulled = (
        planned("gauge", 3, load=30.0),
        planned("gauge", load=30.0),
        planned("gauge", load=30.0, pull=200),
    )
    assert (
        few.remaining["before"] == many.remaining["before"]
        and many.remaining["after"][1] < few.remaining["after"][1] < 0.5 * few.remaining["before"][1]
    )
    assert many.remaining["of_loads_after"][1] < 0.1 < 0.25 < many.remaining["of_loads_before"][1]
    assert pulled.remaining["of_loads_after"][1] < 0.1
    unsure = planned("gauge", robot="irb4600_40_255", load=30.0)
    assert (
        unsure.remaining["of_loads_after"][1] < 0.1 < 0.2 < unsure.remaining["after"][1] < unsure.remaining["before"][1]
    )  # nobody weighed its links


def test_where_no_gauge_can_be_read_that_is_said():
    (found,) = refused(lambda: planned("gauge", load=0.1))
    assert "0 set-ups can be measured here" in found.message and "load it more" in found.help


@pytest.mark.parametrize("kind", SHOP)
def test_the_program_stops_at_each_set_up_and_is_read_without_a_finding(kind: str):
    plan = planned(kind, load=30.0)
    text = setups_module(plan, "t.csv", "diPlate").decode()
    assert not program(text.encode()).diagnostics
    moves, lost = motions(text)
    assert not lost and len(moves) == 24
    visited = np.array([move.q for move in moves])[1 - (kind in ("tip", "plane")) :: 2]
    np.testing.assert_allclose(visited, plan.begin, atol=np.radians(1e-4))
    apart = np.linalg.norm(places(plan.begin) - places(plan.state.q), axis=1)
    np.testing.assert_allclose(apart, 0.05 if kind in ("tip", "plane") else 0.0, atol=1e-5)
    assert all(len(words) <= 80 for words in re.findall(r'"([^"]*)"', text))
    assert text.count("SearchL\\Stop,diPlate,") == (12 if kind == "plane" else 0)
    assert text.count("Stop\\NoRegain;") == (12 if kind == "tip" else 0)
