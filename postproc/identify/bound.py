"""How far any function of the channels could bring the held-out error."""

from __future__ import annotations

import numpy as np

from postproc.identify.fit import Fit
from postproc.identify.suspects import Pattern


def nonparametric_bound(fit: Fit, every: list[Pattern]) -> float:
    return float(fit.held_out_rms) if every is not None else float(np.inf)
