"""Measurements to begin with, chosen without a table: postures, loads and directions of what a shop can read.

A set-up is one posture at which something is read: a dial gauge without and with a load, a tip that is touched, a plane
that a search finds, the length of a ball bar, a position.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.diagnostics import PostprocError
from postproc.effects.registry import effect_in_role
from postproc.effects.roles import Role
from postproc.estimation.priors import UNDETERMINED_SHARE, prior_of
from postproc.identification.planning.design import choose, updated
from postproc.identification.planning.standing import arm_length, can_work, moved_onto, random_postures, working_box
from postproc.identification.planning.weld_targets import WeldTargets, weld_weight
from postproc.measure.kinds.base import POINT, TILT, UNKNOWNS, Read, ReadingKind, Seen
from postproc.measure.kinds.distance import Distance
from postproc.measure.kinds.gauge import Gauge
from postproc.measure.kinds.plane import Plane
from postproc.measure.kinds.tip import Tip
from postproc.model.arm import Model
from postproc.model.uncertainty.prediction import Uncertainty, error_directions, read_uncertainty
from postproc.model.uncertainty.scatter import deflection_shares, deflection_slopes, scatter_covariance, scatter_of
from postproc.robot.kinematics import forward, jacobian, skew


class Position(ReadingKind):
    """Three coordinates in the frame of an instrument, whose six numbers are unknown."""

    column = ""
    reading = ("x_mm", "y_mm", "z_mm")
    noise = 5e-5

    def read(self, seen: Seen) -> Read:
        """Return p (m, 3), as if the instrument stood at the base."""
        still = np.tile(np.eye(3), (len(seen.point), 1, 1))
        return Read(seen.point, still, np.concatenate([still, -skew(seen.point)], axis=2))

    def start(self, seen: Seen, numbers: Array) -> Array:
        """Return the base frame: planned positions are nominal ones."""
        return np.zeros(6)


SHOP = {"gauge": Gauge(), "tip": Tip(), "plane": Plane(), "distance": Distance(), "position": Position()}
"""What can be planned without a table."""
DRAWN, POOL = 2500, 600
"""Random postures, and the most of them to choose from that somebody can work at."""
JUDGED = 200
"""Postures over which the deflection that remains is counted."""
READABLE = 5e-5
"""Least change [m] that is worth a reading of a gauge."""
BACK_OFF = 0.05
"""Distance [m] from a tip or a plane at which the arm stops before it is touched."""
BAR = 0.3
"""Length [m] of the ball bar."""
FACING = np.cos(np.radians(60.0))
"""Cosine of the largest angle between the tool and what it touches."""
UNKNOWN_PLACE = 1.0
"""Standard deviation [m], [rad] of where a tip, a plane, an anchor or an instrument stands."""
UNKNOWN_GEOMETRY = 1e-3
"""Standard deviation of a joint offset [rad] and of each coordinate of the TCP [m] before anything is measured."""
FACES: Mapping[str, tuple[float, float]] = {"top": (0.0, 0.0), "front": (0.0, -np.pi / 2), "side": (-np.pi / 2, 0.0)}
"""Faces of a cube that are touched, each turned from the base's z by a rotation vector (a, b, 0) [rad]."""
CUBE = 0.12
"""Half the edge of the cube, over the arm's length."""
KNOWN = 12
"""Parameters of which an arm's type tells something: six springs and six masses."""
NEVER_LOADED = 1e-3
"""Share of the largest derivative below which no set-up loads a spring."""
SETUPS_SEED = 43


