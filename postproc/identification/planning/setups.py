"""Measurements to begin with, chosen without a table: postures, loads and directions of what a shop can read.

A set-up is one posture at which something is read: a dial gauge without and with a load, a tip that is touched, a plane
that a search finds, the length of a ball bar, a position.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from postproc import BASE
from postproc.arrays import Array
from postproc.channels.state import State
from postproc.diagnostics import PostprocError
from postproc.effects.registry import effect_in_role, effect_library
from postproc.effects.roles import Role
from postproc.estimation.priors import UNDETERMINED_SHARE, prior_of
from postproc.estimation.solving.step import Name
from postproc.identification.planning.design import choose
from postproc.identification.planning.standing import arm_length, can_work, moved_onto, standing_poses, working_box
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.model.scatter import remaining_fraction, spring_covariance
from postproc.model.uncertainty import derivatives
from postproc.robot.kinematics import forward, skew

NOISE: Mapping[str, float] = {"gauge": 1e-5, "tip": 5e-5, "plane": 5e-5, "distance": 2e-5, "position": 5e-5}
"""Kinds of set-ups, with the standard deviation [m] of a number that is read."""
LABELS: Mapping[str, str] = {"gauge": "G", "tip": "T", "plane": "F", "distance": "D", "position": "N"}
POOL = 600
"""Postures to choose from."""
JUDGED = 200
"""Postures over which the deflection that remains is counted."""
READABLE = 5e-5
"""Least change [m] that is worth a reading of a gauge."""
BACK = 0.05
"""Distance [m] from a tip or a plane at which the arm stops before it is touched."""
BAR = 0.3
"""Length [m] of the ball bar."""
FACING = np.cos(np.radians(60.0))
"""Cosine of the largest angle between the tool and what it touches."""
UNKNOWN_PLACE = 1.0
"""Standard deviation [m], [rad] of where a tip, a plane, an anchor or an instrument stands."""
FACES: Mapping[str, tuple[int, float]] = {"top": (2, 1.0), "front": (0, -1.0), "side": (1, 1.0)}
"""Faces of a cube that are touched: axis of the base and sign of the normal."""
CUBE = 0.12
"""Half the edge of the cube, over the arm's length."""
NO_PLACE = (Role.INSTRUMENT_FRAME, Role.JOINT_SPRINGS)
NEVER = 1e-3
"""Share of the largest derivative below which no set-up loads a spring."""
SEED = 43


@dataclass(frozen=True)
class SetupPlan:
    """Set-ups in the order in which they are measured.

    Args:
        model: of the arm; kind: of the set-ups, a key of `NOISE`.
        state: s postures with the load that is on when the last number is read.
        names: (s,) tip, plane or anchor of each, a name of its own for a gauge.
        direction: (s, 3) in which a gauge reads more, or of a plane's normal; zeros for other kinds.
        change: (s,) expected difference of the readings of a gauge [m], zeros for other kinds.
        begin: (s, 6) joint angles [rad] at `BACK` before the touch, those of the posture where nothing is touched.
        before, after: 95 % interval of the share of the deflection that remains after a correction, without and with
            the measurements (`remaining_fraction`).
        links: the same where the springs are known exactly: what the weights of the links leave.
        unknown: joints, from 0, of whose springs the measurements tell less than half; unloaded: those that no load of
            any set-up winds up.
    """

    model: Model
    kind: str
    state: State
    names: tuple[str, ...]
    direction: Array
    change: Array
    begin: Array
    before: tuple[float, float]
    after: tuple[float, float]
    links: tuple[float, float]
    unknown: tuple[int, ...]
    unloaded: tuple[int, ...]

    @property
    def ids(self) -> list[str]:
        """Names (s,) of the postures."""
        return [f"{LABELS[self.kind]}{i + 1:02d}" for i in range(len(self.state))]

    @property
    def loads(self) -> list[str]:
        """What hangs or pulls at the TCP at each set-up (s,), in words; empty for nothing."""
        wrench = np.zeros((len(self.state), 6)) if self.state.wrench is None else self.state.wrench
        pulls = [f"pull {abs(f).max():g} N towards {axis_words(f[:3])}" if f.any() else "" for f in wrench]
        return [f"{m:g} kg" if m else p for m, p in zip(np.asarray(self.state.payload_mass), pulls, strict=True)]

    @property
    def words(self) -> list[str]:
        """What is read or touched at each set-up (s,), in words."""
        if self.kind == "gauge":
            return [f"reads more towards {axis_words(d)}" for d in self.direction]
        return list(self.names)


