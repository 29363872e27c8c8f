"""The numbers behind a fit against doing it the long way: plain least squares, integrals, a general minimiser."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import stats
from scipy.integrate import quad

from postproc.estimation.evidence import f_test
from postproc.estimation.fitted import excess_variance
from postproc.estimation.held_out import contiguous_blocks, hold_out, neighbouring_blocks, standardised
from postproc.estimation.independent import independent_share, serial_share
from postproc.estimation.linear import Linear, basis_of, solve_positive
from postproc.identification.screen.gain import gain

PENALTY = np.array([0, 0, 1.0, 2.0, 3.0, 0.5, 0.1])
BLOCKS = np.arange(60) // 6


def problem(rows: int = 60, columns: int = 7) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns of fitted parameters, a residual, and columns that may come in addition."""
    g = np.random.default_rng(1)
    return g.normal(size=(rows, columns)), g.normal(size=rows), np.random.default_rng(2).normal(size=(rows, 3))


def solved(A: np.ndarray, y: np.ndarray, w: np.ndarray | float = 0.0) -> np.ndarray:
    """Parameters of least squares with the penalty |w x|^2."""
    return np.linalg.solve(A.T @ A + np.diag(np.broadcast_to(w, A.shape[1]) ** 2), A.T @ y)


@pytest.mark.parametrize("rows", [60, 2000])  # a QR decomposition, and the normal equations of many columns
@pytest.mark.parametrize("w", [np.zeros(7), PENALTY])
def test_a_basis_gives_the_penalised_fit_and_what_it_leaves_of_rows_it_has_not_seen(w, rows):
    A, y, _ = problem(rows)
    A, w = (
        (A, w)
        if rows == 60
        else (np.hstack([A, np.random.default_rng(4).normal(size=(rows, 200))]), np.append(w, np.ones(200)))
    )
    U, blocks = basis_of(A, w), np.arange(rows) * 10 // rows
    inside = blocks == 4
    assert_allclose(U @ (U.T @ y), A @ solved(A, y, w), atol=1e-9)
    expected = y[inside] - A[inside] @ solved(A[~inside], y[~inside], w)
    assert_allclose(hold_out(y, U, blocks)[inside], expected, atol=1e-9)


def test_directions_that_a_penalty_holds_firmly_are_no_part_of_a_basis():
    """Of 400 columns of which each is held five times as firmly as one before it, few can move by a rounding error."""
    g = np.random.default_rng(6)
    A, w = g.normal(size=(900, 400)), 5.0 ** np.minimum(np.arange(400), 30)
    A[:, 5] *= 1e-6  # a number of another size, which nothing holds
    w[5] = 0.0
    U, y = basis_of(A, w), g.normal(size=900)
    inside = A / np.hypot(np.linalg.norm(A, axis=0), w)
    expected = (
        inside
        @ np.linalg.lstsq(
            np.vstack([inside, np.diag(w / np.hypot(np.linalg.norm(A, axis=0), w))]),
            np.append(y, np.zeros(400)),
            rcond=None,
        )[0]
    )
    assert U.shape[1] < 30
    assert_allclose(U @ (U.T @ y), expected, atol=1e-8)


def test_normal_equations_of_numbers_of_very_different_sizes_are_solved_also_where_they_are_singular():
    g = np.random.default_rng(7)
    A = g.normal(size=(40, 5)) * np.geomspace(1e-8, 1e8, 5)
    x = 1 / np.geomspace(1e-8, 1e8, 5)
    assert_allclose(solve_positive(A.T @ A, A.T @ (A @ x)), x, rtol=1e-6)
    twice = np.hstack([A, A[:, :1]])
    both = solve_positive(twice.T @ twice, twice.T @ (A @ x))
    assert_allclose(both, np.append(x, 0) - 0.5 * x[0] * np.array([1, 0, 0, 0, 0, -1]), rtol=1e-6)
    assert solve_positive(np.zeros((0, 0)), np.zeros((0, 3))).shape == (0, 3)


