"""Elastic equilibrium: loads deflect the arm, and the deflected arm carries other loads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.effects.base import displacement_of, load_of
from postproc.effects.contract import State
from postproc.effects.geometry import force_at, point_acceleration
from postproc.model.arm import ALL_BODIES, Model
from postproc.model.chain import Chain, deflected_chain, directions, spread
from postproc.model.multibody import Multibody
from postproc.model.states import take
from postproc.robot.pose import displace

SETTLED = 1e-10  # [m]; rotations count at the arm's reach
REACH = 3.0  # [m]
SWEEPS = 60
BATCH = 2000


@dataclass(frozen=True, slots=True)
class Deflection:
    """What all effects move together: joints (n, 6) [rad], ends of bodies, tool, the base as the instrument sees it."""

    joint: Array
    body: Mapping[int, Array]
    tool: Array | None
    instrument: Array | None


@dataclass(frozen=True, slots=True)
class Equilibrium:
    """Where the real arm comes to rest.

    Args:
        state: the states with poses and loads filled in, as the effects saw them last.
        deflection: displacement of every coordinate. chain: geometry of the deflected arm.
        T_base_tcp: (n, 4, 4) real TCP. sweeps: how many it took.
        bodies: those whose far ends are moved or whose loads are read; loads of the others are NaN.
    """

    state: State
    deflection: Deflection
    chain: Chain
    T_base_tcp: Array
    sweeps: int
    bodies: tuple[int, ...] = ()


def equilibrium(model: Model, state: State, also: tuple[int, ...] = ()) -> Equilibrium:
    """Solve xi = C load(q, xi) by fixed-point sweeps, which contract by about 1e-3 each.

    Args:
        also: bodies whose loads are wanted beside those that the effects move or read.

    Raises:
        PostprocError: MOD010, the arm is so soft that its loads do not settle.
    """
    state = state.with_(robot=model.robot, gravity=model.gravity)
    if not len(state):
        state = state.with_(
            T_base_body=np.zeros((0, 7, 4, 4)), joint_load=np.zeros((0, 6)), body_load=np.zeros((0, 7, 6))
        )
        return _rest(model, state, Deflection(np.zeros((0, 6)), {}, None, None), 0, ())
    loaded = carries_load(model)
    bodies = tuple(sorted({*(active_bodies(model, state) if loaded else ()), *also}))
    deflection = Deflection(np.zeros((len(state), 6)), {}, None, None)
    last = np.inf
    for sweep in range(1, SWEEPS + 1):
        seen = loaded_state(model, state, deflection, bodies) if loaded else state
        new = deflect(model, seen)
        change = distance(new, deflection)
        deflection = new
        worst = float(change.max())
        # Sweeps contract evenly, so the next change is foretold and need not be computed.
        if not loaded or worst < SETTLED or (worst < 1e-6 and worst * (worst / last) < 0.1 * SETTLED):
            return _rest(model, seen, deflection, sweep, bodies)
        if not np.isfinite(worst) or worst > 10.0 * REACH:
            break
        last = worst
    raise unsettled(int(np.argmax(np.where(np.isfinite(change), change, np.inf))))


def unsettled(index: int) -> PostprocError:
    return PostprocError(
        Diagnostic(
            "MOD010",
            "error",
            f"the deflection of pose {index} does not settle",
            help="a compliance is too large for the loads: check its unit (rad/(N m)) and the payload",
        ),
        exit_code=1,
    )


def _rest(model: Model, state: State, deflection: Deflection, sweeps: int, bodies: tuple[int, ...]) -> Equilibrium:
    every = tuple(sorted({*bodies, *deflection.body}))
    chain = deflected_chain(model.robot, state.q + deflection.joint, deflection.body, bool(deflection.body))
    return Equilibrium(state, deflection, chain, tcp(chain, state, deflection), sweeps, every)


def predict(model: Model, state: State) -> Array:
    """Real TCP poses as the instrument sees them, T_instrument_tcp (n, 4, 4)."""
    result = np.empty((len(state), 4, 4))
    # Batches that stay in the processor's cache are faster, and a long program needs little memory.
    for start in range(0, len(state), BATCH):
        rows = slice(start, start + BATCH)
        rest = equilibrium(model, take(state, rows))
        instrument = rest.deflection.instrument
        result[rows] = rest.T_base_tcp if instrument is None else displace(instrument) @ rest.T_base_tcp
    return result


def tcp(chain: Chain, state: State, deflection: Deflection) -> Array:
    """Real TCP in the base frame, flange times nominal tool times tool displacement, (n, 4, 4)."""
    T: Array = chain.T_base_flange @ state.T_flange_tcp
    return T if deflection.tool is None else T @ displace(deflection.tool)


def carries_load(model: Model) -> bool:
    """Whether any effect asks for loads or for the pose of the deflected arm."""
    return any({"load", "pose"} & set(e.reads) for e in model.effects)


def active_bodies(model: Model, state: State) -> tuple[int, ...]:
    """Bodies whose far ends an effect moves, or whose load it reads.

    Asked of one state, once for every body, with a load on that body that is not a number: where it shows, it is read.
    """
    probe = take(state, np.zeros(8, dtype=int))
    body_load = np.zeros((8, 7, 6))
    body_load[ALL_BODIES, ALL_BODIES] = np.nan
    chain = deflected_chain(model.robot, probe.q, {}, False)
    probe = probe.with_(
        robot=model.robot,
        gravity=model.gravity,
        T_base_body=chain.T_base_body,
        joint_load=np.zeros((8, 6)),
        body_load=body_load,
    )
    found: set[int] = set()
    for effect in model.effects:
        share = displacement_of(effect, probe)
        parts = [share.joint, share.tool, share.instrument, *share.body.values()]
        read = np.array([np.isnan(p).any(axis=1) for p in parts if p is not None and p.ndim == 2]).reshape(-1, 8)
        found |= {*share.body, *(b for b in ALL_BODIES if read[:, b].any())}
    return tuple(sorted(found))


def loaded_state(model: Model, state: State, deflection: Deflection, bodies: tuple[int, ...] | bool) -> State:
    """The state with body poses and the loads on the springs of the arm deflected so far.

    load = J_g^T G + J_theta^T f - (M qdd + v), on every virtual spring (Eqs. 14-16, 23 corrected): links through the
    recursive Newton-Euler algorithm, payload, wrench and effects as forces on their bodies.

    Args:
        bodies: those whose far ends carry a spring, beside those that are deflected; True for all.
    """
    springs = ALL_BODIES if bodies is True else tuple(sorted({*(bodies or ()), *deflection.body}))
    chain = deflected_chain(model.robot, state.q + deflection.joint, deflection.body, bool(springs))
    state = state.with_(T_base_body=chain.T_base_body)
    along = directions(model.robot, chain, springs)
    arm = model.multibody(springs)
    load = -arm.rnea(coordinates(chain, arm), state.v, state.a)
    forces, torques = applied(model, state, chain, deflection)
    if forces is not None:
        load = load + spread(along, np.cumsum(forces[:, ::-1], axis=1)[:, ::-1])
    body_load: Array | None = None
    if springs:
        body_load = np.full((len(state), 7, 6), np.nan)
        body_load[:, springs] = load[:, arm.spring]
    return state.with_(joint_load=load[:, arm.joint] + torques, body_load=body_load)


def coordinates(chain: Chain, arm: Multibody) -> Array:
    """All coordinates of the deflected arm in chain order, (n, m)."""
    if not arm.bodies:
        return chain.q
    result = np.zeros((len(chain.q), arm.size))
    result[:, arm.joint] = chain.q
    for b, xi in chain.body.items():
        result[:, arm.columns[b]] = xi
    return result


def applied(model: Model, state: State, chain: Chain, deflection: Deflection) -> tuple[Array | None, Array]:
    """Forces from outside and from effects: (n, 8, 6) on bodies and flange about the base origin, (n, 6) on joints."""
    n = len(state)
    forces: Array | None = None
    torques = np.zeros((n, 6))

    def add(body: int, wrench: Array) -> None:
        nonlocal forces
        if forces is None:
            forces = np.zeros((n, 8, 6))
        forces[:, body] += wrench

    if state.payload_mass is not None:
        add(7, payload_wrench(model, state, chain))
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
    """(n, 3) centre of the payload in the base frame [m]; the flange where it is not given."""
    if state.payload_center is None:
        return chain.T_base_flange[:, :3, 3]
    center = np.broadcast_to(state.payload_center, (len(state), 3))[:, :, None]
    return (chain.T_base_flange[:, :3, :3] @ center)[:, :, 0] + chain.T_base_flange[:, :3, 3]


def payload_wrench(model: Model, state: State, chain: Chain) -> Array:
    """Payload as a point mass: force m (g - a) at its centre and moment about the base origin, (n, 6)."""
    point = payload_point(state, chain)
    pull = np.broadcast_to(model.gravity, point.shape)
    if state.v is not None or state.a is not None:
        still = np.zeros((len(state), 6))
        v, a = (still if r is None else r for r in (state.v, state.a))
        pull = pull - point_acceleration(model.robot, chain.T_base_body, v, a, 6, point)
    mass = np.broadcast_to(np.asarray(state.payload_mass, dtype=float), (len(state),))
    return force_at(point, mass[:, None] * pull)


def deflect(model: Model, state: State) -> Deflection:
    """The sum of the displacements of all effects at a state."""
    n = len(state)
    joint = np.zeros((n, 6))
    body: dict[int, Array] = {}
    tool: Array | None = None
    instrument: Array | None = None
    for effect in model.effects:
        share = displacement_of(effect, state)
        if share.joint is not None:
            joint = joint + share.joint
        for b, xi in share.body.items():
            whole = np.broadcast_to(xi, (n, 6))
            body[b] = body[b] + whole if b in body else whole
        tool = _plus(tool, share.tool)
        instrument = _plus(instrument, share.instrument)
    return Deflection(joint, body, tool, instrument)


def _plus(total: Array | None, share: Array | None) -> Array | None:
    return share if total is None else total if share is None else total + share


def distance(new: Deflection, old: Deflection) -> Array:
    """(n,) how far the TCP moves from one deflection to the other [m], from above, without tool and frame."""
    total = np.abs(new.joint - old.joint).max(axis=1) * REACH
    for b, xi in new.body.items():
        step = np.abs(xi - old.body[b]) if b in old.body else np.abs(xi)
        total = np.maximum(total, np.maximum(step[:, :3].max(axis=1), REACH * step[:, 3:].max(axis=1)))
    result: Array = total
    return result
