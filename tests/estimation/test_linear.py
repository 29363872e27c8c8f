"""The linear algebra behind screening and hold-out, against doing it the long way."""

import numpy as np
import pytest
from scipy import stats

from postproc.estimation import linear as module
from postproc.estimation.evidence import f_test
from postproc.estimation.held_out import contiguous_blocks, hold_out, neighbouring_blocks, standardised
from postproc.estimation.independent import independent_share, serial_share
from postproc.estimation.linear import Linear, basis_of
from postproc.identification.screen.gain import gain


def problem(seed=1, rows=60, columns=7):
    g = np.random.default_rng(seed)
    A, y = g.normal(size=(rows, columns)), g.normal(size=rows)
    return A, y, Linear(y, np.linalg.qr(A)[0], np.arange(rows))


def test_hold_out_equals_refitting_without_each_block():
    A, y, linear = problem()
    blocks = np.arange(60) // 6
    for block in range(10):
        inside = blocks == block
        x, *_ = np.linalg.lstsq(A[~inside], y[~inside], rcond=None)
        np.testing.assert_allclose(hold_out(y, linear.nuisance, blocks)[inside], y[inside] - A[inside] @ x, atol=1e-10)


def test_held_out_residuals_are_divided_by_what_the_other_rows_leave_open():
    A, y, linear = problem()
    blocks = np.arange(60) // 6
    found = standardised(y, linear.nuisance, blocks)
    for block in range(10):
        inside = blocks == block
        others = A[~inside]
        x = np.linalg.solve(others.T @ others, others.T @ y[~inside])
        variance = 1 + np.einsum("np,pq,nq->n", A[inside], np.linalg.inv(others.T @ others), A[inside])
        np.testing.assert_allclose(found[inside], (y[inside] - A[inside] @ x) / np.sqrt(variance), atol=1e-9)


def test_extending_equals_fitting_all_columns():
    A, y, linear = problem()
    more = np.random.default_rng(2).normal(size=(60, 3))
    both = np.hstack([A, more])
    x, *_ = np.linalg.lstsq(both, y, rcond=None)
    np.testing.assert_allclose(linear.extended(more).projected_residual, y - both @ x, atol=1e-10)
    assert linear.extended(A[:, :2]).nuisance.shape[1] == 7


def test_directions_that_repeat_others_do_not_count():
    A, _, linear = problem()
    columns = np.random.default_rng(3).normal(size=(60, 2))
    doubled = np.hstack([columns, columns[:, :1] + columns[:, 1:], A[:, :1]])
    longer = linear.extended(doubled)
    assert longer.nuisance.shape[1] == 9
    np.testing.assert_allclose(longer.projected_residual, linear.extended(columns).projected_residual, atol=1e-9)


def test_extending_a_penalised_problem_equals_solving_it_whole():
    A, y, _ = problem()
    w = np.array([0, 0, 1.0, 2.0, 3.0, 0.5, 0.1])
    more = np.random.default_rng(2).normal(size=(60, 3))
    both, weights = np.hstack([A, more]), np.concatenate([w, np.zeros(3)])
    x = np.linalg.solve(both.T @ both + np.diag(weights**2), both.T @ y)
    longer = Linear(y, basis_of(A, w), np.arange(60)).extended(more)
    np.testing.assert_allclose(longer.projected_residual, y - both @ x, atol=1e-9)
    left = y - both @ x
    np.testing.assert_allclose(longer.square, left @ left + np.sum((weights * x) ** 2), atol=1e-9)


def test_f_test_against_the_table():
    statistic = ((10.0 - 7.0) / 3) / (7.0 / 50)
    np.testing.assert_allclose(f_test(10.0, 7.0, 3, 50), stats.f.sf(statistic, 3, 50), rtol=1e-10)
    assert 0.0 < f_test(1e2, 1.0, 3, 200) < 1e-150


def test_blocks_are_contiguous_and_keep_repeats_together():
    groups = np.repeat(np.arange(25), 3)
    blocks = contiguous_blocks(groups)
    assert (np.diff(blocks) >= 0).all() and len(np.unique(blocks)) == 10
    assert all(len(set(blocks[groups == k])) == 1 for k in range(25))


