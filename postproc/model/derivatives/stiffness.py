"""Cartesian stiffness in the loaded configuration, and natural frequencies."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array, blocks
from postproc.channels.state import State
from postproc.model.arm import Model
from postproc.model.chain import point_jacobian
from postproc.model.derivatives.places import BATCH
from postproc.model.derivatives.tangent import RestingArm, tangent
from postproc.model.equilibrium import Equilibrium, equilibrium
from postproc.model.loads import payload_point


def tcp_compliance(model: Model, state: State) -> Array:
    """Return the TCP's motion per further wrench, S = J (I - C K_E)^-1 C J^T, (n, 6, 6) [m/N .. rad/(N m)], base axes.

    The inverse of Eq. 22, defined at singular poses and for rigid links as well.
    """
    at = tangent(model, equilibrium(model, state))
    return at.J @ at.give @ at.compliance @ np.swapaxes(at.J, 1, 2)


def stiffness(model: Model, state: State) -> Array:
    """Return the stiffness at the TCP in base axes, K = (J (K_theta - K_E)^-1 J^T)^-1 (seed paper, Eq. 22), (n, 6, 6).

    Units are N/m to N m/rad; force before moment, translation before rotation. All entries are infinite at poses that
    are rigid in some direction: singular arms, rigid models.
    """
    S = tcp_compliance(model, state)
    K = np.full_like(S, np.inf)
    size = np.linalg.svd(S, compute_uv=False)
    good = size[:, -1] > 1e-9 * size[:, 0]
    K[good] = np.linalg.inv(S[good])
    return K


def natural_frequencies(model: Model, state: State) -> Array:
    """Return the six lowest natural frequencies, ascending, (n, 6) [Hz] (seed paper, Eq. 6: det(K - omega^2 M) = 0).

    1 / omega^2 are the eigenvalues of (I - C K_E)^-1 C M over all coordinates, M with the payload as a point mass. With
    springs at the joints alone this is Eq. 6 with M_cart = (J M^-1 J^T)^-1 and K of Eq. 22, and it also holds at
    singular poses. Infinite for a rigid model.
    """
    if len(state) > BATCH:
        return np.concatenate([natural_frequencies(model, state.rows(rows)) for rows in blocks(len(state), BATCH)])
    balance = equilibrium(model, state)
    at = tangent(model, balance)
    squared = np.linalg.eigvals(at.give @ at.compliance @ inertia(balance, at.frame)).real
    squared = np.sort(np.maximum(squared, 0.0), axis=1)[:, ::-1][:, :6]
    with np.errstate(divide="ignore"):
        frequencies: Array = 1.0 / (2 * np.pi * np.sqrt(squared))
    return frequencies


def inertia(balance: Equilibrium, at: RestingArm) -> Array:
    """Return the mass matrix (n, m, m) of links and payload (a point mass) in the m coordinates of the arm at rest."""
    M = at.bodies.inertia(at.chain, at.along)
    state = balance.state
    if state.payload_mass is None:
        return M
    J = point_jacobian(at.along, payload_point(state, at.chain))[:, :3]
    mass = np.broadcast_to(np.asarray(state.payload_mass, dtype=float), (len(state),))
    return M + mass[:, None, None] * (np.swapaxes(J, 1, 2) @ J)