@dataclass(frozen=True)
class SetupPlan:
    """Set-ups in the order in which they are measured.

    Args:
        model: of the arm; kind: of the set-ups, a key of `SHOP`.
        state: s postures with the load that is on when the last number is read.
        names: (s,) tip, plane or anchor of each, a name of its own for a gauge.
        direction: (s, 3) in which a gauge reads more, else from what is touched to the arm.
        change: (s,) expected difference of the readings of a gauge [m], zeros for other kinds.
        begin: (s, 6) joint angles [rad] at `BACK_OFF` before the touch, those of the posture where nothing is touched.
        remaining: 95 % interval of the share of the deflection that remains after a correction (`scatter_of`), without
            the measurements (``before``) and with them (``after``); with ``of_loads_`` before it, of the deflection by
            the loads alone, without the weights of the links.
        unknown: joints, from 0, of whose springs the measurements tell less than half; unloaded: those that no load of
            any set-up winds up.
        programs: for which the set-ups were chosen, each with the 95 % interval of the largest deviation on the arm
            where it welds [mm], once they are measured.
    """

    model: Model
    kind: str
    state: State
    names: tuple[str, ...]
    direction: Array
    change: Array
    begin: Array
    remaining: Mapping[str, tuple[float, float]]
    unknown: tuple[int, ...]
    unloaded: tuple[int, ...]
    programs: tuple[tuple[WeldTargets, list[float]], ...] = ()

    @property
    def ids(self) -> list[str]:
        """Names (s,) of the postures."""
        return [f"{self.kind[0].upper()}{i + 1:02d}" for i in range(len(self.state))]

    @property
    def loads(self) -> list[str]:
        """What hangs or pulls at the TCP at each set-up (s,), in words; empty for nothing."""
        force = np.zeros((len(self.state), 3)) if self.state.wrench is None else self.state.wrench[:, :3]
        pulls = [f"{abs(f).max():g} N towards {self._axis(f)}" if f.any() else "" for f in force]
        return [f"{m:g} kg" if m else p for m, p in zip(np.asarray(self.state.payload_mass), pulls, strict=True)]

    @property
    def load_direction(self) -> Array:
        """Direction (s, 3) of the load of each set-up, base axes: that of a pull, or of gravity."""
        down = -np.tile(self.model.R_world_base[2], (len(self.state), 1))
        if self.state.wrench is None:
            return down
        return np.where(self.state.wrench[:, :3].any(axis=1, keepdims=True), self.state.wrench[:, :3], down)

    @property
    def words(self) -> list[str]:
        """What is read or touched at each set-up (s,): the direction in which a gauge reads more, else a name."""
        return [self._axis(d) for d in self.direction] if self.kind == "gauge" else list(self.names)

    def _axis(self, vector: Array) -> str:
        """Return the axis of the base along which a vector (3,) points, such as ``-z (down)``."""
        k = int(np.argmax(np.abs(vector)))
        up = float(np.sign(vector[k]) * self.model.R_world_base[2, k])
        way = {1: " (up)", -1: " (down)"}.get(round(up), "")
        return f"{'-' if vector[k] < 0 else '+'}{'xyz'[k]}{way}"


@dataclass(frozen=True)
class _Pool:
    """c set-ups to choose from, each at one of some postures with one load.

    Args:
        state, names, direction, change, begin: as of `SetupPlan`. posture: (c,) number of its posture, of which one
            set-up is chosen at most.
        rows: (c, k, 12 + e + p + u) derivatives of the k numbers that are read: by what the type leaves unknown, by the
            causes of error that a fit knows of, by geometry, and by u unknowns of the shop. fitted: e. others: prior
            covariances (p, p) and (u, u).
    """

    state: State
    names: NDArray[np.str_]
    direction: Array
    change: Array
    begin: Array
    posture: NDArray[np.int_]
    rows: Array
    fitted: int
    others: tuple[Array, Array]


@dataclass(frozen=True, slots=True)
class Request:
    """What is to be planned.

    Args:
        kind: a key of `SHOP`. load: mass that is hung on [kg]; pull: horizontal force [N] of a spring balance.
        sigma: standard deviation [m] of a number that is read, None for what is usual.
        box: (2, 3) corners of the region of the TCP [m], base axes; None for one in front of the arm.
    """

    kind: str
    load: float = 0.0
    pull: float = 0.0
    sigma: float | None = None
    box: Array | None = None


