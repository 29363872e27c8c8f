"""What a fall of the sum of squares is worth, for the parameters that brought it."""

from __future__ import annotations

import numpy as np


def f_test(before: float, after: float, added: int, freedom: float) -> float:
    """P value of the fall of a sum of squares by ``added`` parameters, ``freedom`` degrees of freedom left after."""
    from scipy.special import betainc

    if added == 0 or freedom <= 0 or before <= after:
        return 1.0
    if after <= 0:
        return 0.0
    # P(F > f) = I_x(freedom/2, added/2), x = freedom / (freedom + added f); exact in the far tail, unlike 1 - cdf.
    return float(betainc(freedom / 2, added / 2, after / before))


def schwarz(before: float, fall: float, count: int, freedom: float, tried: float) -> float:
    """Nu log(S / (S - fall)) - m log(nu) - 2 log(tried).

    The same for parameters whose ordinary size nobody knows, Schwarz (1978).
    """
    if count == 0 or freedom - count < 1:
        return -np.inf
    after = max(before - fall, 1e-12 * before)
    return float(freedom * np.log(before / after) - count * np.log(freedom) - 2 * np.log(tried))