def axis_words(direction: Array) -> str:
    """Return the axis of the base along which a vector (3,) points, such as ``-z (down)``."""
    k = int(np.argmax(np.abs(direction)))
    sign = "+" if direction[k] > 0 else "-"
    return f"{sign}{'xyz'[k]}" + (f" ({'up' if sign == '+' else 'down'})" if k == 2 else "")


@dataclass(frozen=True)
class _Postures:
    """n postures q (n, 6) [rad] at which something is read; fields as of `SetupPlan`, the normal points to the arm."""

    q: Array
    names: NDArray[np.str_]
    normal: Array
    begin: Array


@dataclass(frozen=True)
class _Pool:
    """c set-ups to choose from, each at one of the postures with one load.

    Args:
        state: (c) with the load. posture: (c,) number of its posture, of which one set-up is chosen at most.
        rows: (c, m, p + u) derivatives of the m numbers that are read, by p parameters and u unknowns of the shop.
        direction: (c, 3); change: (c,) as of `SetupPlan`.
    """

    state: State
    posture: NDArray[np.int_]
    rows: Array
    direction: Array
    change: Array


@dataclass(frozen=True, slots=True)
class Asked:
    """What is to be planned.

    Args:
        kind: a key of `NOISE`. load: mass that is hung on [kg]; pull: horizontal force [N] of a spring balance.
        sigma: standard deviation [m] of a number that is read, None for that of `NOISE`.
        box: (2, 3) corners of the region of the TCP [m], base axes; None for one in front of the arm.
    """

    kind: str
    load: float = 0.0
    pull: float = 0.0
    sigma: float | None = None
    box: Array | None = None


def plan_setups(model: Model, asked: Asked, count: int) -> SetupPlan:
    """Choose set-ups one after another so that least of the deflection is expected to remain (L-optimal, greedy).

    With parameters x of prior covariance P (joint compliances by their logarithms; joint offsets and the tool where
    positions count), a set-up that reads rows Z takes P to (P^-1 + Z^T Z / sigma^2)^-1. The next one is that which
    lowers tr(D P D^T) most, D the derivatives of the TCP under the load at postures all over the region.

    Raises:
        PostprocError: DAT024 where fewer set-ups are possible than are asked for.
    """
    arm, parameters, scale, P = _unknown(model, asked.kind)
    box = working_box(arm.robot) if asked.box is None else asked.box
    g = np.random.default_rng(SEED)
    q = standing_poses(arm.robot, arm.T_flange_tcp, box, POOL, g)
    postures = _postures(arm, asked.kind, q, box, g)
    pool = (_gauge_pool if asked.kind == "gauge" else _place_pool)(arm, parameters, scale, asked, postures)
    possible = len(np.unique(pool.posture))
    if possible < count or not len(q):
        message = f"{possible} set-ups can be measured here, and {count} are asked for"
        raise PostprocError.of("DAT024", message, help="widen `--region`, or take a heavier load (`--load`)")
    judged = _loaded(arm, q[:JUDGED], asked)
    judged = judged.rows(slice(len(judged) - max(len(judged) - JUDGED, JUDGED), None))
    D = derivatives(arm, judged, parameters)[0] * scale
    own = np.zeros((pool.rows.shape[2] - len(scale),) * 2)
    weigh = block_diag(np.einsum("nip,niq->pq", D, D), own)
    prior = block_diag(P, own + UNKNOWN_PLACE**2 * np.eye(len(own)))
    chosen, S = choose(pool.rows / (asked.sigma or NOISE[asked.kind]), prior, count, weigh, pool.posture)
    at = np.array(chosen)
    names, mass = postures.names[pool.posture[at]], np.asarray(pool.state.payload_mass)[at]
    at = at[np.lexsort((pool.state.q[at, 0], names, mass))]
    picked, begin = pool.state.rows(at), pool.posture[at]
    before, after, links = (remaining_fraction(arm, judged, C[:6, :6]) for C in (P, S, np.zeros((6, 6))))
    unknown = np.flatnonzero(np.diag(S)[:6] > UNDETERMINED_SHARE**2 * np.diag(P)[:6]).tolist()
    seen = np.abs(pool.rows[:, :, :6]).max(axis=(0, 1))
    unloaded = np.flatnonzero(seen < NEVER * seen.max()).tolist()
    return SetupPlan(
        *(arm, asked.kind, picked, tuple(postures.names[begin]), pool.direction[at], pool.change[at]),
        *(postures.begin[begin], before, after, links, tuple(unknown), tuple(unloaded)),
    )


