"""What a fall of the sum of squares says for the parameters that brought it: their log evidence, and a p value."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array

CLOSE_EVIDENCE = 2 * float(np.log(50))
"""Log evidence by which one explanation must lead to be distinguished from another: odds of 50 to 1."""
DECADES = (0.1, 1.0, 10.0, 100.0)
"""A size that is not known beforehand is taken at each of these times what is ordinary: its prior is flat over them."""
ROUNDING_SHARE = 1e-12
"""Share of the sum of squares below which it counts as null: the rest is rounding."""


def log_evidence(before: float, after: Array | float, freedom: float, information: Array) -> Array:
    """Return 2 log of the odds for parameters against none: nu log(S / S') - log det(I + F), the noise being unknown.

    This is Laplace's approximation of the marginal likelihood; it is -inf where there are as many parameters as
    measured numbers. F is the information of the data on the parameters relative to their prior, W C^T M C W / s^2, for
    columns C, M the projection that removes other parameters, and W the prior standard deviations. Sources: MacKay
    (2003), Ch. 27; O'Hagan and Forster (2004), Ch. 11.

    Args:
        before: S, the sum of squares without the parameters.
        after: (..,) S', the sum of squares with them plus the squares of their deviations from the prior.
        freedom: nu, the number of independent measured numbers less the other fitted parameters.
        information: (.., m) eigenvalues of F, one for each of the m parameters.

    Returns:
        (..,) log evidence, one for each value of ``after``.
    """
    if information.shape[-1] > freedom - 1:
        return np.full(np.shape(after), -np.inf)
    gained = freedom * np.log(before / np.maximum(after, ROUNDING_SHARE * before))
    return np.asarray(gained - np.sum(np.log1p(information), axis=-1))


def schwarz(before: float, after: Array | float, count: int, freedom: float) -> Array:
    """Return the log evidence of ``count`` parameters of unknown size: nu log(S / S') - m log(nu), Schwarz's criterion.

    Their prior says as much as one number of the data (unit information, Kass and Wasserman 1995).

    Args:
        before, after, freedom: as in `log_evidence`; count: m, the number of parameters.

    Returns:
        (..,) log evidence, one for each value of ``after``.
    """
    return log_evidence(before, after, freedom, np.full(count, freedom - 1.0))


def f_test(before: float, after: float, added: int, freedom: float, price: float = 0.0) -> float:
    """Return the p value of the fall of a sum of squares by ``added`` parameters; 1 where it did not fall.

    Args:
        before, after: the sums of squares without and with the parameters.
        freedom: remaining degrees of freedom with them.
        price: 2 log of the prior odds against these parameters among all that were tried; the p value is multiplied by
            exp(price / 2).
    """
    from scipy.special import betainc

    if added == 0 or freedom <= 0 or before <= after:
        return 1.0
    if after <= 0:
        return 0.0
    # P(F > f) = I_x(freedom/2, added/2), x = freedom / (freedom + added f); exact in the far tail, unlike 1 - cdf.
    p = float(betainc(freedom / 2, added / 2, after / before))
    return float(np.exp(min(0.0, np.log(p) + price / 2))) if p > 0 else 0.0