def test_held_out_residuals_are_divided_by_what_the_other_rows_leave_open():
    A, y, _ = problem()
    found = standardised(y, basis_of(A, np.zeros(7)), BLOCKS)
    for inside in (block == BLOCKS for block in range(10)):
        inverse = np.linalg.inv(A[~inside].T @ A[~inside])
        variance = 1 + np.einsum("np,pq,nq->n", A[inside], inverse, A[inside])
        expected = (y[inside] - A[inside] @ solved(A[~inside], y[~inside])) / np.sqrt(variance)
        assert_allclose(found[inside], expected, atol=1e-9)


@pytest.mark.parametrize("w", [np.zeros(7), PENALTY])
def test_extending_a_problem_equals_solving_it_with_all_columns(w):
    """Columns that repeat others, or what the fitted parameters do, do not count."""
    A, y, fresh = problem()
    again = np.hstack([fresh, fresh[:, :1] - fresh[:, 2:], A[:, :2] if not w.any() else fresh[:, :1]])
    x = solved(np.hstack([A, fresh]), y, np.append(w, np.zeros(3)))
    rest = y - np.hstack([A, fresh]) @ x
    first = Linear(y, basis_of(A, w), np.arange(60))
    longer = first.extended(again)
    assert longer.nuisance.shape[1] == first.nuisance.shape[1] + 3
    assert_allclose(longer.projected_residual, rest, atol=1e-9)
    assert_allclose(longer.square, rest @ rest + np.sum((w * x[:7]) ** 2), atol=1e-9)
    found = gain(first, again)
    assert found.count == 3 and found.rss_reduction == pytest.approx(first.square - longer.square)


def test_f_test_against_the_table():
    statistic = ((10.0 - 7.0) / 3) / (7.0 / 50)
    assert f_test(10.0, 7.0, 3, 50) == pytest.approx(stats.f.sf(statistic, 3, 50))
    assert 0.0 < f_test(1e2, 1.0, 3, 200) < 1e-150


def test_blocks_are_contiguous_and_keep_repeats_together():
    groups = np.repeat(np.arange(25), 3)
    blocks = contiguous_blocks(groups)
    assert (np.diff(blocks) >= 0).all() and len(np.unique(blocks)) == 10
    assert all(len(set(blocks[groups == k])) == 1 for k in range(25))


def test_neighbouring_blocks_are_cells_of_the_joint_space():
    g, places = np.random.default_rng(5), np.zeros((40, 6))
    places[:, :2] = [3.0, 1.0] * g.uniform(-1, 1, (40, 2))
    order = g.permutation(np.repeat(np.arange(40), 3))
    blocks = neighbouring_blocks(order, places[order] + g.normal(0, 1e-6, (120, 6)))  # repeats differ a little
    each = np.array([blocks[order == k][0] for k in range(40)])
    assert (blocks == each[order]).all()
    assert len(set(each)) == 10 and np.bincount(each).min() > 0 and np.ptp(np.bincount(each)) <= 3
    for k in range(10):  # no pose of another block lies inside the box that one spans
        low, high = places[each == k].min(axis=0), places[each == k].max(axis=0)
        assert not ((places >= low) & (places <= high)).all(axis=1)[each != k].any()
    assert set(neighbouring_blocks(np.zeros(5, dtype=int), np.zeros((5, 6)))) == {0}


