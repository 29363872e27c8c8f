"""Poses seen from work that an axis carries, and their derivatives by the parameters of every effect of the cell."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.effects.registry import effect_library
from postproc.model.arm import Model, with_axes
from postproc.model.equilibrium import predict
from postproc.model.file import parse_model
from postproc.model.rewrite import render_model
from postproc.model.uncertainty.prediction import beyond_range, range_table
from postproc.robot.cells.cell_file import restated
from postproc.robot.cells.station import station_of
from tests.independent import external_axes as X
from tests.independent.arm import TABLE_2, irb4600
from tests.independent.cells import Cell, States, settle
from tests.model.arms import parameter_slope, parameters, pose_derivatives, with_more
from tests.robot.test_cell import GANTRY
from tests.robot.test_cell import cell as controller_cell

KEYS = ("instrument_frame", "tool_frame", "external_axis_frame", "external_axis_error", "external_axis_compliance")
TURNING = X.Axis("a", "rotary", "robot", X.framed(-0.5, 0.3, 0.2, degrees=25.0), -90.0, 90.0, "COLUMN")
STATIONS = [*X.STATIONS.values(), X.Station("turning column", (TURNING,), (X.LEANING,))]


def model(station: X.Station) -> Model:
    springs = f"[effects.joint_compliance]\ncompliance_rad_per_Nm = {TABLE_2.tolist()}\n"
    return parse_model(Source("m.toml", f'robot = "irb4600_60_205"\n{station.text}{springs}'.encode()))


def standing(arm: Model, positions: np.ndarray, q: np.ndarray, **channels):
    """States with external axes at positions (n, 6) [m], [rad]; axes that the cell has not are nowhere."""
    known = np.isin(np.arange(6), [ord(axis) - 97 for axis in arm.station.joints])
    return with_axes(arm.station, arm.state(q, **channels), np.where(known, positions, np.nan))


@pytest.mark.parametrize("station", STATIONS, ids=lambda s: s.name)
def test_poses_on_the_work_are_those_of_an_independent_cell(station):
    g = np.random.default_rng(3)
    e, q = X.positions(g, station, 6, False), g.uniform(-0.8, 0.8, (6, 6))
    arm, zero, mass = model(station), np.zeros(6), np.full(6, 20.0)
    cell = Cell(irb4600(), zero, TABLE_2, np.eye(4), np.eye(4), gravity=station.gravity)
    states = States(q, np.zeros((6, 6)), zero, zero, mass, np.zeros((6, 3)))
    frames = settle(cell, states).frames
    expected = station.places(e, {}, states, frames, cell.arm) @ frames.tcp
    positions = arm.station.positions(np.where(np.isfinite(e), e, np.inf))
    assert predict(arm, standing(arm, positions, q, payload_mass=mass)) == pytest.approx(expected, abs=1e-7)


def test_slopes_against_central_differences():
    g, library = np.random.default_rng(5), effect_library()
    arm = model(X.STATIONS["track and table"])
    letters = tuple(sorted(arm.station.joints))
    travel = {"low": (-1.0,) * len(letters), "high": (1.0,) * len(letters)}
    forms = {key: {"axes": letters} | (travel if key.endswith("error") else {}) for key in KEYS[2:]}
    effects = [library[key].null(**forms.get(key, {})) for key in KEYS]
    sized = [e.with_vector(g.uniform(0.2, 1.0, len(e.vector())) * e.scale()) for e in effects]
    sized[0] = sized[0].with_vector(np.array([0.4, -2.0, 0.3, 0.5, -1.1, 2.0]))
    arm = with_more(arm, *sized)
    loads = {"payload_mass": np.full(5, 20.0), "wrench": g.normal(0, 200, (5, 6))}
    state = standing(arm, g.uniform(-1.0, 1.0, (5, 6)), g.uniform(-0.8, 0.8, (5, 6)), **loads)
    D, scale = pose_derivatives(arm, state), np.concatenate([e.scale() for e in arm.effects])
    for k in range(6, len(parameters(arm)), 3):
        expected = parameter_slope(arm, state, k, 0.05 * scale[k])[:, :3]
        size = max(float(np.abs(expected).max()), 1e-6 / scale[k])
        assert D[:, :3, k] == pytest.approx(expected, abs=4e-3 * size), k


def test_a_cell_of_a_backup_is_written_into_a_model_file_as_it_is():
    """A public gantry of four axes with a drive that follows, as its controller has it, and as [[external_axes]]."""
    station = station_of(controller_cell(GANTRY))
    assert station is not None
    arm = parse_model(Source("m.toml", b'robot = "irb4600_60_205"\n')).at_station(station)
    again = parse_model(Source("again.toml", render_model(arm).encode())).station
    e = np.full((4, 6), np.nan)
    e[:, :4] = np.random.default_rng(0).uniform(-0.5, 0.5, (4, 4))
    e[:, 5] = e[:, 0]
    kept = restated(station)
    assert again is not None and kept.base(e) == pytest.approx(again.base(e), abs=1e-12)
    assert kept.gravity(e) == pytest.approx(station.gravity(e), abs=1e-9)
    # The world of a model file is the base at zero.
    zero = np.linalg.inv(station.base(np.zeros((1, 6))))
    assert kept.base(e) == pytest.approx(zero @ station.base(e), abs=1e-6)
    # Effects of an axis speak of the same axes, whoever describes them.
    for axis, frames in kept.axis_frames(e).items():
        assert np.array(frames) == pytest.approx(np.array(station.axis_frames(e)[axis]), abs=1e-6)
        assert kept.joints[axis].direction == pytest.approx(kept.joints[axis].way)
    assert again.joints["a"].upper == pytest.approx(station.joints["a"].upper) and again.work is None


def test_gravity_turns_with_an_axis_that_carries_the_arm_alone():
    column, table = (model(s) for s in (STATIONS[-1], X.STATIONS["track and table"]))
    assert standing(column, np.full((1, 6), 0.5), np.zeros((1, 6))).gravity.ndim == 2
    assert standing(table, np.full((1, 6), 0.5), np.zeros((1, 6))).gravity.ndim == 1


def test_positions_beyond_the_measured_ones_are_told():
    arm = model(X.STATIONS["track"])
    e = np.outer([0.5, 2.0], np.ones(6))
    measured = standing(arm, e, np.zeros((2, 6))).with_(station=arm.station)
    known = Model(arm.robot, station=arm.station, fit={"range": range_table(measured)})
    (beyond,) = beyond_range(known, measured.with_(external_axes=measured.external_axes + 1.0))
    assert beyond.text == "eax_a is 3000.0, measured from 500.0 to 2000.0"
