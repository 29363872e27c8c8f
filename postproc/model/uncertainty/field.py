"""A smooth random function of the joint angles, and of load and sides: where rows say what a model may lack."""

from __future__ import annotations

import zlib
from base64 import b64decode, b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State

COORDINATES = (*(f"q{j + 1}" for j in range(6)), "payload", *(f"dir{j + 1}" for j in range(6)))
"""What the function may depend on: joint angles [rad], payload [kg], sides of approach (+1, -1, 0)."""
LEAST_NOISE = 1e-9
"""Variance of a row's error, at least: rows may be the same."""
ROW_STEP = 1e-3
"""Step of the written coordinates of rows, as a share of the length over which the function changes."""


@dataclass(frozen=True)
class Field:
    """A Gaussian process with mean 0 and variance 1, of which measured rows have told something.

    Its covariance is k(x, x') = exp(-sum_i (x_i - x'_i)^2 / 2 l_i^2), and rows tell its value with an error of variance
    r. Source: Rasmussen and Williams (2006), Sec. 2.2 and 5.1.

    Args:
        names: of its d coordinates, of `COORDINATES`; lengths: (d,) l, each in the unit of its coordinate.
        rows: (m, d) coordinates of measured rows; noise: r.
    """

    names: tuple[str, ...]
    lengths: Array
    rows: Array
    noise: float

    def covariance(self, first: Array, second: Array) -> Array:
        """Return the covariances (n, m) between coordinates (n, d) and (m, d)."""
        a, b = first / self.lengths, second / self.lengths
        square = np.sum(a**2, axis=1)[:, None] + np.sum(b**2, axis=1) - 2 * a @ b.T
        return np.asarray(np.exp(-0.5 * np.maximum(square, 0.0)))

    def posterior(self, rows: Array, x: Array) -> Array:
        """Return the covariance (n, n) at coordinates x (n, d) that is open once other rows (m, d) are known."""
        across = self.covariance(rows, x)
        inner = self.covariance(rows, rows) + max(self.noise, LEAST_NOISE) * np.eye(len(rows))
        return np.asarray(self.covariance(x, x) - across.T @ np.linalg.solve(inner, across))

    def known(self, state: State) -> Array:
        """Return the share (n,) of the variance that the rows tell at each state: 1 near them, 0 where none is near."""
        from scipy.linalg import solve_triangular

        across = self.covariance(self.rows, coordinates(state, self.names))
        solved = solve_triangular(self._factor, across, lower=True, check_finite=False)
        return np.asarray(np.minimum(np.sum(solved**2, axis=0), 1.0))

    @cached_property
    def _factor(self) -> Array:
        """(m, m) lower triangular factor of the covariance of what the rows tell."""
        inner = self.covariance(self.rows, self.rows)
        return np.asarray(np.linalg.cholesky(inner + max(self.noise, LEAST_NOISE) * np.eye(len(inner))))

    def table(self) -> dict[str, Any]:
        """Return the table [fit.field] of a model file: ``lengths`` by coordinate, ``noise``, and packed ``rows``."""
        steps = np.rint(self.rows / (ROW_STEP * self.lengths)).astype("<i4")
        packed = b64encode(zlib.compress(np.diff(steps, axis=0, prepend=0).astype("<i4").T.tobytes(), 9)).decode()
        lengths = {name: float(f"{x:.6g}") for name, x in zip(self.names, self.lengths, strict=True)}
        return {"lengths": lengths, "noise": float(f"{self.noise:.6g}"), "rows": packed}

    @classmethod
    def of_table(cls, table: Mapping[str, Any]) -> Field:
        """Return the field of a table [fit.field].

        Raises:
            ValueError: ``rows`` is not what `table` writes.
        """
        lengths = np.array(list(table["lengths"].values()), dtype=float)
        try:
            data = zlib.decompress(b64decode("".join(table["rows"].split()), validate=True))
            steps = np.frombuffer(data, "<i4").reshape(len(lengths), -1).T
        except (ValueError, zlib.error) as error:
            raise ValueError("the text is not that of rows with these lengths") from error
        return cls(
            tuple(table["lengths"]), lengths, np.cumsum(steps, axis=0) * (ROW_STEP * lengths), float(table["noise"])
        )


def coordinates(state: State, names: tuple[str, ...]) -> Array:
    """Return the coordinates (n, d) of states; a payload or a side that a state does not have counts as 0."""
    columns = {f"q{j + 1}": state.q[:, j] for j in range(6)}
    if state.payload_mass is not None:
        columns["payload"] = np.broadcast_to(state.payload_mass, (len(state),))
    if state.approach is not None:
        columns |= {f"dir{j + 1}": state.approach[:, j] for j in range(6)}
    nothing = np.zeros(len(state))
    return np.nan_to_num(np.column_stack([columns.get(name, nothing) for name in names]))
