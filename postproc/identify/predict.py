"""Predicted poses for the rows of a table.

With their standard deviation and a word about the range that was measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic
from postproc.measure.columns import columns_of
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.model.uncertainty import beyond_range, predict_sigma


@dataclass(frozen=True)
class Prediction:
    """One predicted position per row of the table, in the instrument's frame.

    Args:
        pose_id: (n,) labels; position: (n, 3) [m], NaN where the row has no commanded joints; sigma: (n,) per axis
            [m], NaN
            where the model file has no covariance; diagnostics: channels beyond the measured range.
    """

    pose_id: tuple[str, ...]
    position: Array
    sigma: Array
    diagnostics: tuple[Diagnostic, ...] = ()

    def as_csv(self) -> str:
        """Columns ``pose_id,x_mm,y_mm,z_mm,sigma_mm``, one row per input row, same order; empty where unknown."""
        lines = ["pose_id,x_mm,y_mm,z_mm,sigma_mm"]
        for label, p, s in zip(self.pose_id, 1e3 * self.position, 1e3 * self.sigma, strict=True):
            cells = [f"{x:.5f}" if np.isfinite(x) else "" for x in (*p, s)]
            lines.append(",".join([label, *cells]))
        return "\n".join(lines) + "\n"


def predict_rows(model: Model, data: Measurements) -> Prediction:
    """Predict where the real TCP is for every row of a table."""
    good = np.asarray(np.isfinite(data.state.q).all(axis=1))
    some = data.rows(good)
    state = some.state if data.tool_known else some.state.with_(T_flange_tcp=model.T_flange_tcp)
    position, sigma = np.full((len(data), 3), np.nan), np.full(len(data), np.nan)
    position[good] = predict(model, state)[:, :3, 3]
    sigma[good] = predict_sigma(model, state)
    found = []
    for effect in model.effects:
        if (unread := effect.missing(state)) and not effect.is_null and "session" not in unread:
            message = f"`{effect.key}` is left out: the table has no {' and no '.join(map(columns_of, unread))}"
            help_ = "record it, or fit a model without the effect"
            found.append(Diagnostic("DAT021", "warning", message, data.source, help=help_))
        elif "row" in effect.reads and not effect.is_null:
            first, last = (f"{state.channels['row'][at]:g}" for at in (0, -1))
            message = (
                f"`{effect.key}` follows `row`, which is {first} to {last} here, as the names in `pose_id` or `row` say"
            )
            help_ = (
                "true of poses of the table that it was drafted from; for others give a column `row`, or leave it out"
            )
            found.append(Diagnostic("DAT021", "info", message, data.source, help=help_))
    for beyond in beyond_range(model, state):
        count = int(beyond.rows.sum())
        rows = "1 row leaves" if count == 1 else f"{count} rows leave"
        message = f"{rows} the range in which the model was measured: {beyond.text}"
        found.append(Diagnostic("DAT023", "warning", message, data.source, help="measure there before relying on it"))
    return Prediction(data.pose_id, position, sigma, tuple(found))
