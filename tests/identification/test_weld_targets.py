"""Poses and set-ups that are planned for a program: what is left where it welds, by the independent arm and numpy."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np

import postproc
from postproc.estimation.recorded import recorded_model
from postproc.identification.planning.plan import MeasuringPlan, plan_poses
from postproc.identification.planning.setups import Request, plan_setups
from postproc.identification.planning.weld_targets import WeldTargets
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.file import default_model
from postproc.model.uncertainty.scatter import stiffness_factors
from postproc.results.improve.plan import program_sentences
from postproc.robot.catalogue import load_robot
from tests.conftest import ROOT
from tests.identification.cells import base_fit, cell
from tests.identification.test_first_plan import ARM, TOOL, changes, rows
from tests.independent.arm import ARMS, Load, equilibrium, joint_springs

GAUGE_SIGMA, TRACKER_SIGMA = np.sqrt(2) * 1e-5, 3e-5  # of a difference of two readings, of a coordinate [m]


def seam(model: Model) -> WeldTargets:
    """Where the sample of the paper welds."""
    targets = WeldTargets.of("paper_case.mod", postproc.compensate(ROOT / "samples" / "paper_case.mod", model))
    assert targets is not None
    return targets


def places(q: np.ndarray, tool: np.ndarray, mass: np.ndarray, center: np.ndarray, compliance: np.ndarray) -> np.ndarray:
    """TCP (n, 3) [m] of the independent arm under loads on the flange."""
    load = Load(mass=mass, center=center)
    return equilibrium(ARMS[ARM](), q, tool, load, joint_springs(compliance)).frames.tcp[:, :3, 3]


def at(state, tool=None, q=0.0, compliance=np.zeros(6)) -> np.ndarray:
    tool = np.broadcast_to(state.T_flange_tcp, (len(state), 4, 4))[0] if tool is None else tool
    return places(state.q + q, tool, state.payload_mass, state.payload_center, compliance)


@cache
def from_a_short_table() -> tuple[Measurements, MeasuringPlan]:
    """Twelve measured poses, and four more for the seam."""
    data, _ = cell(seed=41, poses=12)
    return data, plan_poses(base_fit(data).model, data, 4, programs=lambda fitted: [seam(fitted)])


def test_readings_for_a_program_leave_less_where_it_welds_than_as_many_for_everything():
    """Springs scatter as those of the type do; no weight and no pull on the seam loads joint 1."""
    usual, spread = load_robot(ARM).joint_compliance, np.log(stiffness_factors(load_robot(ARM))) / 1.96
    arm, ask = replace(default_model(ARM), T_flange_tcp=TOOL), Request("gauge", load=20.0, pull=100.0)
    general, meant = plan_setups(arm, ask, 2), plan_setups(arm, ask, 2, lambda model: [seam(model)])
    targets, each = meant.programs[0][0].state, [usual * (np.arange(6) == j) for j in range(6)]
    bent = np.array([at(targets, compliance=c) - at(targets) for c in each])  # (6, m, 3)
    shown = [np.column_stack([changes(rows(plan), c)[::2] for c in each]) for plan in (general, meant)]
    g, left = np.random.default_rng(5), []
    for _ in range(12):
        real, noise = np.exp(spread * g.normal(size=6)), GAUGE_SIGMA * g.normal(size=2)
        of_arm = [np.ones(6)]
        for H in shown:
            x = np.zeros(6)  # logarithms: Gauss and Newton on readings and prior
            for _ in range(10):
                A, r = H * np.exp(x) / GAUGE_SIGMA, (H @ (real - np.exp(x)) + noise) / GAUGE_SIGMA
                x = x + np.linalg.solve(A.T @ A + np.diag(spread**-2), A.T @ r - x / spread**2)
            of_arm.append(np.exp(x))
        left.append([np.linalg.norm(np.tensordot(real - f, bent, 1), axis=1).max() for f in of_arm])
    nothing, of_general, of_meant = np.sqrt(np.mean(np.square(left), axis=0))
    assert of_meant < 0.5 * of_general < 0.5 * nothing


def test_poses_for_a_program_leave_less_where_it_welds_than_as_many_for_all_parameters():
    """Offsets, springs, tool and the place of the instrument are unknown; a short table, and four poses more."""
    data, meant = from_a_short_table()
    general = plan_poses(base_fit(data).model, data, 4)
    usual, step = load_robot(ARM).joint_compliance, 1e-5

    def columns(state, tool=None) -> np.ndarray:
        """Change of the TCP (n, 3, 16) [m] by what may be off: offsets of joints 2 to 5, springs, tool, instrument."""
        stiff, joints = at(state, tool), step * np.eye(6)[1:5]
        tools = [] if tool is None else [tool @ moved for moved in map(shifted, np.eye(3))]
        turned = [(at(state, tool, dq) - stiff) / step * 1e-3 for dq in joints]
        sprung = [0.5 * (at(state, tool, compliance=usual * (np.arange(6) == j)) - stiff) for j in range(6)]
        calibrated = [(at(state, T) - stiff) / step * 1e-3 for T in tools] or [0.0 * stiff] * 3
        seen = [np.tile(e, (len(stiff), 1)) for e in np.eye(3)] + [np.cross(e, stiff) for e in np.eye(3)]
        instrument = [x * (tool is not None) for x in seen]
        return np.stack([*turned, *sprung, *calibrated, *instrument], axis=2)

    def shifted(axis: np.ndarray) -> np.ndarray:
        T = np.eye(4)
        T[:3, 3] = step * axis
        return T

    tool, D = (
        base_fit(data).model.T_flange_tcp @ shifted(np.array([0, 0, 0.35 / step])),
        columns(meant.programs[0][0].state),
    )
    A, errors = [columns(state, tool) for state in (data.state, general.state, meant.state)], []
    x = np.random.default_rng(0).normal(size=(200, D.shape[2]))  # arms, each number in standard deviations
    for planned in A[1:]:
        Z = np.concatenate([A[0], planned]).reshape(-1, D.shape[2]) / TRACKER_SIGMA
        noise = np.random.default_rng(1).normal(size=(200, len(Z)))
        found = np.linalg.solve(Z.T @ Z + np.eye(D.shape[2]), Z.T @ (x @ Z.T + noise).T).T
        errors.append(np.linalg.norm(np.einsum("mip,ap->ami", D, x - found), axis=2).max(axis=1))
    of_general, of_meant = (np.sqrt(np.mean(e**2)) for e in errors)
    assert of_meant < 0.9 * of_general


def test_what_is_expected_now_is_what_compensate_says_and_the_poses_lower_it():
    plan = from_a_short_table()[1]
    ((one, after),) = plan.programs
    converted = postproc.compensate(ROOT / "samples" / "paper_case.mod", recorded_model(plan.fit))
    assert one.expected_mm == converted.report["expected_on_arm_mm"]
    assert 0 < after[0] <= one.expected_mm[0] and after[1] < one.expected_mm[1]


def test_measurements_that_hardly_lower_what_is_expected_are_said_to():
    seam: Any = SimpleNamespace(program="a.mod", expected_mm=[0.06, 0.43])
    much, little = (program_sentences([(seam, [0.05, after])], "these 8 poses") for after in (0.12, 0.42))
    assert (
        much == "Where `a.mod` welds, 0.06 to 0.43 mm are expected on the arm now, 0.05 to 0.12 mm with these 8 poses."
    )
    assert little.startswith(much[:60]) and "hardly less" in little and "`postproc diagnose`" in little
