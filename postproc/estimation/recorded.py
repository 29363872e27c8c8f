"""A fitted model as it is written: with the table [fit] of its model file."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import Any

import numpy as np

from postproc import __version__
from postproc.estimation.fitted import Fit
from postproc.model.arm import Model
from postproc.model.uncertainty import Uncertainty, parameter_name, range_table, uncertainty_table
from postproc.numbers import mm


def recorded_model(fit: Fit) -> Model:
    """Return the fitted model with its table [fit]: data and its hash, figures, covariance, measured range, version."""
    data = fit.data
    after = fit.posterior
    known = Uncertainty(after.names, after.covariance, left_of_pose(fit), after.left_open, after.directions)
    key, noise = fit.observed.key, fit.parts.level
    table: dict[str, Any] = {
        "rows": int(len(data) - len(fit.set_aside)),
        key("rms"): mm(fit.rms),
        **({} if fit.unnamed else {key("held_out_rms"): mm(fit.held_out_rms)}),
        "version": __version__,
        **uncertainty_table(fit.model, known),
        "undetermined": [parameter_name(fit.model, *name) for name in undetermined(fit)],
        "range": range_table(data.state),
    }
    if fit.parts.repeatability is not None:
        table[key("noise_repeatability")] = mm(fit.parts.repeatability)
    if noise is not None:
        table[key("noise")] = mm(noise)
        table["noise_from"] = fit.parts.origin
    elif fit.observed.unit == "mm":
        # What follows no channel: a measurement scatters by it whatever it is.
        table["noise_mm"] = mm(fit.parts.unfollowed)
        table["noise_from"] = "the residual"
    if data.sources:
        names = [source.path.replace("\\", "/").rsplit("/", 1)[-1] for source in data.sources]
        hashes = [hashlib.sha256(source.data).hexdigest() for source in data.sources]
        table["data"], table["data_sha256"] = (names, hashes) if names[1:] else (names[0], hashes[0])
    return replace(fit.model, fit=table)


def left_of_pose(fit: Fit) -> float:
    """Return the standard deviation per axis [m] of the model's error of the true position.

    It contains what the residual shows and what uncertain formulas of drafted effects may hide. Errors of joint angles
    and orientations are turned into displacements by their lever in the measured poses.
    """
    left = float(np.hypot(fit.unexplained, fit.undecided))
    if fit.observed.name == "position":
        return left
    turns = fit.problem.lever[:, :3, :6] if fit.observed.name == "joint" else np.eye(3)[None]
    return left * float(np.sqrt(np.mean(np.sum(turns**2, axis=(1, 2))) / 3))


def undetermined(fit: Fit) -> list[tuple[str, int]]:
    """Return the parameters (effect key, index) that stand at their priors: the rows say less than half of them."""
    names = (*fit.posterior.names, *fit.posterior.left_open)
    return sorted(names[k] for k in fit.posterior.undetermined)
