"""Rows that cannot be right among others: tables of an arm that is written here in plain numpy, spoilt in known rows."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.measure.measurements import Measurements
from tests.build import refused
from tests.measure.tables import columns, points, poses, read

ZEROS_DEG = np.array([0.05, -0.04, 0.06, -0.1, 0.08, 0.03])
N = 120
TURN = Rotation.from_euler("zx", [35, 10], degrees=True).as_matrix().T
SPOILT = {
    "rotated": lambda y: y @ TURN,
    "shifted": lambda y: y + np.array([18.0, -16.0, 18.0]),
    "far": lambda y: y + np.array([500.0, 0.0, 0.0]),
    "swapped": lambda y: y[:, [1, 0, 2]],
    "others": lambda y: np.roll(y, 1, axis=0),
}


def arm_with_zeros(seed: int = 1, n: int = N) -> tuple[np.ndarray, np.ndarray]:
    """Commanded angles [deg] and points [mm] of an arm whose zeros are off: about 1 mm from its nominal kinematics."""
    q = np.round(poses(n, seed), 5)
    return q, points(q + ZEROS_DEG) + np.random.default_rng(seed).normal(0, 0.03, (n, 3))


def table(q: np.ndarray, y: np.ndarray, **more) -> Measurements:
    return read(columns(q, y, **more))


def wrong(q: np.ndarray, y: np.ndarray, **more) -> list[int]:
    """Indices of the rows that are left out."""
    return np.flatnonzero(~table(q, y, **more).usable).tolist()


def rows_in(message: str) -> list[int]:
    """Indices of the rows that a message lists behind its last ``rows``."""
    runs = re.findall(r"(\d+)(?: to (\d+))?", message.rpartition("rows ")[2])
    return [k - 1 for first, last in runs for k in range(int(first), int(last or first) + 1)]


def spoilt_rows(share: float, run: bool, seed: int) -> np.ndarray:
    count = round(share * N)
    return np.arange(30, 30 + count) if run else np.sort(np.random.default_rng(seed).choice(N, count, replace=False))


@pytest.mark.parametrize("share", [0.03, 0.3])
@pytest.mark.parametrize("run", [False, True], ids=["anywhere", "a run"])
@pytest.mark.parametrize("kind", SPOILT)
def test_rows_that_cannot_be_right_are_told_from_the_others(kind, run, share):
    q, y = arm_with_zeros()
    bad = spoilt_rows(share, run, int(1000 * share))
    y[bad] = SPOILT[kind](y[bad])
    data = table(q, y)
    assert np.flatnonzero(~data.usable).tolist() == bad.tolist()
    messages = [d.message for d in data.diagnostics if d.code == "DAT007"]
    assert len(messages) == len(bad) if len(bad) <= 6 else rows_in(messages[0]) == bad.tolist()


@pytest.mark.parametrize("factor", [25.4, 1000.0], ids=["inches", "metres"])
def test_a_few_rows_in_another_unit_are_left_out_and_many_are_named(factor):
    (q, few), (_, many) = arm_with_zeros(), arm_with_zeros()
    bad, rest = spoilt_rows(0.03, False, 3), spoilt_rows(0.3, False, 3)
    few[bad] /= factor
    assert wrong(q, few) == bad.tolist()
    many[rest] /= factor
    (finding,) = refused(lambda: table(q, many))
    assert rows_in(finding.message) == rest.tolist()


@pytest.mark.parametrize("seed", range(1, 4))
def test_no_row_of_a_table_that_is_right_is_doubted(seed):
    assert wrong(*arm_with_zeros(seed)) == []


def test_joint_zeros_that_are_far_off_are_no_wrong_rows():
    q = np.round(poses(N, 4), 5)
    assert wrong(q, points(q + np.array([0.0, 1.2, -0.8, 0.0, 0.0, 0.0]))) == []


def test_an_arm_that_moves_may_lag_behind_by_more():
    """20 mm are too much of an arm at rest, and what a fast one yields; 80 mm are too much of either."""
    q, y = arm_with_zeros()
    y[[7, 30]] += [[0.0, 20.0, 0.0], [0.0, 80.0, 0.0]]
    assert wrong(q, y) == [7, 30]
    assert wrong(q, y, **{f"v{j}_deg_s": np.full(N, 30.0) for j in range(1, 7)}) == [30]


def test_many_wrong_rows_are_left_out_unless_the_user_knows_better_and_too_many_are_an_error():
    q, y = arm_with_zeros()
    y[:20] = y[:20] @ TURN
    assert wrong(q, y) == list(range(20))
    assert read(columns(q, y), accept=frozenset({"DAT007"})).usable.all()
    y[20:48] = y[20:48] @ TURN
    (finding,) = refused(lambda: table(q, y))
    assert finding.code == "DAT009" and rows_in(finding.message) == list(range(48))


def test_sessions_are_placed_each_by_itself():
    """The instrument was moved for `b`; that is no error, and a wrong row of it is told from its own place."""
    q, y = arm_with_zeros()
    session = ["a"] * 70 + ["b"] * 50
    y[70:] = y[70:] @ TURN + np.array([1000.0, 0.0, 0.0])
    assert wrong(q, y, session=session) == []
    y[[75, 90, 91]] += [0.0, 60.0, 0.0]
    assert wrong(q, y, session=session) == [75, 90, 91]


def test_sessions_of_two_poses_from_one_place_are_one_in_the_search_for_wrong_rows():
    q, y = arm_with_zeros()
    y[[20, 50, 51]] += [0.0, 60.0, 0.0]
    assert wrong(q, y, session=[f"s{i // 2}" for i in range(N)]) == [20, 50, 51]


def test_a_session_of_mostly_wrong_rows_is_named():
    q, y = arm_with_zeros()
    y[95:120] += np.random.default_rng(2).normal(0, 300, (25, 3))
    (finding,) = refused(lambda: table(q, y, session=["monday"] * 90 + ["friday"] * 30))
    assert finding.message.startswith("session `friday`, too many rows") and finding.message.endswith("rows 91 to 120")


def seen_from_anywhere(count: int, size: int, signs: float | list[float] = 1) -> Measurements:
    """What is read of sessions of ``size`` poses each, every one seen from another place; signs of the joints."""
    g = np.random.default_rng(4)
    q, y = arm_with_zeros(n=count * size)
    for s in range(0, count * size, size):
        R = Rotation.from_rotvec(g.normal(0, 1, 3)).as_matrix()
        y[s : s + size] = y[s : s + size] @ R.T + g.normal(0, 3000, 3)
    return table(q * signs, y, session=[f"s{i // size}" for i in range(count * size)])


def test_sessions_of_few_poses_from_several_places_are_named_as_the_cause():
    """Six unknowns of each place want more than the few numbers of its rows: nothing is said of the arm."""
    (finding,) = refused(lambda: seen_from_anywhere(20, 2))
    assert finding.code == "DAT009" and finding.message == (
        "no session has more than 2 poses, and the points were not all seen from one place: nothing tells where "
        "the instrument stood"
    )
    assert finding.help.startswith("measure 8 poses or more from each place of the instrument, in one session")


def test_columns_are_read_anew_in_the_largest_of_sessions_from_several_places():
    """The rows together fit no place whatever the columns mean; those of one session do."""
    (finding,) = refused(lambda: seen_from_anywhere(3, 40, signs=[1, 1, 1, -1, 1, 1]))
    assert finding.message.startswith("column `q4_deg` looks negated")


@pytest.mark.parametrize("n", [12, N])
def test_a_point_at_the_origin_of_the_instrument_is_measured_where_the_arm_stood_there(n):
    """An instrument's frame that was set up on a point of the arm has that point at 0, 0, 0, exactly."""
    q, y = arm_with_zeros(n=n)
    data = table(q, y - y[3])
    assert data.usable.all() and not data.diagnostics


@pytest.mark.parametrize(("n", "count"), [(12, 2), (N, 1), (N, 30), (N, 90)])
def test_zeros_where_the_arm_did_not_stand_are_a_lost_beam(n, count):
    q, y = arm_with_zeros(n=n)
    bad = np.sort(np.random.default_rng(2).choice(n, count, replace=False))
    y[bad] = 0.0
    data = table(q, y)
    assert np.flatnonzero(~data.usable).tolist() == bad.tolist()
    (finding,) = (d for d in data.diagnostics if "lost its beam" in d.message)
    assert finding.code == "DAT005" and f"in {count} of {n} rows" in finding.message
