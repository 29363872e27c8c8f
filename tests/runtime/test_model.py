"""What of a model travels with the program, and what is said about the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.effects.base import Effect
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
from postproc.effects.library.structure.link_geometry import LinkGeometry
from postproc.runtime.conditions import Conditions
from postproc.runtime.written import RunTimeModule, write_module
from tests.runtime.arms import CENTER, FORCE, TOOL, springs

HOSE = DressPack(body_from=3, stiffness_N_per_m=300.0, from_m=[0.1, 0.2, 0.1], to_m=[0.1, 0.0, 0.05])
CLOSED: tuple[Effect, ...] = (
    GravityCompensator(sine_Nm=[-2000.0], cosine_Nm=[100.0]),
    NonlinearCompliance(windup_rad=[1e-4] * 6, knee_Nm=[200.0, 800, 600, 50, 50, 20]),
    TransmissionError(sine_rad=[1e-4] * 6, cosine_rad=[2e-4] * 6, order=(1, 1, 4, 12, 1, 7.5)),
    ArmLoad(body=(3,), mass_kg=[20.0], moment_kgm=[[1.0, 2, 3]]),
    PayloadError(mass_kg=3.0, moment_kgm=[0.1, 0.2, 0.3]),
    JointOffset(offset_rad=[1e-4] * 6),
    WristCoupling(k54=1e-4, k64=1e-4, k65=2e-4),
    LinkGeometry(shift_m=np.full((7, 3), 1e-4), turn_rad=np.full((7, 3), 1e-4)),
)


def written(*effects: Effect, **changes: object) -> RunTimeModule:
    model = springs().model
    robot = model.robot
    given = Conditions(robot.lower, robot.upper, TOOL, 30.0, CENTER, FORCE, bound_m=0.02)
    return write_module(model.with_effects(*model.effects, *effects), replace(given, **changes))  # type: ignore[arg-type]


@pytest.mark.parametrize("effect", CLOSED, ids=lambda e: e.key)
def test_most_effects_need_no_fit(effect: Effect) -> None:
    result = written(effect)
    assert result.correction.laws.exact == ("joint_compliance", effect.key)
    assert result.correction.fitted is None
    assert max(check.largest_m for _, check in result.checks) < 2e-5


def test_a_hose_is_fitted_and_the_header_says_how_well() -> None:
    result = written(HOSE)
    assert result.correction.laws.fitted == ("dress_pack",)
    found = result.checks[0][1]
    assert found.largest_m < 2e-5
    text = result.text.decode()
    assert "fitted over the region with" in text
    assert f"largest error {1e3 * found.largest_m:.4f} mm" in text


def test_a_channel_that_nobody_states_is_left_out_and_said() -> None:
    drift = ThermalJointDrift(drift_rad_per_K=[1e-5] * 6)
    result = written(Backlash(half_gap_rad=[1e-4] * 6), drift)
    assert result.correction.left_out == ("backlash", "thermal_joint_drift")
    assert [d.code for d in result.diagnostics] == ["RUN004"]
    assert result.diagnostics[0].message == (
        "`backlash`, `thermal_joint_drift` is left out: a target does not tell what it follows"
    )
    stated = written(drift, channels={"temperature": 30.0})
    assert stated.correction.left_out == ()
    assert "constant: temperature = 30" in stated.text.decode()
    assert stated.checks[0][1].correction_m > result.checks[0][1].correction_m


def test_the_instrument_is_no_part_of_the_arm_and_the_measured_tool_is_left_out() -> None:
    result = written(InstrumentFrame(shift_m=[0.001, 0, 0]), ToolFrame(shift_m=[0.001, 0, 0]))
    assert result.correction.laws.exact == ("joint_compliance",)
    assert result.correction.left_out == ("tool_frame",)


def test_a_hanging_arm_knows_where_gravity_pulls() -> None:
    model = springs().model
    hanging = replace(model, R_world_base=np.diag([1.0, -1.0, -1.0]))
    robot = model.robot
    result = write_module(hanging, Conditions(robot.lower, robot.upper, TOOL, 30.0, CENTER))
    assert "gravity in axes of the base [m/s2]: [0,0,9.81]" in result.text.decode()
    assert result.checks[0][1].largest_m < 5e-6


def test_a_smaller_region_makes_a_fit_finer() -> None:
    middle = np.radians([0.0, 20, -10, 0, 60, 0])
    wide = written(HOSE, lower=middle - 1.0, upper=middle + 1.0)
    narrow = written(HOSE, lower=middle - 0.2, upper=middle + 0.2)
    terms = [result.correction.fitted.terms for result in (narrow, wide) if result.correction.fitted]
    assert len(terms[0]) < len(terms[1])
    assert narrow.checks[0][1].largest_m < 5e-6
