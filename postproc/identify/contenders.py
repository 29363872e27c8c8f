"""Names that hang on which poses were measured: what is worth more than the named effect on a part of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.fit.fitted import Fit
from postproc.identify.candidates.candidate import Candidate
from postproc.identify.candidates.composition import columns_of

PARTS, SHARE = 20, 0.7
"""Random parts of the poses that are asked, and how many poses each has."""
MOST = 8
"""Rivals that are asked, the best by evidence first."""


def contenders(ranking: Sequence[Candidate], chosen: Candidate, before: Fit) -> list[str]:
    """Effects that are worth more than the chosen one on one random part of the poses in twenty at least.

    Evidence counts on rows that are independent of each other beside the model. Where the model misses more than noise,
    a difference of evidence says less than it seems, and other poses would have named another effect: what resampling
    does not settle, the data does not tell (stability selection: Meinshausen and Buehlmann 2010). On a part, the gain
    nu log(S / S') is counted anew, and what an effect pays stays as it is.

    Args:
        ranking, before: every effect on the fit without the chosen one.
    """
    rivals = [c for c in ranking if c.key != chosen.key and c.evidence > 0 and c.effect.roughness() is None][:MOST]
    if not rivals:
        return []
    asked = [next((c for c in ranking if c.key == chosen.key), chosen), *rivals]
    linear, groups = before.linear, before.data.repeats[before.linear.row]
    columns = [columns_of(before.problem, c.effect, c.free) for c in asked]

    def gains(kept: NDArray[np.bool_]) -> Array:
        """(c,) what each brings on some of the rows."""
        basis, y = np.linalg.qr(linear.nuisance[kept])[0], linear.residual[kept]
        rest = y - basis @ (basis.T @ y)
        before, falls = float(rest @ rest), [_fall(some[kept], basis, rest) for some in columns]
        after = np.maximum(before - np.array(falls), 1e-12 * before)
        return np.asarray(np.mean(kept) * linear.freedom * np.log(before / after))

    paid = gains(np.ones(len(groups), dtype=bool)) - [c.evidence for c in asked]
    poses, random = np.unique(groups), np.random.default_rng(0)
    parts = [random.choice(poses, round(SHARE * len(poses)), replace=False) for _ in range(PARTS)]
    worth = np.array([gains(np.isin(groups, some)) - paid for some in parts])
    won = np.asarray((worth[:, 1:] > worth[:, :1]).any(axis=0))
    return [c.key for c, wins in zip(rivals, won, strict=True) if wins]


def _fall(columns: Array, basis: Array, rest: Array) -> float:
    """What columns take off the sum of squares beside a basis."""
    own = columns - basis @ (basis.T @ columns)
    length = np.linalg.norm(own, axis=0)
    unit = np.linalg.qr(own[:, length > 0] / length[length > 0])[0]
    return float(np.sum((unit.T @ rest) ** 2))
