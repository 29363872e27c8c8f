"""Rows that the fit left out: errors of measurement, or the very poses that show what is missing."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.identify.channels import channels, shown
from postproc.identify.fit import Fit
from postproc.identify.suspects import Suspect

CHANCE = 1e-3
"""That stray rows look as if one joint had turned: a typing error moves a point along any direction."""

WHOLE = 0.97
"""Cosine that every pose must reach: a turn of the joint leaves no more than noise beside it."""

FEWEST = 3
"""Poses left out from which on they may be more than bad readings."""


def suspects_aside(fit: Fit, most: int = 3) -> list[Suspect]:
    """What the rows left out have in common, where all of them are off as if the same joint had turned; else nothing.

    A turn of joint j moves the point along its column J_j of the Jacobian. That directions without a reason come this
    close to it in every pose has the probability 6 prod(1 - |cos(error, J_j)|). The channels follow whose range over
    these poses holds the smallest share of all poses.
    """
    rows = _one_a_pose(fit)
    if len(rows) < FEWEST:
        return []
    off = fit.problem.error[rows, :3]
    turned = fit.problem.sensitivity.matrix[rows, :3, :6]
    size = np.linalg.norm(off, axis=1)[:, None] * np.linalg.norm(turned, axis=1)
    cosine = np.minimum(np.abs(np.einsum("kx,kxj->kj", off, turned)) / np.maximum(size, 1e-300), 1.0)
    chance = 6 * np.prod(1 - cosine, axis=0)
    j = int(np.argmin(chance))
    if not chance[j] < CHANCE or cosine[:, j].min() < WHOLE:
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
        evidence = -2 * float(np.log(max(chance[j], 1e-300)))
        found.append((order, Suspect(name, f"joint {j + 1}", text, share, 0.0, evidence, nothing, nothing[0, 0])))
    found.sort(key=lambda item: item[0])
    return [suspect for _, suspect in found[:most]]


def _one_a_pose(fit: Fit) -> Array:
    """Rows left out whose position was measured, one for each pose: repeats are no further evidence."""
    rows = np.array(fit.set_aside, dtype=int)
    rows = rows[np.isfinite(fit.problem.error[rows, :3]).all(axis=1)]
    _, first = np.unique(fit.data.repeats[rows], return_index=True)
    return np.asarray(rows[first])
