"""A place of the arm as the data sees it: what many curves would take off the residual there."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.estimation.evidence import schwarz
from postproc.estimation.linear import Linear
from postproc.identification.curves.form import Single

CHUNK = 2048
"""CurveForms whose products stay in the processor's cache."""


def excess_over_noise(linear: Linear) -> float:
    """Return by how much the whitened sum of squares exceeds what noise alone leaves, at least a tenth of the whole."""
    return max(linear.square - (len(linear.residual) - linear.parameters), 0.1 * linear.square)


def taken_off(linear: Linear, columns: Array) -> tuple[Array, Array]:
    """Return the sum of squares of each measured row, and by how much fitting some columns lowers it, both (rows,).

    Args:
        linear: the fit so far; columns: (N, m) whitened; the fitted parameters are projected out of them first.
    """
    inside = linear.project(columns)
    fitted = inside @ np.linalg.lstsq(inside, linear.projected_residual, rcond=1e-6)[0]
    residual = linear.projected_residual
    square, after = (np.bincount(linear.row, x**2).astype(float) for x in (residual, residual - fitted))
    return square, square - after


def with_and_without_a_row(linear: Linear, columns: Array) -> tuple[float, float]:
    """Return the log evidence of some columns by Schwarz's criterion: of all rows, and without the row that gains most.

    What only one reading supports has no evidence without it.

    Args:
        linear: the fit so far; columns: (N, m) whitened.
    """
    square, taken = taken_off(linear, columns)
    others = np.arange(len(square)) != np.argmax(taken)
    all_rows, less = (
        float(schwarz(square[some].sum(), (square - taken)[some].sum(), columns.shape[1], linear.freedom))
        for some in (np.full(len(square), True), others)
    )
    return all_rows, less


def explained(gram: Array, along: Array, least: Array) -> Array:
    """Return (P,) b^T (G + least I)^-1 b of P small systems at once, by elimination; gram and along are overwritten.

    Args:
        gram: (m, m, P) matrices G, of which the upper triangle is read; along: (m, P) vectors b.
        least: (P,) added to the diagonal.
    """
    total = np.zeros(along.shape[1])
    for i in range(len(along)):
        pivot, row = gram[i, i] + least, gram[i, i + 1 :]
        total += along[i] ** 2 / pivot
        along[i + 1 :] -= row / pivot * along[i]
        gram[i + 1 :, i + 1 :] -= (row / pivot)[:, None] * row
    return total


class Place:
    """A place as the data sees it once the fitted parameters are projected out.

    A curve has one value a pose, so that all products are summed over the numbers of a pose first.
    """

    def __init__(self, linear: Linear, place: Array, precision: type = np.float32) -> None:
        """Sum the products of the place's columns, residual and fitted columns over the numbers of each row.

        Args:
            linear: the fit at its present parameters; place: (N, m) whitened derivatives by the place's m moves.
            precision: of the curves: single precision is twice as fast for many of them.
        """
        self.place = place
        self.pose = np.unique(linear.row)
        self.count = place.shape[1]
        self.pairs = [(i, j) for i in range(self.count) for j in range(i, self.count)]
        both = linear.by_row(place, place)
        self.square = np.array([both[:, i, j] for i, j in self.pairs])
        self.squared: Single | Array = self.square.astype(precision)
        inside = linear.by_row(linear.nuisance, place).transpose(2, 1, 0)  # (m, k, n) with the fitted columns
        self.linear, self.residual = linear, linear.by_row(linear.projected_residual[:, None], place)[:, 0].T
        self.straight: Single | Array = np.vstack([*inside, self.residual]).astype(
            precision
        )  # what a curve is multiplied with

    def falls(self, values: Single | Array) -> Array:
        """Return (P,) falls of the sum of squares when the place moves by each of P curves with sizes that fit best.

        It is b^T G^-1 b, G = C^T M C and b = C^T M y for the columns C of a curve; M projects out the fitted
        parameters.

        Args:
            values: (n, P) value of each curve in every row.
        """
        P, m = values.shape[1], self.count
        falls = np.zeros(P)
        for at in range(0, P, CHUNK):
            b = values[:, at : at + CHUNK]
            b = b[self.pose] if len(self.pose) < len(values) else b
            products = self.straight @ b
            inside, along = products[:-m].reshape(m, -1, b.shape[1]), products[-m:].astype(float)
            alone = (self.squared @ b**2).astype(float)
            gram = np.zeros((m, m, b.shape[1]))
            for (i, j), square in zip(self.pairs, alone, strict=True):
                gram[i, j] = square - np.einsum("kc,kc->c", inside[i], inside[j])
            scale = alone[[i == j for i, j in self.pairs]].sum(axis=0)
            alive = np.einsum("iic->c", gram) > 1e-5 * scale
            fall = explained(gram, along, 1e-6 * np.where(scale > 0, scale, 1.0))
            falls[at : at + CHUNK] = np.where(alive, fall, 0.0)
        return falls
