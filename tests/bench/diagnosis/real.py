"""What a model is worth on the rows of a real table that were held out, and which of them no model could reach."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.measure.measurements import Measurements
from postproc.model.equilibrium import predict


def held_out(fit: Fit, held: Measurements, whole: Measurements) -> dict[str, Any]:
    """Distances of the rows held out [m], by name: median, and rms with numbers of rows of three groups.

    All; those that a fit of the whole table can reach, too (a row that lies far off though the same model was fitted to
    it is a bad reading); of these those whose joint angles lie among those of the rows that were fitted.

    Args:
        fit: to the other rows. held: rows held out. whole: all rows.
    """
    away = np.linalg.norm(predict(fit.model, held.state)[:, :3, 3] - held.position, axis=1)
    every = fit_model(fit.model, whole)
    reached = ~np.isin(held.pose_id, [every.data.pose_id[i] for i in every.excluded])
    q, seen = held.state.q, fit.data.state.q
    among = reached & ((q >= seen.min(axis=0)) & (q <= seen.max(axis=0))).all(axis=1)
    return {
        "held_median": float(np.median(away)),
        "held": _rms(away),
        "held_reached": _rms(away[reached]),
        "held_among": _rms(away[among]),
    }


def _rms(away: Array) -> list[float]:
    return [float(f"{np.sqrt(np.mean(away**2)):.4g}"), len(away)]
