"""The loads on the springs of the deflected arm: links, payload, wrench and effects."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.effects.asking import load_of
from postproc.effects.geometry import force_at, point_acceleration
from postproc.model.arm import Model
from postproc.model.chain import Chain, Directions, deflected_chain, directions, generalised_forces
from postproc.model.deflection import Deflection, tcp


def loaded_state(model: Model, state: State, deflection: Deflection, bodies: tuple[int, ...]) -> State:
    """Return the states with body poses, and with the loads on joints and springs of the arm at this deflection.

    Args:
        bodies: numbers of bodies whose far ends carry a spring, beside those that are deflected.
    """
    springs = tuple(sorted({*bodies, *deflection.body}))
    chain = deflected_chain(model.robot, state.q + deflection.joint, deflection.body, bool(springs))
    return with_loads(model, state, deflection, chain, along=directions(model.robot, chain, springs), springs=springs)


def with_loads(
    model: Model, state: State, deflection: Deflection, chain: Chain, *, along: Directions, springs: tuple[int, ...]
) -> State:
    """Return the states with the poses of the bodies and the loads on joints and on the springs of some bodies.

    load = J_g^T G + J_theta^T f - (M qdd + v), on every virtual spring (Eqs. 14-16, 23 corrected): links through the
    recursive Newton-Euler algorithm, payload, wrench and effects as forces on their bodies.

    Args:
        deflection: of the arm; chain: its geometry; along: directions of its joints and springs.
        springs: numbers of the bodies with a spring; the loads of other bodies are NaN.
    """
    state = state.with_(T_base_body=chain.T_base_body)
    base = _carried(state)
    arm = model.multibody(springs, base is not None)
    load = -arm.rnea(chain, along, state.v, state.a, base)
    forces, torques = applied(model, state, chain, deflection)
    if forces is not None:
        load = load + generalised_forces(along, forces)
    body_load: Array | None = None
    if springs:
        body_load = np.full((len(state), 7, 6), np.nan)
        body_load[:, springs] = load[:, arm.spring]
    return state.with_(joint_load=load[:, arm.joint] + torques, body_load=body_load)


def _carried(state: State) -> tuple[Array, Array, Array] | None:
    """Return gravity, angular velocity and acceleration of a moving base, (n, 3) each, base axes; None if fixed."""
    if state.gravity.ndim == 1 and state.base_spin is None:
        return None
    still = np.zeros((len(state), 3))
    spin, rate = (still if x is None else x for x in (state.base_spin, state.base_spin_rate))
    return np.broadcast_to(state.gravity, still.shape), spin, rate


def applied(model: Model, state: State, chain: Chain, deflection: Deflection) -> tuple[Array | None, Array]:
    """Return the forces of payload, wrench and effects on the arm.

    Returns:
        Wrenches (n, 8, 6) on bodies 0 to 6 and the flange about the base origin [N, N m], None if there are none;
        and the torques (n, 6) of effects on joints [N m].
    """
    n = len(state)
    forces: Array | None = None
    torques = np.zeros((n, 6))

    def add(body: int, wrench: Array) -> None:
        """Add a wrench (n, 6) to those on a body."""
        nonlocal forces
        if forces is None:
            forces = np.zeros((n, 8, 6))
        forces[:, body] += wrench

    if state.payload_mass is not None:
        add(7, payload_wrench(state, chain))
    if state.wrench is not None:
        point = tcp(chain, state, deflection)[:, :3, 3]
        moved = force_at(point, np.broadcast_to(state.wrench, (n, 6))[:, :3])
        moved[:, 3:] += np.broadcast_to(state.wrench, (n, 6))[:, 3:]
        add(7, moved)
    for effect in model.effects:
        share = load_of(effect, state)
        if share.joint is not None:
            torques = torques + share.joint
        for body, wrench in share.body.items():
            add(body, wrench)
    return forces, torques


def payload_point(state: State, chain: Chain) -> Array:
    """Return the centre of the payload in the base frame, (n, 3) [m]; the flange where no centre is stated."""
    if state.payload_center is None:
        return chain.T_base_flange[:, :3, 3]
    center = np.broadcast_to(state.payload_center, (len(state), 3))[:, :, None]
    return (chain.T_base_flange[:, :3, :3] @ center)[:, :, 0] + chain.T_base_flange[:, :3, 3]


def payload_wrench(state: State, chain: Chain) -> Array:
    """Return force m (g - a) of the payload as a point mass, and its moment about the base origin, (n, 6) [N, N m]."""
    point = payload_point(state, chain)
    pull = np.broadcast_to(state.gravity, point.shape)
    if state.motions is not None:
        pull = pull - point_acceleration(state.motions[6], chain.T_base_body[:, 6], point)
    mass = np.broadcast_to(np.asarray(state.payload_mass, dtype=float), (len(state),))
    return force_at(point, mass[:, None] * pull)
