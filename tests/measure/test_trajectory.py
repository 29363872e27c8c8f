"""Joint speeds, accelerations and approach sides of time-stamped rows."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.measure.read.table import read_measurements
from postproc.robot.catalogue import load_robot
from tests.measure.tables import HEADER, Source, points, poses


def table(q: np.ndarray, time: np.ndarray, extra: str = "", more: np.ndarray | None = None) -> Source:
    columns = [q, points(q), time[:, None]] + ([] if more is None else [more])
    body = "".join(f"P{i}," + ",".join(f"{x:.6f}" for x in row) + "\n" for i, row in enumerate(np.hstack(columns)))
    return Source("record.csv", f"{HEADER},time_s{extra}\n{body}".encode())


def swing(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 6) angles [deg] and speeds [deg/s]; joint 6 stands still."""
    size, rate = np.array([40, 30, 20, 60, 50, 0.0]), np.array([0.311, 0.427, 0.523, 0.617, 0.733, 0.0])
    turn = 2 * np.pi * rate * time[:, None]
    return size * np.sin(turn) + 10, size * 2 * np.pi * rate * np.cos(turn)


@pytest.mark.parametrize("rate", [20.0, 125.0, 1000.0])
def test_speeds_are_derivatives_by_time(rate):
    time = np.arange(120) / rate
    q, v = swing(time)
    data = read_measurements(table(q, time), load_robot("irb4600_60_205"))
    assert np.degrees(data.state.v[1:-1]) == pytest.approx(v[1:-1], abs=1.6e3 / rate**2 + 1e-2)
    clear = np.abs(v) > 5
    assert (data.state.approach[clear] == np.sign(v[clear])).all()
    assert [d.code for d in data.diagnostics] == ["DAT014"]
    assert "120 of 120 rows" in data.diagnostics[0].message


@pytest.mark.parametrize("rate", [20.0, 125.0, 1000.0])
def test_accelerations_are_told_from_rounded_angles(rate):
    """Angles to 0.001 deg, at a thousand rows a second too, where three rows tell nothing: 2.5 rad/s^2 of noise."""
    time = np.arange(int(rate) * 4) / rate
    q, _ = swing(time)
    data = read_measurements(table(np.round(q, 3), time), load_robot("irb4600_60_205"))
    true = np.radians(-((2 * np.pi * np.array([0.311, 0.427, 0.523, 0.617, 0.733, 0.0])) ** 2) * (q - 10))
    inner = slice(int(0.05 * rate) + 1, -int(0.05 * rate) - 1)
    assert np.abs(true).max() > 10
    assert np.std((data.state.a - true)[inner, 5]) < 0.01
    assert data.state.a[inner] == pytest.approx(true[inner], abs=0.1)


def test_a_record_with_an_empty_time_is_one():
    time = np.arange(120) / 20
    q, v = swing(time)
    lines = table(q, time).data.decode().split("\n")
    lines[41] = lines[41].rpartition(",")[0] + ","
    data = read_measurements(Source("record.csv", "\n".join(lines).encode()), load_robot("irb4600_60_205"))
    assert np.degrees(data.state.v[1:-1]) == pytest.approx(v[1:-1], abs=4.1)
    assert data.state.time[40] == pytest.approx(2.0)
    (gap,) = (d for d in data.diagnostics if d.code == "DAT005")
    assert gap.message.endswith("what lies between its neighbours is taken there")


def test_uneven_times_and_rows_out_of_order():
    g = np.random.default_rng(4)
    time = np.cumsum(g.uniform(0.005, 0.015, 200))
    q, v = swing(time)
    mixed = g.permutation(200)
    data = read_measurements(table(q[mixed], time[mixed]), load_robot("irb4600_60_205"))
    inside = np.setdiff1d(np.arange(200), [0, 199])
    assert np.degrees(data.state.v[np.argsort(mixed)])[inside] == pytest.approx(v[inside], abs=0.5)


def test_a_gap_divides_records():
    time = np.concatenate([np.arange(60) / 50, 5 + np.arange(60) / 50])
    q, v = swing(time)
    data = read_measurements(table(q, time), load_robot("irb4600_60_205"))
    inner = np.setdiff1d(np.arange(120), [0, 59, 60, 119])
    assert np.degrees(data.state.v)[inner] == pytest.approx(v[inner], abs=1.0)
    assert np.abs(np.degrees(data.state.v) - v).max() < 20
    assert np.abs(data.state.a).max() < 30


def test_a_clock_that_begins_anew_goes_on():
    """Three runs below each other, each counted from zero: their rows are no neighbours in time."""
    runs = [swing(start + np.arange(60) / 25) for start in (0.0, 7.0, 11.0)]
    q, v = (np.vstack(part) for part in zip(*runs, strict=True))
    data = read_measurements(table(q, np.tile(np.arange(60) / 25, 3)), load_robot("irb4600_60_205"))
    assert np.degrees(data.state.v) == pytest.approx(v, abs=25)
    inner = np.flatnonzero(~np.isin(np.arange(180) % 60, (0, 59)))
    assert np.degrees(data.state.v)[inner] == pytest.approx(v[inner], abs=3)
    assert (np.diff(data.state.time) > 0).all()
    assert "the clock begins anew 2 times and goes on" in data.diagnostics[0].message


@pytest.mark.parametrize("step", [0.01, 0.02])
def test_stamps_coarser_than_the_rows_are_counted(step):
    time = np.arange(200) / 125
    q, v = swing(time)
    data = read_measurements(table(q, np.floor(time / step) * step), load_robot("irb4600_60_205"))
    assert np.degrees(data.state.v) == pytest.approx(v, abs=0.02 * np.abs(v).max())
    assert "(125 rows a second)" in data.diagnostics[0].message and "it counts the rows" in data.diagnostics[0].message
    # Where rows were lost they are no count of the time.
    lost = np.r_[:80, 100:200]
    data = read_measurements(table(q[lost], np.floor(time[lost] / step) * step), load_robot("irb4600_60_205"))
    assert not any("it counts the rows" in d.message for d in data.diagnostics)


@pytest.mark.parametrize("pause", [0.1, 10.0])
def test_poses_that_only_follow_each_other_are_at_rest(pause):
    q = poses(60)
    data = read_measurements(table(q, pause * np.arange(60)), load_robot("irb4600_60_205"))
    assert data.state.v is None and data.state.approach is None


def test_speeds_of_the_table_are_kept():
    time = np.arange(60) / 50
    q, v = swing(time)
    names = "," + ",".join(f"v{j}_deg_s" for j in range(1, 7))
    data = read_measurements(table(q, time, names, 2 * v), load_robot("irb4600_60_205"))
    assert np.degrees(data.state.v) == pytest.approx(2 * v, abs=1e-5)
    derived = read_measurements(table(q, time), load_robot("irb4600_60_205"))
    np.testing.assert_allclose(data.state.a, derived.state.a)
    np.testing.assert_array_equal(data.state.approach, derived.state.approach)
    (found,) = (d for d in data.diagnostics if d.code == "DAT014")
    assert "accelerations and approach sides are derived" in found.message


def test_a_joint_that_stands_keeps_its_side():
    time = np.arange(100) / 50
    q = np.full((100, 6), 10.0)
    q[:50, 1] += 20 * time[:50]
    q[50:, 1] += 20 * time[49]
    q[:, 0] += 30 * np.sin(3 * time)
    data = read_measurements(table(q, time), load_robot("irb4600_60_205"))
    assert (data.state.approach[:, 1] == 1).all()
    assert (data.state.approach[:, 3] == 0).all()
