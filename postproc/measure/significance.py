"""When chance is ruled out: the levels of significance, and how likely one variance exceeds another by chance."""

from __future__ import annotations

CHANCE = 1e-3
"""Chance of a false alarm, after counting all that was tried, in whatever is said of a table or of an arm."""
DOUBTFUL_CHANCE = 1e-2
"""Chance below which an assumption that costs nothing to drop is dropped: that a stated noise is right."""


def chance_of_excess(ratio: float, dof: float, than: float) -> float:
    """Return the chance that one variance exceeds another, of the same normal numbers, so many times (F test).

    Args:
        dof, than: degrees of freedom of the one and of the other, infinite for a variance that is known.
    """
    from scipy.special import fdtrc

    return float(fdtrc(dof, min(than, 1e6), ratio))