def test_neighbouring_blocks_are_cells_of_the_joint_space():
    g = np.random.default_rng(5)
    places = np.zeros((40, 6))
    places[:, :2] = [3.0, 1.0] * g.uniform(-1, 1, (40, 2))
    order = g.permutation(np.repeat(np.arange(40), 3))
    # Repeats of a pose differ by what the encoders tell.
    blocks = neighbouring_blocks(order, places[order] + g.normal(0, 1e-6, (120, 6)))
    assert all(len(set(blocks[order == k])) == 1 for k in range(40))
    each = np.array([blocks[order == k][0] for k in range(40)])
    assert np.bincount(each).tolist().count(0) == 0 and len(set(each)) == 10 and np.ptp(np.bincount(each)) <= 3
    # No pose of another block lies inside the box that one spans.
    for k in range(10):
        low, high = places[each == k].min(axis=0), places[each == k].max(axis=0)
        assert not ((places >= low) & (places <= high)).all(axis=1)[each != k].any()
    assert set(neighbouring_blocks(np.zeros(5, dtype=int), np.zeros((5, 6)))) == {0}


def test_a_penalised_basis_gives_the_penalised_fit_and_its_hold_out():
    A, y, _ = problem()
    w = np.array([0, 0, 1.0, 2.0, 3.0, 0.5, 0.1])
    hat = A @ np.linalg.solve(A.T @ A + np.diag(w**2), A.T)
    for many in (150, 3):  # QR, and the normal equations
        module.MANY_COLUMNS, before = many, module.MANY_COLUMNS
        U = module.basis_of(A, w)
        module.MANY_COLUMNS = before
        np.testing.assert_allclose(U @ U.T, hat, atol=1e-10)
    blocks = np.arange(60) // 6
    inside = blocks == 4
    rest = A[~inside]
    x = np.linalg.solve(rest.T @ rest + np.diag(w**2), rest.T @ y[~inside])
    out = hold_out(y, U, blocks)
    np.testing.assert_allclose(out[inside], y[inside] - A[inside] @ x, atol=1e-10)


def test_what_the_fitted_parameters_do_as_well_brings_nothing():
    A, y, linear = problem()
    again = A[:, :2] @ np.array([[1.0, 2.0], [0.5, -1.0]])
    assert gain(linear, again).count == 0
    fresh = np.random.default_rng(2).normal(size=(60, 3))
    both = np.hstack([fresh, fresh[:, :1] - fresh[:, 2:]])
    found = gain(linear, both)
    left = y - np.hstack([A, fresh]) @ np.linalg.lstsq(np.hstack([A, fresh]), y, rcond=None)[0]
    assert found.count == 3
    np.testing.assert_allclose(found.fall, linear.square - left @ left, rtol=1e-9)


def test_noise_counts_every_number_and_a_joint_that_moves_by_itself_one_a_pose():
    rng = np.random.default_rng(3)
    row, turns = np.repeat(np.arange(2000), 3), rng.normal(size=(6000, 6))
    noise = rng.normal(size=6000)
    assert independent_share(noise, turns, row) == pytest.approx(1.0, abs=0.02)
    jumping = turns[:, 2] * rng.normal(size=2000)[row]
    assert independent_share(jumping, turns, row) == pytest.approx(1 / 3)
    assert 1 / 3 < independent_share(jumping + noise, turns, row) < 1
    assert independent_share(noise[:2000], turns[:2000], np.arange(2000)) == 1.0


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_rows_of_a_record_count_by_how_much_of_each_is_new(rho):
    """The mean of AR(1) noise scatters (1 + rho) / (1 - rho) times as much as that of independent rows."""
    g = np.random.default_rng(8)
    x = np.empty((4000, 3))
    x[0] = g.normal(size=3)
    for i in range(1, len(x)):
        x[i] = rho * x[i - 1] + np.sqrt(1 - rho**2) * g.normal(size=3)
    assert serial_share(x) == pytest.approx((1 - rho) / (1 + rho), rel=0.15)
