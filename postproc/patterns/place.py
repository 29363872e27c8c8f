"""A place of the arm as the data sees it: what many patterns would take off the residual there."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.fit.linear import Linear
from postproc.fit.problem import Problem
from postproc.patterns.formula import Single


def taken_off(linear: Linear, columns: Array) -> tuple[Array, Array]:
    """The sum of squares of each row, and what columns take off it."""
    inside = linear.project(columns)
    fitted = inside @ np.linalg.lstsq(inside, linear.rest, rcond=1e-6)[0]
    square, after = (np.bincount(linear.row, x**2).astype(float) for x in (linear.rest, linear.rest - fitted))
    return square, square - after


def with_and_without_a_row(linear: Linear, columns: Array) -> tuple[tuple[float, float], tuple[float, float]]:
    """Sum of squares and what columns take off it, and both without the row that gains most: one reading is no law."""
    square, taken = taken_off(linear, columns)
    most = int(np.argmax(taken))
    whole = float(square.sum()), float(taken.sum())
    return whole, (whole[0] - float(square[most]), whole[1] - float(taken[most]))


class Place:
    """A place as the data sees it once the fitted parameters are projected out.

    A pattern has one value a pose, so that all products are summed over the numbers of a pose first.
    """

    def __init__(self, problem: Problem, linear: Linear, place: Array) -> None:
        """place: (N, m) whitened columns."""
        self.linear, self.place = linear, place
        starts = np.flatnonzero(np.diff(problem.row, prepend=-1))
        self.pose = problem.row[starts]
        self.count = place.shape[1]
        size = len(problem.row) // len(self.pose)
        even = len(problem.row) == size * len(self.pose) and bool((np.diff(starts) == size).all())

        def by_pose(x: Array) -> Array:
            # Ten times as fast as `reduceat` where all poses have as many numbers.
            if even:
                return np.asarray(x.reshape(len(self.pose), size, *x.shape[1:]).sum(axis=1))
            return np.add.reduceat(x, starts, axis=0)

        whole = np.hstack([by_pose(linear.nuisance * place[:, i, None]) for i in range(self.count)])
        square = by_pose(place[:, :, None] * place[:, None, :]).reshape(len(self.pose), -1)
        self.nuisance: Single = whole.T.astype(np.float32)
        self.square: Single = square.T.astype(np.float32)
        self.rest: Single = by_pose(linear.rest[:, None] * place).T.astype(np.float32)

    def falls(self, values: Single) -> Array:
        """Fall of the sum of squares by the place times each pattern, (P,), for (n, P) values."""
        P, m = values.shape[1], self.count
        fall = np.zeros(P)
        chunk = max(1, int(2e7 / max(1, len(self.pose) * m)))
        for at in range(0, P, chunk):
            b = values[:, at : at + chunk]
            b = b if len(self.pose) == len(values) else b[self.pose]
            inside = (self.nuisance @ b).T.reshape(b.shape[1], m, -1)
            gram = (self.square @ (b * b)).T.reshape(-1, m, m).astype(float)
            along = (self.rest @ b).T.astype(float)
            scale = np.einsum("cii->c", gram).copy()
            gram -= inside @ np.swapaxes(inside, 1, 2)
            alive = np.einsum("cii->c", gram) > 1e-5 * scale
            gram += 1e-6 * np.where(scale > 0, scale, 1.0)[:, None, None] * np.eye(m)
            solved = np.linalg.solve(gram, along[:, :, None])[:, :, 0]
            fall[at : at + chunk] = np.where(alive, np.einsum("ci,ci->c", along, solved), 0.0)
        return fall
