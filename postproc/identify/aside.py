"""Rows that the fit left out: errors of measurement, or the very poses that show what is missing."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.identify.channels import channels, shown
from postproc.identify.fitted import Fit
from postproc.identify.suspects import Suspect

WHOLE = 0.97
"""Cosine that every pose must reach: three errors without a reason do so for one of six joints once in 6000 cases."""

FEWEST = 3
"""Poses left out from which on they may be more than bad readings."""


def suspects_aside(fit: Fit, most: int = 3) -> list[Suspect]:
    """What the rows left out have in common, where all of them are off as if the same joint had turned; else nothing.

    A turn of joint j moves the point along its column J_j of the Jacobian, a typing error along any direction, which
    reaches the cosine c to J_j in k poses with the probability (1 - c)^k. The channels follow whose range over these
    poses holds the smallest share of all poses.
    """
    rows = _one_a_pose(fit)
    if len(rows) < FEWEST:
        return []
    off = fit.problem.error[rows, :3]
    turned = fit.problem.sensitivity.matrix[rows, :3, :6]
    size = np.linalg.norm(off, axis=1)[:, None] * np.linalg.norm(turned, axis=1)
    cosine = np.minimum(np.abs(np.einsum("kx,kxj->kj", off, turned)) / np.maximum(size, 1e-300), 1.0)
    j = int(np.argmax(cosine.min(axis=0)))
    if cosine[:, j].min() < WHOLE:
        return []
    share = float(np.average(cosine[:, j] ** 2, weights=np.sum(off**2, axis=1)))
    state = fit.problem.sensitivity.state
    found: list[tuple[float, Suspect]] = []
    nothing = np.zeros((1, 1, 0))
    for name, values in channels(state, fit.problem.rest.T_base_tcp[:, :3, 3]).items():
        low, high = float(values[rows].min()), float(values[rows].max())
        held = float(np.mean((values >= low) & (values <= high)))
        # Of two channels that single these poses out, that of the joint itself is the likelier.
        order = held if name.endswith(str(j + 1)) else 2 * held
        text = f"the rows left out, between {shown(name, low)} and {shown(name, high)}"
        found.append((order, Suspect(name, f"joint {j + 1}", text, share, 0.0, 0.0, nothing, nothing[0, 0])))
    found.sort(key=lambda item: item[0])
    return [suspect for _, suspect in found[:most]]


def _one_a_pose(fit: Fit) -> Array:
    """Rows left out whose position was measured, one for each pose: repeats are no further evidence."""
    rows = np.array(fit.set_aside, dtype=int)
    rows = rows[np.isfinite(fit.problem.error[rows, :3]).all(axis=1)]
    _, first = np.unique(fit.data.repeats[rows], return_index=True)
    return np.asarray(rows[first])
