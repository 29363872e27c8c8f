"""Joint speeds, accelerations and approach sides of time-stamped rows."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.measure.measurements import Measurements
from tests.measure.tables import columns, points, poses, read

SIZE = np.array([40, 30, 20, 60, 50, 0.0])
RATE = 2 * np.pi * np.array([0.311, 0.427, 0.523, 0.617, 0.733, 0.0])


def record(q: np.ndarray, time: np.ndarray, **more) -> Measurements:
    return read(columns(q, points(q), digits=6, time_s=[f"{t:.6f}" for t in time], **more))


def swing(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 6) angles [deg] and speeds [deg/s]; joint 6 stands still."""
    phase = RATE * time[:, None]
    return SIZE * np.sin(phase) + 10, SIZE * RATE * np.cos(phase)


def said(data: Measurements) -> str:
    (finding,) = (d for d in data.diagnostics if d.code == "DAT014")
    return finding.message


EVEN, RUN = np.arange(120) / 25, np.arange(60) / 25
RUNS = np.r_[RUN, RUN + 7, RUN + 11]
UNEVEN = np.cumsum(np.random.default_rng(4).uniform(0.005, 0.015, 200))
MIXED, TURNED = np.random.default_rng(4).permutation(200), np.r_[60:120, :60]
# True times, those that the table states, rows at the ends of records, the error of a speed [deg/s], and what is said.
CLOCKS = {
    "20 a second": (EVEN * 25 / 20, None, [0, -1], 0.05, "120 of 120 rows are a record of the moving arm (20 rows"),
    "125 a second": (EVEN / 5, None, [0, -1], 0.002, "(125 rows a second)"),
    "1000 a second": (EVEN / 40, None, [0, -1], 0.003, "(1e+03 rows a second)"),
    "uneven, mixed": (UNEVEN[MIXED], None, [MIXED.argmin(), MIXED.argmax()], 0.05, "200 of 200 rows"),
    "a gap": (np.r_[RUN / 2, 5 + RUN / 2], None, [0, 59, 60, 119], 0.01, "120 of 120 rows"),
    "three runs": (
        RUNS,
        np.tile(RUN, 3),
        [0, 59, 60, 119, 120, 179],
        0.03,
        "the clock begins anew 2 times and goes on",
    ),
    "another order": (EVEN[TURNED], None, [59, 60], 0.03, "120 of 120 rows"),
}


@pytest.mark.parametrize("name", CLOCKS)
def test_speeds_are_derivatives_by_time_whatever_the_clock(name):
    time, stated, ends, tolerance, message = CLOCKS[name]
    q, v = swing(time)
    data = record(q, time if stated is None else stated)
    inner = np.delete(np.arange(len(q)), ends)
    assert np.degrees(data.state.v)[inner] == pytest.approx(v[inner], abs=tolerance)
    assert np.degrees(data.state.v) == pytest.approx(v, abs=0.2) and np.abs(data.state.a).max() < 30
    clear = np.abs(v[inner]) > 5
    assert (data.state.approach[inner][clear] == np.sign(v[inner][clear])).all()
    assert message in said(data) and ("begins anew" in said(data)) == (stated is not None)
    assert stated is None or (np.diff(data.state.time) > 0).all()
    assert stated is not None or data.state.time == pytest.approx(time, abs=1e-6)


@pytest.mark.parametrize("rate", [20.0, 125.0, 1000.0])
def test_accelerations_are_told_from_rounded_angles(rate):
    """Angles to 0.001 deg, at a thousand rows a second too, where three rows tell nothing: 2.5 rad/s^2 of noise."""
    time = np.arange(int(rate) * 4) / rate
    q, _ = swing(time)
    data = record(np.round(q, 3), time)
    true = np.radians(-(RATE**2) * (q - 10))
    inner = slice(int(0.05 * rate) + 1, -int(0.05 * rate) - 1)
    assert np.abs(true).max() > 10
    assert np.std((data.state.a - true)[inner, 5]) < 0.01
    assert data.state.a[inner] == pytest.approx(true[inner], abs=0.1)


def test_a_record_with_an_empty_time_is_one():
    time = np.arange(120) / 20
    q, v = swing(time)
    stamps = ["" if i == 40 else f"{t:.6f}" for i, t in enumerate(time)]
    data = read(columns(q, points(q), time_s=stamps))
    assert np.degrees(data.state.v[1:-1]) == pytest.approx(v[1:-1], abs=0.05)
    assert data.state.time[40] == pytest.approx(2.0)
    (gap,) = (d for d in data.diagnostics if d.code == "DAT005")
    assert gap.message.endswith("what lies between its neighbours is taken there")


@pytest.mark.parametrize("step", [0.01, 0.02])
def test_stamps_coarser_than_the_rows_are_counted(step):
    time = np.arange(200) / 125
    q, v = swing(time)
    data = record(q, np.floor(time / step) * step)
    assert np.degrees(data.state.v) == pytest.approx(v, abs=0.02 * np.abs(v).max())
    assert "(125 rows a second)" in said(data)
    assert said(data).endswith("it counts the rows, for which its stamps are coarse")
    # Where rows were lost they are no count of the time.
    lost = np.r_[:80, 100:200]
    data = record(q[lost], np.floor(time[lost] / step) * step)
    assert not any("it counts the rows" in d.message for d in data.diagnostics)


