"""A fitted model beside the nominal arm: one that is farther off is not given to anybody."""

from __future__ import annotations

import numpy as np

from postproc.diagnostics import PostprocError
from postproc.effects.roles import FRAME_ROLES
from postproc.estimation.fitted import Fit
from postproc.measure.checks.readings import MISMATCH_M
from postproc.measure.consensus import agreement
from postproc.measure.errors import distances
from postproc.measure.measurements import FEWEST_ROWS_JUDGED

FARTHER, LEAST_M = 1.2, 5e-5
"""So many times as far as the nominal arm, and by so much [m]: least squares give most rows a little away for a few."""


def no_farther_than_nominal(fit: Fit) -> None:
    """Raise DAT039 where a fit leaves most rows clearly farther off than the nominal arm does, DAT009 over 50 mm.

    The medians of the position errors over the rows that agree on where the arm stands are compared: a fit led astray
    by wrong rows is far from most of the others. Nothing is compared for fits without positions, or for a model without
    frames (DAT030 reports that). Where rows do not tell how far the nominal arm is, as of one coordinate, 50 mm in
    the median row is too far.

    Raises:
        PostprocError: DAT009, DAT039.
    """
    if fit.observed.name != "position" or any(fit.model.in_role(role) is None for role in FRAME_ROLES):
        return
    agreed = agreement(fit.data, fit.model.robot)
    if len(agreed.rows) < FEWEST_ROWS_JUDGED or not agreed.near:
        missed = float(np.nanmedian(distances(fit.problem.error[:, :3])))
        if missed > MISMATCH_M:
            message = f"half of the rows lie over {1e3 * missed:.0f} mm from the fitted model: they are not this arm's"
            help_ = "check the robot's name, the unit, and that joints and points belong to the same rows"
            raise PostprocError.of("DAT009", message, fit.data.source, help=help_)
        return
    nominal = float(np.median(np.linalg.norm(agreed.error, axis=1)))
    left = float(np.median(distances(fit.problem.error[agreed.rows, :3])))
    if left < max(FARTHER * nominal, nominal + LEAST_M):
        return
    message = (
        f"half of the rows lie over {1e3 * left:.3f} mm from the fitted model, and {1e3 * nominal:.3f} mm from the "
        "nominal arm: the model is worse than none and is not written"
    )
    help_ = (
        "some rows are not what the table says (DAT007, DAT013, DAT025 name the likely ones): correct or leave them out"
    )
    raise PostprocError.of("DAT039", message, fit.data.source, help=help_, exit_code=1)
