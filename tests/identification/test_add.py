"""An effect that is added to a fitted model comes out as if it had been there from the start."""

from __future__ import annotations

import numpy as np

from postproc.effects.registry import effect_library
from postproc.estimation.least_squares import fit_model
from postproc.estimation.solving.settle import settled
from postproc.identification.add import grown
from postproc.measure.read.table import read_measurements
from postproc.model.arm import Model
from postproc.robot.catalogue import load_robot
from tests.measure.tables import HEADER, Source, points

LAG = 0.003  # [s]


def record(seconds: float, rows: int, seed: int) -> Source:
    """All joints swing and trail their command by the same time; too short a record to tell geometry from lag."""
    g = np.random.default_rng(seed)
    time = np.arange(rows)[:, None] * seconds / rows
    size, rate = np.array([30, 20, 20, 20, 15, 30.0]), 2 * np.pi * np.array([0.311, 0.427, 0.523, 0.617, 0.733, 0.4])
    turn = rate * time + g.uniform(0, 6, 6)
    q, v = size * np.sin(turn) + 10, size * rate * np.cos(turn)
    seen = points(q - LAG * v) + g.normal(0, 0.02, (rows, 3))
    lines = [f"P{i}," + ",".join(f"{x:.6f}" for x in row) for i, row in enumerate(np.hstack([q, seen, time]))]
    return Source("record.csv", "\n".join([f"{HEADER},time_s", *lines]).encode())


def test_what_stood_in_for_a_missing_effect_does_not_stay():
    """Geometry that mimicked the lag, and cannot be determined beside it, goes back to null."""
    library, arm = effect_library(), load_robot("irb4600_60_205")
    data = read_measurements(record(2.0, 250, 1), arm)
    keys = ("instrument_frame", "tool_frame", "joint_offset", "link_geometry")
    base = fit_model(Model(arm), data, [library[key].null() for key in keys])
    fit = grown(base, library["servo_lag"])
    null = [fit.model.effect(key).vector()[joint] == 0.0 for key, joint in fit.unidentifiable]
    assert len(null) > 10 and np.mean(null) > 0.9  # what stopped at its bound is held there
    fit = settled(fit)
    lag = fit.model.effect("servo_lag").vector()
    for key, joint in fit.parameters:
        assert key != "servo_lag" or abs(lag[joint] - LAG) < 4 * fit.sigma[key, joint]
