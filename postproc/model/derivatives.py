"""How the measured pose answers to the parameters of the effects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect, displacement_of, load_of
from postproc.effects.contract import Displacement, State
from postproc.model.arm import Model
from postproc.model.equilibrium import Equilibrium, active_bodies, carries_load, equilibrium
from postproc.model.tangent import Tangent, sum_coordinates, sum_loads, tangent
from postproc.robot.pose import displace, invert, pose_error

STEP = 1e-3  # of a parameter's ordinary size


def parameters(model: Model) -> Array:
    """(p,) parameters of all effects, in the order of the model."""
    return np.concatenate([np.zeros(0), *(e.vector() for e in model.effects)])


def pose_derivatives(model: Model, state: State, rest: Equilibrium | None = None) -> Array:
    """Derivatives of T_instrument_tcp by all parameters, (n, 6, p) [m and rad per unit], instrument axes.

    J_theta (I - C K_E)^-1 (dD/dp + C J_theta^T dw/dp): displacements D at fixed loads, loads w through the compliance,
    and both grown by the loads that follow the deflection. One Jacobian a pose serves every effect.

    Args:
        rest: the equilibrium of these states (see ``movable``), if it is known already.
    """
    rest = movable(model, state) if rest is None else rest
    at = tangent(model, rest)
    return np.concatenate(
        [np.zeros((len(state), 6, 0)), *(effect_derivatives(model, e, rest, at) for e in model.effects)], axis=-1
    )


def movable(model: Model, state: State) -> Equilibrium:
    """The equilibrium with the loads on every body that a parameter would move, null as it may be now."""
    nudged = [e.with_vector(e.vector() + STEP * e.scale()) for e in model.effects]
    return equilibrium(model, state, active_bodies(model.with_effects(*nudged), state))


def effect_derivatives(
    model: Model, effect: Effect, rest: Equilibrium, at: Tangent, wanted: Sequence[int] | None = None
) -> Array:
    """Derivatives by the parameters of one effect, in the model or not, (n, 6, p); see `pose_derivatives`.

    Args:
        wanted: indices of the parameters, in the order of the result; all of them where nothing is said.
    """
    R = np.eye(3) if rest.deflection.instrument is None else displace(rest.deflection.instrument)[..., :3, :3]
    outer = np.zeros((*R.shape[:-2], 6, 6))
    outer[..., :3, :3] = outer[..., 3:, 3:] = R
    gain = outer @ at.J @ at.give
    columns = effect.basis(rest.state)
    if columns is not None:
        moved = gain[:, :, at.frame.bodies.joint[columns.joint]]
        result: Array = moved * columns.values[:, None, :]
        return result if wanted is None else result[:, :, wanted]
    steps = STEP * effect.scale()
    indices = range(len(steps)) if wanted is None else wanted
    found = np.zeros((len(rest.state), 6, len(indices)))
    here = displacement_of(effect, rest.state)
    for at_column, k in enumerate(indices):
        step = steps[k]
        sides = [_shifted(effect, k, s) for s in (step, -step)]
        shares = [displacement_of(e, rest.state) for e in sides]
        coordinates = [sum_coordinates([s], at.frame.bodies, len(rest.state)) for s in shares]
        moved = (coordinates[0] - coordinates[1]) / (2 * step)
        if carries_load(model):
            loads = [sum_loads([load_of(e, rest.state)], at.frame) for e in sides]
            moved += np.einsum("nij,nj->ni", at.compliance, (loads[0] - loads[1]) / (2 * step))
        found[:, :, at_column] = np.einsum("nij,nj->ni", gain, moved)
        if shares[0].tool is not None or shares[0].instrument is not None:
            ends = [_ends(rest, here, s) for s in shares]
            found[:, :, at_column] += pose_error(ends[1], ends[0]) / (2 * step)
    return found


def _shifted(effect: Effect, k: int, step: float) -> Effect:
    x = effect.vector()
    x[k] += step
    return effect.with_vector(x)


def _ends(rest: Equilibrium, here: Displacement, there: Displacement) -> Array:
    """Seen poses when an effect's share of the tool and of the instrument changes, the arm as it is, (n, 4, 4).

    An effect that is not in the model changes from nothing: its share there is added, not exchanged.
    """
    tool = _or_zero(rest.deflection.tool)
    seen = rest.T_base_tcp @ invert(displace(tool)) @ displace(tool + _or_zero(there.tool) - _or_zero(here.tool))
    shift = _or_zero(rest.deflection.instrument) + _or_zero(there.instrument) - _or_zero(here.instrument)
    result: Array = displace(shift) @ seen
    return result


def _or_zero(share: Array | None) -> Array:
    return np.zeros(6) if share is None else share
