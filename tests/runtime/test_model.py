"""What of a model travels with the program, and what is said about the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.effects.base import Effect, param
from postproc.effects.library.frames.instrument_frame import InstrumentFrame
from postproc.effects.library.frames.tool_frame import ToolFrame
from postproc.effects.library.joints.backlash import Backlash
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.effects.library.joints.nonlinear_compliance import NonlinearCompliance
from postproc.effects.library.joints.thermal_joint_drift import ThermalJointDrift
from postproc.effects.library.joints.transmission_error import TransmissionError
from postproc.effects.library.joints.wrist_coupling import WristCoupling
from postproc.effects.library.loads.arm_load import ArmLoad
from postproc.effects.library.loads.dress_pack import DressPack
from postproc.effects.library.loads.gravity_compensator import GravityCompensator
from postproc.effects.library.loads.payload_error import PayloadError
from postproc.effects.library.structure.base_compliance import BaseCompliance
from postproc.effects.library.structure.bearing_tilt import BearingTilt
from postproc.effects.library.structure.link_compliance import LinkCompliance
from postproc.effects.library.structure.link_geometry import LinkGeometry
from postproc.runtime.conditions import Conditions
from postproc.runtime.written import RunTimeModule, write_module
from tests.runtime.arms import CENTER, FORCE, TOOL, springs

HOSE = DressPack(body_from=3, stiffness_N_per_m=300.0, from_m=[0.1, 0.2, 0.1], to_m=[0.1, 0.0, 0.05])
HELD: tuple[tuple[Effect, ...], ...] = (
    (
        GravityCompensator(sine_Nm=[-2000.0], cosine_Nm=[100.0]),
        ArmLoad(body=(3,), mass_kg=[20.0], moment_kgm=[[1.0, 2, 3]]),
        PayloadError(mass_kg=3.0, moment_kgm=[0.1, 0.2, 0.3], fraction=0.1, centre_m=[0.01, 0.02, 0.03]),
        HOSE,
    ),
    (
        NonlinearCompliance(windup_rad=[1e-4] * 6, knee_Nm=[200.0, 800, 600, 50, 50, 20]),
        TransmissionError(sine_rad=[1e-4] * 6, cosine_rad=[2e-4] * 6, order=(1, 1, 4, 12, 1, 7.5)),
        JointOffset(offset_rad=[1e-4] * 6),
        WristCoupling(k54=1e-4, k64=1e-4, k65=2e-4),
        LinkGeometry(shift_m=np.full((7, 3), 1e-4), turn_rad=np.full((7, 3), 1e-4)),
    ),
    (
        BaseCompliance(tilt_rad_per_Nm=[5e-8, 8e-8]),
        BearingTilt(tilt_rad_per_Nm=[2e-8, 5e-8, 5e-8, 1e-7, 1e-7, 0.0]),
        LinkCompliance(body=(2, 4), bending_per_Nm2=[5e-7] * 2, torsion_per_Nm2=[1e-6] * 2, stretch_per_N=[0.0] * 2),
        replace(HOSE, slack_m=0.9),
    ),
)
"""Loads, laws of angles and of the load of one joint, and bodies that give way."""


class Product(Effect, reads=("q",)):
    """Joint 1 gives way by what joints 2 and 3 do together. Source: made up."""

    size_rad: float = param(unit="rad", low=-0.01, high=0.01, typical=1e-4)

    def displacement(self, state: State) -> np.ndarray:
        dq = np.zeros((len(state), 6))
        dq[:, 0] = self.size_rad * np.sin(state.q[:, 1]) * np.sin(state.q[:, 2])
        return dq


def written(*effects: Effect, **changes: object) -> RunTimeModule:
    model = springs().model
    robot = model.robot
    given = Conditions(robot.lower, robot.upper, TOOL, 30.0, CENTER, FORCE, bound_m=0.02)
    return write_module(model.with_effects(*model.effects, *effects), replace(given, **changes))  # type: ignore[arg-type]


@pytest.mark.parametrize("effects", HELD, ids=lambda effects: effects[0].key)
def test_the_tables_hold_the_effects_for_every_load(effects: tuple[Effect, ...]) -> None:
    result = written(*effects)
    assert result.corrected.keys == ("joint_compliance", *(effect.key for effect in effects))
    assert [check.raised for check in result.checks] == [0, 0, 0]
    assert max(check.largest_m for check in result.checks) < 2e-5
    assert f"largest error {1e3 * result.checks[0].largest_m:.4f} mm" in result.text.decode()


class OwnStep(Product, key="own_step"):
    """Joint 1 follows joint 2. Source: made up."""

    def displacement(self, state: State) -> np.ndarray:
        dq = np.zeros((len(state), 6))
        dq[:, 0] = self.size_rad * np.tanh(3.0 * state.q[:, 1])
        return dq


def test_what_no_table_holds_or_no_target_tells_is_left_out_and_said() -> None:
    """A law of single angles is asked, one of two joints is not held; the instrument is no part of the arm."""
    frames = InstrumentFrame(shift_m=[0.001, 0, 0]), ToolFrame(shift_m=[0.001, 0, 0])
    drift = ThermalJointDrift(drift_rad_per_K=[1e-5] * 6)
    every = OwnStep(size_rad=1e-3), Product(size_rad=1e-4), Backlash(half_gap_rad=[1e-4] * 6), drift, *frames
    result = written(*every)
    assert result.corrected.keys == ("joint_compliance", "own_step")
    assert max(check.largest_m for check in result.checks) < 2e-5
    assert result.corrected.unfit == ("product",)
    assert result.corrected.untold == ("backlash", "thermal_joint_drift", "tool_frame")
    assert {(d.code, d.severity, d.message) for d in result.diagnostics} == {
        ("RUN004", "warning", "`backlash`, `thermal_joint_drift`, `tool_frame` is left out: a target does not tell what it follows"),
        ("RUN012", "warning", "`product` is left out: the tables of the function do not hold its law"),
    }  # fmt: skip
    assert "left out, the tables below do not hold their law: product" in result.text.decode()
    stated = written(drift, channels={"temperature": 30.0})
    assert stated.corrected.untold == ()
    assert "constant: temperature = 30" in stated.text.decode()


def test_a_hanging_arm_knows_where_gravity_pulls() -> None:
    model = springs().model
    hanging = replace(model, R_world_base=np.diag([1.0, -1.0, -1.0]))
    robot = model.robot
    result = write_module(hanging, Conditions(robot.lower, robot.upper, TOOL, 30.0, CENTER))
    assert "gravity in axes of the base [m/s2]: [0,0,9.81]" in result.text.decode()
    assert result.checks[0].largest_m < 5e-6
