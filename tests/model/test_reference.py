"""Poses seen from work that an axis carries, and their derivatives by the parameters of every effect of the cell."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.effects.registry import effect_library
from postproc.model.arm import Model
from postproc.model.derivatives.sensitivity import grown_sensitivity
from postproc.model.equilibrium import predict
from postproc.model.file import parse_model
from postproc.model.reference import with_axes
from postproc.model.rewrite import render_model
from postproc.model.uncertainty import beyond_range, range_table
from postproc.robot.cells.cell_file import restated
from postproc.robot.cells.station import station_of
from tests.independent import external_axes as X
from tests.independent.arm import TABLE_2, irb4600
from tests.independent.cells import Cell, States, settle
from tests.robot.test_cell import GANTRY
from tests.robot.test_cell import cell as controller_cell

KEYS = ("instrument_frame", "tool_frame", "external_axis_frame", "external_axis_error", "external_axis_compliance")


def model(station: X.Station) -> Model:
    text = f'robot = "irb4600_60_205"\n{station.text}'
    springs = f"[effects.joint_compliance]\ncompliance_rad_per_Nm = {TABLE_2.tolist()}\n"
    return parse_model(Source("m.toml", (text + springs).encode()))


TURNING = X.Axis("a", "rotary", "robot", X.framed(-0.5, 0.3, 0.2, degrees=25.0), -90.0, 90.0, "COLUMN")
STATIONS = [*X.STATIONS.values(), X.Station("turning column", (TURNING,), (X.LEANING,))]


@pytest.mark.parametrize("station", STATIONS, ids=lambda s: s.name)
def test_poses_on_the_work_are_those_of_an_independent_cell(station: X.Station) -> None:
    g = np.random.default_rng(3)
    e, q = X.positions(g, station, 6, False), g.uniform(-0.8, 0.8, (6, 6))
    arm, zero = model(station), np.zeros(6)
    positions = np.where(np.isin(np.arange(6), [ord(a) - 97 for a in arm.station.joints]), e, np.inf)
    state = with_axes(arm.station, arm.state(q, payload_mass=np.full(6, 20.0)), arm.station.positions(positions))
    center = np.zeros((6, 3))
    s = States(q, np.zeros((6, 6)), zero, zero, np.full(6, 20.0), center)
    cell = Cell(irb4600(), zero, TABLE_2, np.eye(4), np.eye(4), gravity=station.gravity)
    found = settle(cell, s)
    expected = station.places(e, {}, s, found.frames, cell.arm) @ found.frames.tcp
    assert predict(arm, state) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("name", ["track and table", "gantry"])
def test_slopes_against_central_differences(name: str) -> None:
    station, g = X.STATIONS[name], np.random.default_rng(5)
    arm, n = model(station), 5
    letters = tuple(sorted(arm.station.joints))
    library = effect_library()
    travel = {"low": (-1.0,) * len(letters), "high": (1.0,) * len(letters)}
    forms = {key: {"axes": letters} | (travel if key.endswith("error") else {}) for key in KEYS[2:]}
    parts = [library[key].null(**forms.get(key, {})) for key in KEYS]
    sized = [e.with_vector(g.uniform(0.2, 1.0, len(e.vector())) * e.scale()) for e in parts]
    sized[0] = sized[0].with_vector(np.array([0.4, -2.0, 0.3, 0.5, -1.1, 2.0]))
    arm = arm.with_effects(*arm.effects, *sized)
    positions = np.full((n, 6), np.nan)
    positions[:, [ord(a) - 97 for a in letters]] = g.uniform(-1.0, 1.0, (n, len(letters)))
    state = arm.state(g.uniform(-0.8, 0.8, (n, 6)), payload_mass=np.full(n, 20.0), wrench=g.normal(0, 200, (n, 6)))
    state = with_axes(arm.station, state, positions)
    at = grown_sensitivity(arm, state)
    for effect in sized:
        x, every = effect.vector(), np.ones(len(effect.vector()), dtype=bool)
        found = at.by_parameter(effect, every)[:, :3]
        for i in range(0, len(x), 3):
            step = 0.1 * effect.scale() * (np.arange(len(x)) == i)
            ends = []
            for sign in (1, -1):
                moved = effect.with_vector(x + sign * step)
                changed = arm.with_effects(*(moved if e is effect else e for e in arm.effects))
                ends.append(predict(changed, state)[:, :3, 3])
            slope = (ends[0] - ends[1]) / (2 * step[i])
            size = max(float(np.abs(slope).max()), 1e-3 / float(effect.scale()[i]) * 1e-3)
            assert found[:, :, i] == pytest.approx(slope, abs=4e-3 * size), (effect.key, effect.names()[i])


def test_a_cell_of_a_backup_is_written_into_a_model_file_as_it_is() -> None:
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


def test_positions_beyond_the_measured_ones_are_told() -> None:
    arm = model(X.STATIONS["track"])
    e = np.full((2, 6), np.nan)
    e[:, 0] = 0.5, 2.0
    measured = with_axes(arm.station, arm.state(np.zeros((2, 6))).with_(station=arm.station), e)
    known = Model(arm.robot, station=arm.station, fit={"range": range_table(measured)})
    (beyond,) = beyond_range(known, measured.with_(external_axes=e + 1.0))
    assert beyond.text == "eax_a is 3000.0, measured from 500.0 to 2000.0"