def _unknown(model: Model, kind: str) -> tuple[Model, list[Name], Array, Array]:
    """Return the arm with what is unknown of it: names of the p parameters, their scales (p,), their covariance.

    A scale turns a parameter into one whose covariance (p, p) is the prior's: compliances count by their logarithms.
    """
    library, springs = effect_library(), effect_in_role(Role.JOINT_SPRINGS)
    effects = {e.key: e for e in model.effects if e.role is not Role.INSTRUMENT_FRAME}
    wanted = [springs.key, *(key for key in BASE if kind != "gauge" and library[key].role not in NO_PLACE)]
    for key in wanted:
        null = library[key].null()
        start = prior_of(null, model).value if key == springs.key else null.vector()
        effects.setdefault(key, null.with_vector(start))
    arm = model.with_effects(*effects.values())
    sizes = [effects[key].vector() if key == springs.key else prior_of(effects[key], arm).deviation() for key in wanted]
    parameters = [(key, i) for key, size in zip(wanted, sizes, strict=True) for i in range(len(size))]
    scale = np.concatenate(sizes)
    return arm, parameters, scale, block_diag(spring_covariance(arm), np.eye(len(scale) - 6))


def _loaded(arm: Model, q: Array, asked: Asked) -> State:
    """Return v n states of n postures (n, 6) [rad]: without a load, then with each pull, then with the mass.

    A weight on a hook hangs at the TCP; where the tool touches something it is bolted to the flange.
    """
    sideways = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])[: 4 * (asked.pull > 0)]
    force = np.vstack([np.zeros(3), asked.pull * sideways, np.zeros((int(asked.load > 0), 3))])
    mass = np.append(np.zeros(1 + len(sideways)), [asked.load] * (asked.load > 0))
    at = arm.T_flange_tcp[:3, 3] if asked.kind == "gauge" else np.zeros(3)
    return arm.state(
        np.tile(q, (len(mass), 1)),
        payload_mass=np.repeat(mass, len(q)),
        payload_center=np.tile(at, (len(mass) * len(q), 1)),
        wrench=np.repeat(np.hstack([force, np.zeros_like(force)]), len(q), axis=0) if asked.pull else None,
    )


