"""Rows that cannot be right among others: tables of an arm that is written here in plain numpy, spoilt in known rows."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.diagnostics import PostprocError
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.robot.catalogue import load_robot
from tests.build import refused
from tests.measure.tables import HEADER, points, poses, source

ARM = load_robot("irb4600_60_205")
ZEROS_DEG = np.array([0.05, -0.04, 0.06, -0.1, 0.08, 0.03])
N = 120


def measured(seed: int = 1, n: int = N) -> tuple[np.ndarray, np.ndarray]:
    """Commanded angles [deg] and points [mm] of an arm whose zeros are off: about 1 mm from its nominal kinematics."""
    q = np.round(poses(n, seed), 5)
    return q, points(q + ZEROS_DEG) + np.random.default_rng(seed).normal(0, 0.03, (n, 3))


def written(q: np.ndarray, y: np.ndarray, session: list[str] | None = None, **terms) -> Measurements:
    head = HEADER + (",session" if session else "")
    ends = [f",{name}" for name in session] if session else [""] * len(q)
    rows = [
        ",".join([f"P{i}", *(f"{x:.5f}" for x in q[i]), *(f"{x:.4f}" for x in y[i])]) + ends[i] for i in range(len(q))
    ]
    return read_measurements(source([head, *rows]), ARM, terms=Reading(**terms))


def rotated(y: np.ndarray, g: np.random.Generator) -> np.ndarray:
    return y @ Rotation.from_euler("zx", [35, 10], degrees=True).as_matrix().T


SPOILT = {
    "rotated": rotated,
    "shifted": lambda y, g: y + np.array([18.0, -16.0, 18.0]),
    "far": lambda y, g: y + np.array([500.0, 0.0, 0.0]),
    "swapped": lambda y, g: y[:, [1, 0, 2]],
    "others": lambda y, g: np.roll(y, 1, axis=0),
}


def spoilt_rows(share: float, run: bool, g: np.random.Generator) -> np.ndarray:
    count = round(share * N)
    return np.arange(30, 30 + count) if run else np.sort(g.choice(N, count, replace=False))


@pytest.mark.parametrize("share", [0.03, 0.06, 0.15, 0.3])
@pytest.mark.parametrize("run", [False, True], ids=["anywhere", "a run"])
@pytest.mark.parametrize("kind", SPOILT)
def test_rows_that_cannot_be_right_are_told_from_the_others(kind, run, share):
    g = np.random.default_rng(int(1000 * share))
    q, y = measured()
    bad = spoilt_rows(share, run, g)
    y[bad] = SPOILT[kind](y[bad], g)
    data = written(q, y)
    assert np.flatnonzero(~data.usable).tolist() == bad.tolist()
    told = " ".join(d.message for d in data.diagnostics if d.code == "DAT007")
    named = re.findall(r"(\d+)(?: to (\d+))?", told.partition("): rows ")[2]) if len(bad) > 6 else []
    assert not named or {k for a, b in named for k in range(int(a), int(b or a) + 1)} == set((bad + 1).tolist())


@pytest.mark.parametrize("factor", [25.4, 1000.0], ids=["inches", "metres"])
@pytest.mark.parametrize("share", [0.03, 0.1, 0.3])
def test_rows_in_another_unit_are_left_out_or_named(factor, share):
    q, y = measured()
    bad = spoilt_rows(share, False, np.random.default_rng(3))
    y[bad] /= factor
    if share < 0.05:
        assert np.flatnonzero(~written(q, y).usable).tolist() == bad.tolist()
        return
    (found,) = refused(lambda: written(q, y))
    named = re.findall(r"(\d+)(?: to (\d+))?", found.message.partition("; rows ")[2])
    assert {k for a, b in named for k in range(int(a), int(b or a) + 1)} == set((bad + 1).tolist())


@pytest.mark.parametrize("seed", range(1, 7))
def test_no_row_of_a_table_that_is_right_is_doubted(seed):
    q, y = measured(seed)
    data = written(q, y)
    assert data.usable.all() and not data.wrong


def test_joint_zeros_that_are_far_off_are_no_wrong_rows():
    q = np.round(poses(N, 4), 5)
    data = written(q, points(q + np.array([0.0, 1.2, -0.8, 0.0, 0.0, 0.0])))
    assert not data.wrong


def test_too_many_wrong_rows_are_an_error_that_names_them():
    q, y = measured()
    bad = spoilt_rows(0.4, True, np.random.default_rng(0))
    y[bad] = rotated(y[bad], np.random.default_rng(0))
    (found,) = refused(lambda: written(q, y))
    assert found.code == "DAT009" and f"rows {bad[0] + 1} to {bad[-1] + 1}" in found.message


def test_sessions_are_placed_each_by_itself():
    """The instrument was moved for `b`; that is no error, and a wrong row of it is told from its own place."""
    q, y = measured()
    session = ["a"] * 70 + ["b"] * 50
    y[70:] = rotated(y[70:], np.random.default_rng(0)) + np.array([1000.0, 0.0, 0.0])
    assert not written(q, y, session).wrong
    y[[75, 90, 91]] += [0.0, 60.0, 0.0]
    assert {row for _, row in written(q, y, session).wrong} == {76, 91, 92}


def test_a_session_of_mostly_wrong_rows_is_named():
    q, y = measured()
    session = ["monday"] * 90 + ["friday"] * 30
    g = np.random.default_rng(2)
    y[95:120] += g.normal(0, 300, (25, 3))
    with pytest.raises(PostprocError, match=r"session `friday`, too many rows .* rows 91 to 120"):
        written(q, y, session)


def test_a_user_who_knows_better_keeps_the_rows():
    q, y = measured()
    y[:20] = rotated(y[:20], np.random.default_rng(0))
    assert len(written(q, y).wrong) == 20
    assert not written(q, y, accept=frozenset({"DAT007"})).wrong


def seen_from_anywhere(count: int, size: int) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Angles [deg], points [mm] and sessions of ``size`` poses each, every one seen from another place."""
    g = np.random.default_rng(4)
    q, y = measured(n=count * size)
    session = np.repeat(np.arange(count), size)
    for s in range(count):
        R = Rotation.from_rotvec(g.normal(0, 1, 3)).as_matrix()
        y[session == s] = y[session == s] @ R.T + g.normal(0, 3000, 3)
    return q, y, [f"s{s}" for s in session]