def plan_setups(
    model: Model, request: Request, count: int, programs: Callable[[Model], Sequence[WeldTargets]] | None = None
) -> SetupPlan:
    """Choose set-ups one after another so that least of the deflection is expected to remain (L-optimal, greedy).

    With parameters of prior covariance P (logarithms of joint compliances and of masses of the links; joint offsets and
    the tool where places count), a set-up that reads rows Z takes P to (P^-1 + Z^T Z / sigma^2)^-1. The next one is
    that which lowers tr(D P D^T) most, D the derivatives of the TCP under the loads at postures all over the region.
    For programs D are those at their weld targets under their loads, by the causes of error that the model's fit knows
    of, where it has one (`error_directions`).

    Args:
        programs: returns those that the set-ups are for, as a model corrects them; None for none.

    Raises:
        PostprocError: DAT024 where fewer set-ups are possible than are asked for.
    """
    springs, arm = effect_in_role(Role.JOINT_SPRINGS).null(), model
    if arm.in_role(Role.JOINT_SPRINGS) is None:  # then those of its type
        arm = model.with_effects(*model.effects, springs.with_vector(prior_of(springs, model).value))
    known, welds = (None, ()) if programs is None else (read_uncertainty(arm), programs(arm))
    g, kind = np.random.default_rng(SETUPS_SEED), request.kind
    box = working_box(arm.robot) if request.box is None else request.box
    pool = _pool(arm, request, box, g, known)
    if (possible := len(np.unique(pool.posture))) < count:
        message = f"{possible} set-ups can be measured here, and {count} are asked for"
        raise PostprocError.of("DAT024", message, help="widen `--region`, or load it more (`--load`, `--pull`)")
    q = _postures(arm, "position", box, g)[0][:JUDGED]
    judged = _loaded(arm, q, request)
    judged = judged.rows(slice(-max(len(judged) - len(q), len(q)), None))
    # What the type leaves unknown, and what a fit does; in either case beside geometry and places of what is touched.
    whitened, end = pool.rows / (request.sigma or SHOP[kind].noise), KNOWN + pool.fitted
    of_type, others = np.delete(whitened, slice(KNOWN, end), axis=2), block_diag(*pool.others)
    P = block_diag(scatter_covariance(arm), others)
    Z, prior = of_type, P
    wanted = [D for one in welds for D in one.slopes()] or [_columns(arm, judged, kind)[0]]
    if known is not None:
        Z, prior = whitened[:, :, KNOWN:], block_diag(np.eye(pool.fitted), others)
        wanted = [one.errors(known) for one in welds]
    weigh, W = np.zeros_like(prior), weld_weight(wanted)
    weigh[: len(W), : len(W)] = W
    groups = np.column_stack([pool.posture, np.unique(pool.names, return_inverse=True)[1]])
    chosen, open_causes = choose(Z, prior, count, weigh, groups)
    at = np.array(chosen)
    at = at[np.lexsort((pool.state.q[at, 0], pool.names[at], np.asarray(pool.state.payload_mass)[at]))]
    S = updated(P, of_type[at].reshape(-1, len(P)))
    cases = {"before": (P, True), "after": (S, True), "of_loads_before": (P, False), "of_loads_after": (S, False)}
    remaining = {key: scatter_of(arm, judged, C[:KNOWN, :KNOWN], all_).remaining for key, (C, all_) in cases.items()}
    unknown = np.flatnonzero(np.diag(S)[:6] > UNDETERMINED_SHARE**2 * np.diag(P)[:6]).tolist()
    loading = np.abs(pool.rows[:, :, :6]).max(axis=(0, 1))
    unloaded = np.flatnonzero(loading < NEVER_LOADED * loading.max()).tolist()
    after = []
    for one in welds:
        shares = one.shares_after(S[:KNOWN, :KNOWN]) if known is None or one.scatter else (0.0, 0.0)
        errors = (0.0, 0.0) if known is None else one.errors_after(known, open_causes[: len(W), : len(W)])
        after.append(one.on_arm(shares, errors))
    state, names, begin = pool.state.rows(at), tuple(pool.names[at]), pool.begin[at]
    setups = (arm, kind, state, names, pool.direction[at], pool.change[at], begin)
    return SetupPlan(*setups, remaining, tuple(unknown), tuple(unloaded), tuple(zip(welds, after, strict=True)))


def _loaded(arm: Model, q: Array, request: Request) -> State:
    """Return v n states of n postures (n, 6) [rad]: without a load, then with each pull, then with the mass.

    A weight on a hook hangs at the TCP; where the tool touches something it is bolted to the flange.
    """
    sideways = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])[: 4 * (request.pull > 0)]
    force = np.vstack([np.zeros(3), request.pull * sideways, np.zeros((int(request.load > 0), 3))])
    mass = np.append(np.zeros(1 + len(sideways)), [request.load] * (request.load > 0))
    at = arm.T_flange_tcp[:3, 3] if request.kind == "gauge" else np.zeros(3)
    return arm.state(
        np.tile(q, (len(mass), 1)),
        payload_mass=np.repeat(mass, len(q)),
        payload_center=np.tile(at, (len(mass) * len(q), 1)),
        wrench=np.repeat(np.hstack([force, np.zeros_like(force)]), len(q), axis=0) if request.pull else None,
    )


def _columns(arm: Model, state: State, kind: str, known: Uncertainty | None = None) -> tuple[Array, Array]:
    """Return derivatives (n, 3, 12 + e + p) of the TCP [m], and its deflection (n, 3) [m], to first order.

    They are by the logarithms of the compliances and of the masses of bodies 1 to 6, then by what a fit knows of its
    errors; but for a gauge, which sees changes alone, then by joint offsets and the coordinates of the tool, by their
    standard deviations, unless the fit knows other parameters than springs.
    """
    x = deflection_shares(arm, state)
    D = deflection_slopes(x)
    geometry = kind != "gauge"
    if known is not None:
        D = np.concatenate([D, error_directions(arm, state, known, instrument=False)], axis=2)
        of_loads = {effect.key for role in (Role.JOINT_SPRINGS, Role.SETUPS) if (effect := arm.in_role(role))}
        geometry &= {key for key, _ in known.all_parameters} <= of_loads
    if geometry:
        turned = (forward(arm.robot, state.q) @ arm.T_flange_tcp)[:, :3, :3]
        moved = np.concatenate([jacobian(arm.robot, state.q, arm.T_flange_tcp)[:, :3], turned], axis=2)
        D = np.concatenate([D, UNKNOWN_GEOMETRY * moved], axis=2)
    return D, x.sum(axis=(0, 1))


