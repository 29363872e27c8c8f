"""The formulas of the source paper, as printed, to set beside the exact equilibrium.

Source: "Off-Line Programmed Error Compensation of an Industrial Robot in Ship Hull Welding" (virtual springs, ABB
IRB 4600). Joint springs alone. docs/paper.md lists what is printed wrongly and how far these formulas are from
`equilibrium`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array, invert
from postproc.channels.state import State
from postproc.model.arm import Model
from postproc.model.derivatives.stiffness import stiffness
from postproc.model.equilibrium import Equilibrium, equilibrium
from postproc.model.loads import loaded_state
from postproc.robot.kinematics import forward, jacobian
from postproc.robot.pose import displace, transform
from postproc.robot.track import track


@dataclass(frozen=True, slots=True)
class PaperResult:
    """Compensated commands by the paper's iteration.

    Args:
        T_base_tcp: (n, 4, 4) commanded poses. error_m: (n,) distance of the real arm from the desired path.
        sweeps: iterations used.
    """

    T_base_tcp: Array
    error_m: Array
    sweeps: int


def paper_deflection(model: Model, state: State) -> Array:
    """Cartesian deflection K^-1 (f_e + J^-T tau) of Eq. 23, (n, 6) [m, rad], base axes.

    tau is the load of gravity and inertia on the joints at the commanded angles, K the stiffness of Eq. 22 there.
    Fails at singular poses and mixes the tangent stiffness with the whole load.
    """
    rigid = model.with_effects()
    nominal = equilibrium(rigid, state)
    weight = loaded_state(
        model, state.with_(wrench=None, robot=model.robot, gravity=model.gravity), nominal.deflection, ()
    )
    assert weight.joint_load is not None
    J = jacobian(model.robot, state.q, state.T_flange_tcp)
    force = np.zeros((len(state), 6)) if state.wrench is None else np.broadcast_to(state.wrench, (len(state), 6))
    pull = np.linalg.solve(np.swapaxes(J, 1, 2), weight.joint_load[:, :, None])[:, :, 0]
    return np.asarray(np.linalg.solve(stiffness(model, state), (force + pull)[:, :, None]))[:, :, 0]


def paper_compensation(model: Model, state: State, T_base_tcp: Array, printed: bool, sweeps: int = 10) -> PaperResult:
    """Iterative compensation of Eqs. 24-25, against the exact arm.

    As printed, p_f = p + lambda (p - p_c) has not the wanted fixed point: it settles where part of the error is left.
    Corrected, p_f <- p_f + lambda (p - p_c) accumulates. lambda = max norm / 2-norm of the error, in [1/sqrt(3), 1].

    Args:
        state: ``q`` are the nominal joint angles of the desired poses, consecutive along the path.
        T_base_tcp: (n, 4, 4) desired; orientations are commanded as they are, as in the paper.
        printed: Eq. 25 as printed, instead of corrected.
    """
    desired = T_base_tcp[:, :3, 3]
    commanded = T_base_tcp.copy()
    sweep = 0
    while sweep < sweeps:
        real = _real(model, state, commanded).T_base_tcp[:, :3, 3]
        gap = desired - real
        error = np.linalg.norm(gap, axis=1)
        if error.max() < 1e-9:
            break
        sweep += 1
        factor = np.abs(gap).max(axis=1) / np.maximum(error, 1e-300)
        start = desired if printed else commanded[:, :3, 3]
        commanded = transform(start + factor[:, None] * gap, T_base_tcp[:, :3, :3])
    error = np.linalg.norm(desired - _real(model, state, commanded).T_base_tcp[:, :3, 3], axis=1)
    return PaperResult(commanded, error, sweep)


def _real(model: Model, state: State, commanded: Array) -> Equilibrium:
    q = track(model.robot, commanded @ invert(state.T_flange_tcp), state.q[0])
    return equilibrium(model, state.with_(q=q))


def paper_pose(model: Model, state: State) -> Array:
    """Real TCP poses by Eq. 23: the nominal pose moved by the paper's deflection, (n, 4, 4)."""
    xi = paper_deflection(model, state)
    nominal = forward(model.robot, state.q) @ state.T_flange_tcp
    moved = displace(xi)
    return transform(nominal[:, :3, 3] + xi[:, :3], moved[:, :3, :3] @ nominal[:, :3, :3])