@pytest.mark.parametrize("size", [2, 3, 4])
def test_sessions_of_few_poses_from_several_places_are_named_as_the_cause(size):
    """Six unknowns of each place want more than the few numbers of its rows: nothing is said of the arm."""
    (found,) = refused(lambda: written(*seen_from_anywhere(60 // size, size)))
    assert found.code == "DAT009"
    assert f"no session has more than {size} poses" in found.message and "not all seen from one place" in found.message
    assert "8 poses or more from each place" in found.help


def test_sessions_of_two_poses_from_one_place_are_one_in_the_search_for_wrong_rows():
    q, y = measured()
    y[[20, 50, 51]] += [0.0, 60.0, 0.0]
    assert {row for _, row in written(q, y, [f"s{i // 2}" for i in range(N)]).wrong} == {21, 51, 52}


def test_columns_are_read_anew_in_the_largest_of_sessions_from_several_places():
    """The rows together fit no place whatever the columns mean; those of one session do."""
    q, y, session = seen_from_anywhere(3, 40)
    q[:, 3] *= -1
    with pytest.raises(PostprocError, match="`q4_deg` looks negated"):
        written(q, y, session)


@pytest.mark.parametrize("n", [12, N])
def test_a_point_at_the_origin_of_the_instrument_is_measured_where_the_arm_stood_there(n):
    """An instrument's frame that was set up on a point of the arm has that point at 0, 0, 0, exactly."""
    q, y = measured(n=n)
    y -= y[3]
    data = written(q, y)
    assert data.usable.all() and not data.diagnostics


@pytest.mark.parametrize(("n", "count"), [(12, 2), (N, 1), (N, 30), (N, 90)])
def test_zeros_where_the_arm_did_not_stand_are_a_lost_beam(n, count):
    q, y = measured(n=n)
    bad = np.sort(np.random.default_rng(2).choice(n, count, replace=False))
    y[bad] = 0.0
    data = written(q, y)
    assert np.flatnonzero(~data.usable).tolist() == bad.tolist()
    (found,) = (d for d in data.diagnostics if "lost its beam" in d.message)
    assert found.code == "DAT005" and f"in {count} of {n} rows" in found.message