@pytest.mark.parametrize("pause", [0.1, 10.0])
def test_poses_that_only_follow_each_other_are_at_rest(pause):
    data = record(poses(60), pause * np.arange(60))
    assert data.state.v is None


def test_speeds_of_the_table_are_kept():
    time = np.arange(60) / 50
    q, v = swing(time)
    data, derived = record(q, time, **{f"v{j + 1}_deg_s": 2 * v[:, j] for j in range(6)}), record(q, time)
    assert np.degrees(data.state.v) == pytest.approx(2 * v, abs=1e-5)
    np.testing.assert_allclose(data.state.a, derived.state.a)
    np.testing.assert_array_equal(data.state.approach, derived.state.approach)
    assert "accelerations and approach sides are derived" in said(data)


def test_a_joint_that_stands_keeps_its_side():
    time = np.arange(100) / 50
    q = np.full((100, 6), 10.0)
    q[:, 1] += 20 * np.minimum(time, time[49])
    q[:, 0] += 30 * np.sin(3 * time)
    data = record(q, time)
    assert (data.state.approach[:, 1] == 1).all()
    assert (data.state.approach[:, 3] == 0).all()


def test_a_slow_joint_with_rounded_angles_comes_from_one_side():
    """At a thousand rows a second, its angle of 0.001 deg steps once in five rows."""
    time = np.arange(400) / 1000
    q = np.round(np.full((400, 6), 10.0) + np.outer(time, [30, 0.2, 0, 0, 0, -0.3]), 3)
    side = record(q, time).state.approach[10:]
    assert (side == [1, 1, 0, 0, 0, -1]).all()


POSES = np.array([[0, 0, 0, 0, 30, 0.0], [5, -5, 0, 0, 30, 9], [5.005, -9, 0, 3, 20, 9], [2, -9, 0, 3, 40, 9]])
SIDES = np.array([[0, 0, 0, 0, 0, 0], [1, -1, 0, 0, 0, 1], [1, -1, 0, 1, -1, 1], [-1, -1, 0, 1, 1, 1]])
# How the rows of four poses are labelled and stand, what is stated beside them, and what then tells their order.
ORDERS = {
    "times": ([2, 0, 3, 1], {"time_s": [300, 60, 400, 200]}, False, "the times"),
    "the user's word": ([0, 1, 2, 3], {"pose_id": list("dbca")}, True, "the order of the rows"),
    "rising names": ([0, 1, 2, 3], {"pose_id": ["P3", "P7", "P12", "P13"]}, False, "the numbers in `pose_id`"),
    "names in another order": ([2, 0, 3, 1], {"pose_id": ["P3", "P1", "P4", "P2"]}, False, ""),
    "names alone": ([0, 1, 2, 3], {"pose_id": list("abcd")}, False, ""),
    "speeds": ([0, 1, 2, 3], {f"v{j}_deg_s": [5] * 4 for j in range(1, 7)}, True, ""),
}


@pytest.mark.parametrize("name", ORDERS)
def test_a_joint_came_from_the_side_of_the_pose_before_where_rows_have_an_order(name):
    """A move of 0.005 deg, less than a gap, keeps the side; so does a joint that stands."""
    rows, more, stated, told = ORDERS[name]
    data = read(columns(POSES[rows], points(POSES[rows]), **more), rows_in_order=stated)
    assert data.sides_from == told and not [d for d in data.diagnostics if d.code == "DAT014"]
    assert (data.state.approach is None) if not told else (data.state.approach == SIDES[rows]).all()


def test_sides_that_are_stated_are_kept_and_repeats_stay_repeats():
    four = columns(POSES, points(POSES), **{f"dir{j}": [1, 1, -1, -1] for j in range(1, 7)})
    stated = read(four, rows_in_order=True)
    assert stated.sides_from == "" and (stated.state.approach[:, 0] == [1, 1, -1, -1]).all()
    again = [0, 1, 2, 1, 0]
    data = read(columns(POSES[again], points(POSES[again]), pose_id=list("abcba")), rows_in_order=True)
    assert data.state.approach[:, 1].tolist() == [0, -1, -1, 1, 1] and data.repeats.tolist() == [0, 1, 2, 1, 0]


def test_no_side_is_derived_over_the_begin_of_a_session_a_lost_row_or_two_poses_of_one_time():
    q = np.vstack([POSES, POSES])
    seen = points(q)
    sessions = read(columns(q, seen, session=list("aaaabbbb"), time_s=[0, 60, 120, 180, 10, 70, 130, 190]))
    assert (sessions.state.approach == np.vstack([SIDES, SIDES])).all()
    same = read(columns(q, seen, time_s=[0, 60, 60, 180, 240, 300, 360, 420]))
    assert (same.state.approach[2] == 0).all() and (same.state.approach[[1, 5]][:, [0, 1, 5]] == [1, -1, 1]).all()
    lost = columns(q, seen)
    lost["q2_deg"][2] = ""
    sides = read(lost, rows_in_order=True).state.approach
    assert (sides[2:4] == 0).all() and (sides[5, [0, 1, 5]] == [1, -1, 1]).all()