def _postures(arm: Model, kind: str, q: Array, box: Array, g: np.random.Generator) -> _Postures:
    """Return the postures of a kind of set-ups: some q (n, 6) [rad] as they are, or moved onto what is touched there.

    Args:
        box: (2, 3) region [m], in whose lower middle a spike, a cube or the anchor of a ball bar stands.
    """
    n, middle = len(q), np.array([0.5, 0.5, 0.3]) @ np.diag(box[1] - box[0]) + box[0]
    name, normal, place = np.full(n, kind, dtype=object), np.zeros((n, 3)), np.tile(middle, (n, 1))
    if kind in ("gauge", "position"):
        return _Postures(q, name, normal, q)
    tool = arm.T_flange_tcp
    if kind == "plane":
        face, half = np.arange(n) % len(FACES), CUBE * arm_length(arm.robot)
        axis, side = (np.array(list(FACES.values()))[face, k] for k in (0, 1))
        name, normal = np.array(list(FACES), dtype=object)[face], side[:, None] * np.eye(3)[axis.astype(int)]
        place = place + half * np.where(normal != 0, normal, g.uniform(-1, 1, (n, 3)))
    elif kind == "distance":
        normal = g.normal(size=(n, 3))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        place = place + BAR * normal
    else:
        normal[:, 2] = 1.0
    q = moved_onto(arm.robot, tool, q, place)
    there = np.isfinite(q).all(axis=1)
    q, name, normal, place = q[there], name[there], normal[there], place[there]
    T = forward(arm.robot, q) @ tool
    back = -T[:, :3, 2] if kind == "tip" else normal
    begin = q if kind == "distance" else moved_onto(arm.robot, tool, q, place + BACK * back, turned=False)
    good = can_work(arm.robot, tool, box, q) & np.isfinite(begin).all(axis=1)
    good &= (kind == "distance") | (-np.sum(T[:, :3, 2] * normal, axis=1) > FACING)
    return _Postures(q[good], name[good], normal[good], begin[good])


def _gauge_pool(arm: Model, parameters: Sequence[Name], scale: Array, asked: Asked, at: _Postures) -> _Pool:
    """Return set-ups of a gauge along an axis of the base: the change of its reading by a load, where it is readable.

    Args:
        parameters, scale: as of `_unknown`, p each. at: the postures.
    """
    state, n = _loaded(arm, at.q, asked), len(at.q)
    many = len(state) // max(n, 1)
    moved = predict(arm, state)[:, :3, 3]
    D = derivatives(arm, state, parameters)[0] * scale
    moved, D = moved - np.tile(moved[:n], (many, 1)), D - np.tile(D[:n], (many, 1, 1))
    row, axis = np.nonzero(np.abs(moved) >= READABLE)
    way = np.sign(moved[row, axis])
    # The difference of two readings has twice the variance of one.
    rows = way[:, None, None] * D[row, axis][:, None] / np.sqrt(2.0)
    return _Pool(state.rows(row), row % max(n, 1), rows, way[:, None] * np.eye(3)[axis] + 0.0, np.abs(moved[row, axis]))


def _place_pool(arm: Model, parameters: Sequence[Name], scale: Array, asked: Asked, at: _Postures) -> _Pool:
    """Return set-ups in which the place of the TCP is read or touched, or its distance, without and with the mass.

    With what is unknown in the shop: a tip c (p - c), a plane (n p - d), an anchor c (|p - c|), the instrument's frame.

    Args:
        parameters, scale: as of `_unknown`, p each. at: the postures.
    """
    n, state = len(at.q), _loaded(arm, at.q, replace(asked, pull=0.0))
    posture = np.arange(len(state)) % max(n, 1)
    D = derivatives(arm, state, parameters)[0] * scale
    p, u = (forward(arm.robot, at.q) @ arm.T_flange_tcp)[posture, :3, 3], at.normal[posture]
    still, along = np.tile(np.eye(3), (len(p), 1, 1)), np.einsum("ni,nip->np", u, D)[:, None]
    if asked.kind == "plane":
        on_face = (at.names[posture][:, None] == np.array(list(FACES))).astype(float)
        unknown = on_face[:, :, None] * np.column_stack([p, np.ones(len(p))])[:, None]
        rows = np.concatenate([along, unknown.reshape(len(p), 1, -1)], axis=2)
    elif asked.kind == "distance":
        rows = np.concatenate([along, -u[:, None]], axis=2)
    else:
        rows = np.concatenate([D, still, *([-skew(p)] if asked.kind == "position" else [])], axis=2)
    return _Pool(state, posture, rows, u, np.zeros(len(p)))