def test_noise_counts_every_number_and_a_joint_that_moves_by_itself_one_a_pose():
    g, row = np.random.default_rng(3), np.repeat(np.arange(2000), 3)
    turns, noise = g.normal(size=(6000, 6)), g.normal(size=6000)
    jumping = turns[:, 2] * g.normal(size=2000)[row]
    assert independent_share(noise, turns, row) == pytest.approx(1.0, abs=0.02)
    assert independent_share(jumping, turns, row) == pytest.approx(1 / 3)
    assert 1 / 3 < independent_share(jumping + noise, turns, row) < 1
    assert independent_share(noise[:2000], turns[:2000], np.arange(2000)) == 1.0


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_rows_of_a_record_count_by_how_much_of_each_is_new(rho):
    """The mean of AR(1) noise scatters (1 + rho) / (1 - rho) times as much as that of independent rows."""
    g = np.random.default_rng(8)
    x = g.normal(size=(4000, 3))
    for i in range(1, len(x)):
        x[i] = rho * x[i - 1] + np.sqrt(1 - rho**2) * x[i]
    assert serial_share(x) == pytest.approx((1 - rho) / (1 + rho), rel=0.15)


@pytest.mark.parametrize(
    ("total", "dof"), [(0.3, 4.0), (0.9, 9.0), (1.0, 40.0), (2.3, 9.0), (4.0, 9.0), (1.1, 300.0), (25.0, 2.0)]
)
def test_the_excess_of_a_residual_is_the_mean_of_its_posterior(total, dof):
    """Likelihood of s^2 ~ v chi^2 / nu; v = n^2 with odds of 1 to h, else of the density n^2 / v^2 above n^2 = 1."""

    def likelihood(v: float) -> float:
        return float(np.exp(-0.5 * dof * (np.log(v) + total / v - np.log(max(total, 1.0)) - total / max(total, 1.0))))

    ends = [1.0, 1.0 + 3.0 / np.sqrt(dof), max(2.0, 2 * total), 50.0 * max(1.0, total), np.inf]
    parts = [
        [quad(lambda v, k=k: likelihood(v) * (v - 1.0) ** k / v**2, *e)[0] for k in (0, 1)] for e in pairwise(ends)
    ]
    zeroth, first = np.sum(parts, axis=0)
    expected = first / (likelihood(1.0) + zeroth)
    for noise in (1.0, 4e-10):
        assert excess_variance(noise * total, dof, noise, np.inf) == pytest.approx(noise * expected, rel=1e-5)


@pytest.mark.parametrize(
    ("total", "dof", "noise_dof", "low", "high"),
    [
        (2.0, 1e5, np.inf, 0.999, 1.001),  # many rows are the difference
        (1.0, 1e5, np.inf, 0.0, 1e-3),
        (1.0, 9.0, 20.0, 0.1, 0.6),  # and few are not nothing
        *((total, dof, 9.0, 0.0, 1.1e6) for total in (1e-6, 1e6) for dof in (1.0, 9.0, 3000.0)),
    ],
)
def test_the_excess_of_many_rows_is_the_difference_and_of_few_is_not_nothing(total, dof, noise_dof, low, high):
    assert low <= excess_variance(total, dof, 1.0, noise_dof) <= high


@pytest.mark.parametrize("dof", [9, 60])
@pytest.mark.parametrize("excess", [0.0, 0.5, 1.0, 3.0])
def test_intervals_of_fits_with_few_degrees_of_freedom_hold(dof, excess):
    """Linear fits of 14 parameters to rows with noise and excess; noise known by 20 repeats."""
    g, count, hits = np.random.default_rng(dof), 14, []
    for _ in range(120):
        A, x, y = g.normal(size=(dof + count, count)), g.normal(size=(20, count)), g.normal(size=dof + count)
        y *= np.hypot(1.0, excess)
        square = float(np.sum((y - A @ solved(A, y)) ** 2)) / dof
        variance = square * np.einsum("ij,jk,ik->i", x, np.linalg.inv(A.T @ A), x)
        variance += excess_variance(square, dof, g.chisquare(20) / 20, 20.0)
        hits.append(np.abs(x @ solved(A, y) - excess * g.normal(size=20)) < 1.96 * np.sqrt(variance))
    assert 0.87 < np.mean(hits) < 0.998