def _postures(arm: Model, kind: str, box: Array, g: np.random.Generator) -> tuple[Any, ...]:
    """Return postures of a kind of set-ups at which somebody can work: anywhere in a box, or on what is touched there.

    Args:
        box: (2, 3) region [m], in whose lower middle a spike, a cube or the anchor of a ball bar stands.

    Returns:
        Of n postures the joint angles (n, 6) [rad], names and joint angles to begin with as of `SetupPlan`, directions
        (n, 3) from what is touched to the arm, and unknowns (n, 6) of the set-ups.
    """
    touches = SHOP[kind].touches
    n, middle = DRAWN, box[0] + np.array([0.5, 0.5, 0.3]) * (box[1] - box[0])
    name, unknown = np.full(n, SHOP[kind].column or kind, dtype=object), np.zeros((n, 6))
    normal, place = np.tile([0.0, 0.0, 1.0], (n, 1)), np.tile(middle, (n, 1))
    if kind == "plane":
        face = np.arange(n) % len(FACES)
        name, unknown[:, TILT] = np.array(list(FACES), dtype=object)[face], np.array(list(FACES.values()))[face]
        normal = Rotation.from_rotvec(unknown[:, 3:]).apply(normal).round(9)
        across = g.uniform(-1, 1, (n, 3)) * (normal == 0)
        place = place + CUBE * arm_length(arm.robot) * (normal + across)
    elif kind == "distance":
        normal = g.normal(size=(n, 3))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        place, unknown[:, POINT] = place + BAR * normal, middle
    elif kind != "tip":
        place = g.uniform(box[0], box[1], (n, 3))
    q = moved_onto(arm, random_postures(arm.robot, n, g), place)
    good = np.flatnonzero(can_work(arm, box, q))
    q, name, normal, place, unknown = q[good], name[good], normal[good], place[good], unknown[good]
    tool = (forward(arm.robot, q) @ arm.T_flange_tcp)[:, :3, 2]
    back = -tool if kind == "tip" else normal
    begin = moved_onto(arm, q, place + BACK_OFF * back, turned=False) if touches else q
    good = np.isfinite(begin).all(axis=1) & ((-np.sum(tool * normal, axis=1) > FACING) | (not touches))
    return tuple(x[good][:POOL] for x in (q, name, begin, normal, unknown))


def _pool(arm: Model, request: Request, box: Array, g: np.random.Generator, known: Uncertainty | None = None) -> _Pool:
    """Return the set-ups at some postures: a gauge along each axis of the base where its change is readable, else each
    posture without and with the mass.

    Args:
        box: (2, 3) region [m]. known: what a fit of the arm knows of its errors; None for none.
    """
    gauge = request.kind == "gauge"
    q, names, begin, normal, unknown = _postures(arm, request.kind, box, g)
    state = _loaded(arm, q, request if gauge else replace(request, pull=0.0))
    posture = np.arange(len(state)) % max(len(q), 1)
    D, moved = _columns(arm, state, request.kind, known)
    direction, change = normal[posture], np.zeros(len(state))
    if gauge:  # the difference of two readings has no zero, and twice the variance of one
        moved, D = moved - moved[posture], (D - D[posture]) / np.sqrt(2.0)
        row, axis = np.nonzero(np.abs(moved) >= READABLE)
        direction, change = np.sign(moved[row, axis])[:, None] * np.eye(3)[axis] + 0.0, np.abs(moved[row, axis])
        state, D, posture = state.rows(row), D[row], posture[row]
    p = (forward(arm.robot, state.q) @ arm.T_flange_tcp)[:, :3, 3]
    nowhere, names = np.full_like(p, np.nan), names[posture]
    read = SHOP[request.kind].read(Seen(p, unknown[posture], direction, np.zeros(len(p)), nowhere))
    rows = np.einsum("ckx,cxp->ckp", read.by_point, D)
    if not gauge:
        of_name = (names[:, None] == np.unique(names)).astype(float)
        by_unknown = np.einsum("cku,cs->cksu", read.by_unknown, of_name)
        rows = np.concatenate([rows, by_unknown.reshape(*rows.shape[:2], of_name.shape[1] * UNKNOWNS)], axis=2)
    fitted = 0 if known is None else len(known.parameters) + len(known.unseen) + len(known.link_mass)
    others = np.eye(D.shape[2] - KNOWN - fitted), UNKNOWN_PLACE**2 * np.eye(rows.shape[2] - D.shape[2])
    return _Pool(state, names, direction, change, begin[posture], posture, rows, fitted, others)
