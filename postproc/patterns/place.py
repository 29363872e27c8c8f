"""A place of the arm as the data sees it: what many patterns would take off the residual there."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.estimation.linear import Linear
from postproc.patterns.formula import Single

CHUNK = 2048
"""Patterns whose products stay in the processor's cache."""


def above(linear: Linear) -> float:
    """What is left above the noise, of the whitened sum of squares."""
    return max(linear.square - (len(linear.residual) - linear.parameters), 0.1 * linear.square)


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


def explained(gram: Array, along: Array, least: Array) -> Array:
    """(P,) b^T (G + least)^-1 b of many small systems at once, by elimination: both are used up.

    Args:
        gram: (m, m, P), its upper triangle; along: (m, P); least: (P,) added to the diagonal.
    """
    found = np.zeros(along.shape[1])
    for i in range(len(along)):
        pivot, row = gram[i, i] + least, gram[i, i + 1 :]
        found += along[i] ** 2 / pivot
        along[i + 1 :] -= row / pivot * along[i]
        gram[i + 1 :, i + 1 :] -= (row / pivot)[:, None] * row
    return found


class Place:
    """A place as the data sees it once the fitted parameters are projected out.

    A pattern has one value a pose, so that all products are summed over the numbers of a pose first.
    """

    def __init__(self, linear: Linear, place: Array) -> None:
        """place: (N, m) whitened columns."""
        self.place = place
        self.pose = np.unique(linear.row)
        self.count = place.shape[1]
        self.pairs = [(i, j) for i in range(self.count) for j in range(i, self.count)]
        both = linear.by_row(place, place)
        self.square = np.array([both[:, i, j] for i, j in self.pairs])
        self.squared: Single = self.square.astype(np.float32)
        inside = linear.by_row(linear.nuisance, place).transpose(2, 1, 0)  # (m, k, n) with the fitted columns
        self.linear, self.rest = linear, linear.by_row(linear.rest[:, None], place)[:, 0].T
        # What a pattern is multiplied with, in single precision, which is twice as fast for many of them.
        self.straight: Single = np.vstack([*inside, self.rest]).astype(np.float32)

    def falls(self, values: Single) -> Array:
        """Fall of the sum of squares by the place times each pattern, (P,), for (n, P) values.

        It is b^T G^-1 b with G = C^T M C and b = C^T M y of the columns C of each.
        """
        P, m = values.shape[1], self.count
        falls = np.zeros(P)
        for at in range(0, P, CHUNK):
            b = values[:, at : at + CHUNK]
            b = b[self.pose] if len(self.pose) < len(values) else b
            found = self.straight @ b
            inside, along = found[:-m].reshape(m, -1, b.shape[1]), found[-m:].astype(float)
            alone = (self.squared @ b**2).astype(float)
            gram = np.zeros((m, m, b.shape[1]))
            for (i, j), square in zip(self.pairs, alone, strict=True):
                gram[i, j] = square - np.einsum("kc,kc->c", inside[i], inside[j])
            scale = alone[[i == j for i, j in self.pairs]].sum(axis=0)
            alive = np.einsum("iic->c", gram) > 1e-5 * scale
            fall = explained(gram, along, 1e-6 * np.where(scale > 0, scale, 1.0))
            falls[at : at + CHUNK] = np.where(alive, fall, 0.0)
        return falls
