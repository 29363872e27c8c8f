"""What an arm that nobody measured leaves of a correction, and what readings with a dial gauge would make of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.arrays import GRAVITY, Array
from postproc.channels.state import State
from postproc.effects.roles import Role
from postproc.model.arm import Model
from postproc.model.uncertainty.scatter import (
    NORMAL_95,
    Scatter,
    deflection_gram,
    scatter_by,
    scatter_covariance,
    stiffness_factors,
)
from postproc.robot.kinematics import jacobian

GAUGE_SETUPS, READING_SIGMA = 6, 1e-5
"""Set-ups of a dial gauge that a shop can read in an hour, and the standard deviation [m] of a reading.

Each is read without and with its load, twice: so much is then that of the difference of the means, too.
"""
UNBENT_M = 1e-6
"""Root mean square of a deflection that RAPID text does not show."""
PULL_N = 100.0
"""Of a spring balance, sideways: a weight never loads a joint that turns about the vertical."""


def type_scatter(model: Model, state: State) -> Scatter | None:
    """Return what a correction leaves, for the loads of a program's states.

    None where the arm's stiffness is known, or no load bends the arm: of nothing there is no share.

    Args:
        state: n states with all loads, where the correction is made.
    """
    if not has_type_stiffness(model):
        return None
    gram = deflection_gram(model, state)
    if gram.sum() <= len(state) * UNBENT_M**2:
        return None
    scatter, covariance = scatter_by(gram, scatter_covariance(model)), _covariance_after_gauge(model, state)
    if covariance is None:
        return scatter
    return replace(scatter, after_gauge=scatter_by(gram, covariance).remaining, gauge_load=model.robot.payload)


def has_type_stiffness(model: Model) -> bool:
    """Return whether the stiffness is that of the arm's type: estimated, or the numbers of its file.

    Compliances in the controller's configuration are the arm's own; what a user states is taken as known, and what a
    fit has told has its own covariance.
    """
    spring, usual = model.in_role(Role.JOINT_SPRINGS), model.robot.joint_compliance
    if spring is None or model.stiffness_source in ("controller", "user"):
        return False
    if any(name.startswith(f"{spring.key}.") for name in model.fit.get("parameters", ())):
        return False
    return model.stiffness_source == "estimated" or (usual is not None and np.array_equal(spring.vector(), usual))


def _covariance_after_gauge(model: Model, state: State) -> Array | None:
    """Return the covariance (12, 12) of `scatter_by` with what readings of a dial gauge tell.

    At states spread over the program the TCP is loaded along a unit vector u, in turn along the two horizontal axes of
    the world, with `PULL_N`, and along gravity, with the rated payload. A gauge along u is read with that load F and
    without it, twice; the difference of the means is h f, h_j = F (u J_j)^2 c_j, with the relative compliances f of
    `scatter_by` and the error s of one reading. To first order about f = 1 the logarithms of f then have the
    covariance (diag(1 / p^2) + sum h h^T / s^2)^-1, p their spread before. Masses stay as uncertain as they are. None
    where the rated payload is not known.
    """
    spring, robot = model.in_role(Role.JOINT_SPRINGS), model.robot
    if spring is None or robot.payload is None:
        return None
    some = state.rows(np.linspace(0, len(state) - 1, GAUGE_SETUPS).round().astype(int))
    axis = np.arange(len(some)) % 3
    along = np.einsum("ni,nij->nj", model.R_world_base[axis], jacobian(robot, some.q, some.T_flange_tcp)[:, :3])
    force = np.array([PULL_N, PULL_N, GRAVITY * robot.payload])[axis]
    shown = force[:, None] * along**2 * spring.vector()
    spread = np.maximum(np.log(stiffness_factors(robot)) / NORMAL_95, 1e-9)
    information = np.diag(spread**-2.0) + shown.T @ shown / READING_SIGMA**2
    return scatter_covariance(model, np.linalg.inv(information))
