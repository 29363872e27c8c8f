"""First derivatives at an equilibrium: how loads answer to displacement, and displacement to loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import Effect
from postproc.model.arm import Model
from postproc.model.chain import Chain, Directions, deflected_chain, directions, generalised_forces, point_jacobian
from postproc.model.derivatives.places import BODY, LOAD_PLACES, PLACES, displacement_parts, flat, load_parts
from postproc.model.equilibrium import Equilibrium, carries_load
from postproc.model.loads import payload_point
from postproc.model.multibody import Multibody

LOAD_STEP = 0.1  # [N, N m]: effects are linear in the load, or smooth over tens of N m
POSE_STEP = 1e-6  # [rad, m]


@dataclass(frozen=True, slots=True)
class RestingArm:
    """The arm at an equilibrium, in m coordinates: six joints, and six for each virtual spring.

    Args:
        bodies: its rigid-body model; chain: geometry of the deflected arm; along: directions of the coordinates.
        coordinates: (n, m) joint angles [rad] and displacements of the springs [m, rad], in chain order.
    """

    bodies: Multibody
    chain: Chain
    along: Directions
    coordinates: Array


def resting_arm(model: Model, balance: Equilibrium) -> RestingArm:
    """Return the arm at an equilibrium as coordinates: six joints, and springs at the bodies in ``balance.bodies``."""
    bodies = model.multibody(balance.bodies)
    chain = deflected_chain(model.robot, balance.chain.q, balance.deflection.body, bool(balance.bodies))
    return RestingArm(bodies, chain, directions(model.robot, chain, balance.bodies), bodies.coordinates(chain))


@dataclass(frozen=True, slots=True)
class Tangent:
    """Derivatives by the m coordinates of the arm, in chain order.

    Args:
        frame: the arm at rest. J: (n, 6, m) J_theta of the TCP, base axes.
        compliance: (n, m, m) displacement by load [rad/(N m), ..].
        K_E: (n, m, m) load by displacement at constant payload and wrench (Eq. 21).
        give: (n, m, m) (I - C K_E)^-1: what a displacement grows to when the loads have followed it.
    """

    frame: RestingArm
    J: Array
    compliance: Array
    K_E: Array
    give: Array


def tangent(model: Model, balance: Equilibrium) -> Tangent:
    """Compute derivatives of loads and displacements at an equilibrium (Eqs. 17-22).

    Where no effect reads loads, ``compliance`` and ``K_E`` are zero and ``give`` is the identity.
    """
    at = resting_arm(model, balance)
    J = point_jacobian(at.along, balance.T_base_tcp[:, :3, 3])
    n, m = len(balance.state), at.bodies.size
    C, K_E = np.zeros((n, m, m)), np.zeros((n, m, m))
    give: Array = np.tile(np.eye(m), (n, 1, 1))
    if carries_load(model):
        K_E = at.bodies.weight_stiffness(at.chain, at.along) + _dead_loads(model, balance, at.along)
        K_E += _effect_loads(model, balance, at)
        C = load_compliance(model, balance.state, at.bodies)
        give = np.asarray(np.linalg.inv(np.eye(m) - C @ K_E))
    return Tangent(at, J, C, K_E, give)


def _dead_loads(model: Model, balance: Equilibrium, along: Directions) -> Array:
    """Return the derivative (n, m, m) of the loads from payload weight and wrench by the coordinates, at rest."""
    state, n = balance.state, len(balance.state)
    K = np.zeros((n, along.spin.shape[1], along.spin.shape[1]))
    if state.payload_mass is not None:
        mass = np.broadcast_to(np.asarray(state.payload_mass, dtype=float), (n,))
        weight = mass[:, None] * model.gravity
        K += dead_load_stiffness(along, payload_point(state, balance.chain), weight, np.zeros((n, 3)))
    if state.wrench is not None:
        wrench = np.broadcast_to(state.wrench, (n, 6))
        K += dead_load_stiffness(along, balance.T_base_tcp[:, :3, 3], wrench[:, :3], wrench[:, 3:])
    return K


def dead_load_stiffness(along: Directions, point: Array, force: Array, moment: Array) -> Array:
    """Return the derivative (n, m, m) of J^T (F, M) by the coordinates.

    Force F and moment M act at a point fixed to the flange, and keep their direction in base axes.
    d(J_i . F)/d(q_k) = F . (spin_i x J_k) for i before k and F . (spin_k x J_i) after; d(spin_i . M)/d(q_k) = (spin_k x
    spin_i) . M for k before i. Pinocchio's static torque derivatives hold the force fixed in the moving frame instead,
    which is wrong by 15 % of K_E here.

    Args:
        point, force, moment: (n, 3) each, in base axes [m], [N], [N m].
    """
    linear = along.slide + np.cross(along.spin, point[:, None] - along.origin)
    # twist[i, k] = F . (spin_i x J_k) = J_k . (F x spin_i)
    twist = np.einsum("nia,nka->nik", np.cross(force[:, None], along.spin), linear)
    # A turn about a fixed point takes itself along: the diagonal belongs to either half.
    upper = np.triu(twist)
    bend = upper + np.swapaxes(np.triu(twist, 1), 1, 2)
    turn = np.einsum("nka,nia->nik", np.cross(moment[:, None], along.spin), along.spin)
    return bend + np.tril(turn, -1)


def _effect_loads(model: Model, balance: Equilibrium, at: RestingArm) -> Array:
    """Return the derivative (n, m, m) of the loads that effects add by the coordinates, by central differences."""
    bodies = at.bodies
    n = len(balance.state)
    K = np.zeros((n, bodies.size, bodies.size))
    loading = [e for e in model.effects if type(e).load is not Effect.load]
    for k in range(bodies.size) if loading else ():
        sides = []
        for step in (POSE_STEP, -POSE_STEP):
            moved = at.coordinates.copy()
            moved[:, k] += step
            body = {b: moved[:, columns] for b, columns in bodies.columns.items()}
            chain = deflected_chain(model.robot, moved[:, bodies.joint], body, bool(bodies.bodies))
            state = balance.state.with_(T_base_body=chain.T_base_body)
            load = sum(
                (flat(load_parts(load_of(e, state)), n, LOAD_PLACES) for e in loading), np.zeros((1, LOAD_PLACES))
            )
            sides.append(
                generalised_forces(directions(model.robot, chain, bodies.bodies), load[:, 6:].reshape(n, 8, 6))
            )
            sides[-1][:, bodies.joint] += load[:, :6]
        K[:, :, k] = (sides[0] - sides[1]) / (2 * POSE_STEP)
    return K


def load_compliance(model: Model, state: State, bodies: Multibody) -> Array:
    """Return the displacement (n, m, m) of each coordinate of ``bodies`` per load on each; zero without loads.

    By central differences of the effects that read loads.
    """
    n, m = len(state), bodies.size
    C = np.zeros((n, m, m))
    if state.joint_load is None:
        return C
    readers = [e for e in model.effects if "load" in e.reads]
    for k in range(m):
        sides = [_shifted(readers, state, bodies, k, step) for step in (LOAD_STEP, -LOAD_STEP)]
        C[:, :, k] = (sides[0] - sides[1]) / (2 * LOAD_STEP)
    return C


def _shifted(readers: list[Effect], state: State, bodies: Multibody, k: int, step: float) -> Array:
    """Return the displacement (n, m) of all coordinates of ``bodies`` with the load on number k raised by ``step``.

    ``readers`` are the effects that read loads.
    """
    n, place = len(state), int(bodies.place[k])
    joint, body = np.array(state.joint_load), state.body_load
    if place < BODY:
        joint[:, place] += step
    elif body is not None:
        body = body.copy()
        body.reshape(n, 42)[:, place - BODY] += step
    loaded = state.with_(joint_load=joint, body_load=body)
    every = sum(
        (flat(displacement_parts(displacement_of(e, loaded)), n, PLACES) for e in readers), np.zeros((1, PLACES))
    )
    return np.asarray(every[:, bodies.place])
