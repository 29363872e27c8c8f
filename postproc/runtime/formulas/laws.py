"""What the effects of a model do, found by asking them: constants, shares of loads, functions of one number.

No effect is known by its name. Each is asked at chosen states; where its answers are a sum of constants, of terms
linear in the loads and of functions of one joint angle or one joint torque, these are its law, exact. What is no such
sum is left to a function that is fitted (`fitted`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from postproc.arrays import Array
from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import Effect
from postproc.effects.contract import State
from postproc.model.arm import Model
from postproc.robot.kinematics import body_poses

JOINTS, BODIES, TOOL = slice(0, 6), slice(6, 48), slice(48, 54)
PLACES = 54
"""Coordinates of a displacement: six joints, six of each of seven bodies, six of the tool."""
SAME = 1e-9
"""Difference [rad, m] below which two displacements are one; loads: relative to the largest."""
PROBES = 96

OfOne = Callable[[Array], Array]
"""A function of one number for many values, (n,) to (n,)."""
Asked = Callable[[Array], tuple[Array, Mapping[int, Array]]]
"""Torques (n, 6) on joints and wrenches (n, 6) on bodies at joint angles (n, 6)."""


@dataclass(frozen=True)
class Laws:
    """Displacements and loads of effects as sums.

    Args:
        constant: (54,) [rad, m]. by_load: (54, 48) per load on a joint [N m] or at the end of a body [N, N m].
        of_angle, of_torque: functions of a joint's angle [rad] or torque [N m], by place and joint (from 0).
        torque: torques on joints [N m] as functions of an angle [rad], by joint and joint.
        mass: (7,) [kg] and first_moment: (7, 3) [kg m] on bodies, in their axes.
        exact: keys of the effects of which this is everything; fitted: keys of those that are not such a sum.
    """

    constant: Array = field(default_factory=lambda: np.zeros(PLACES))
    by_load: Array = field(default_factory=lambda: np.zeros((PLACES, 48)))
    of_angle: Mapping[tuple[int, int], tuple[OfOne, ...]] = field(default_factory=dict)
    of_torque: Mapping[tuple[int, int], tuple[OfOne, ...]] = field(default_factory=dict)
    torque: Mapping[tuple[int, int], tuple[OfOne, ...]] = field(default_factory=dict)
    mass: Array = field(default_factory=lambda: np.zeros(7))
    first_moment: Array = field(default_factory=lambda: np.zeros((7, 3)))
    exact: tuple[str, ...] = ()
    fitted: tuple[str, ...] = ()

    def plus(self, other: Laws) -> Laws:
        """The sum of two laws."""
        return Laws(
            self.constant + other.constant,
            self.by_load + other.by_load,
            _both(self.of_angle, other.of_angle),
            _both(self.of_torque, other.of_torque),
            _both(self.torque, other.torque),
            self.mass + other.mass,
            self.first_moment + other.first_moment,
            self.exact + other.exact,
            self.fitted + other.fitted,
        )


Curves = Mapping[tuple[int, int], tuple[OfOne, ...]]


def _both(a: Curves, b: Curves) -> Curves:
    return {key: a.get(key, ()) + b.get(key, ()) for key in {**a, **b}}


def laws_of(model: Model, states: State, loads: Array) -> Laws:
    """The laws of the effects of a model.

    Args:
        states: at least `PROBES` states of the region in which the laws are asked for, with payload and wrench.
        loads: (48,) largest loads that are met there [N, N m].
    """
    found = Laws()
    for effect in model.effects:
        share = _displacement_law(model, effect, states, loads)
        law = None if share is None else _load_law(model, effect, states)
        if share is None or law is None:
            found = found.plus(Laws(fitted=(effect.key,)))
        else:
            found = found.plus(share).plus(law).plus(Laws(exact=(effect.key,)))
    return found


def _asked(model: Model, effect: Effect, states: State, q: Array, load: Array) -> Array:
    """(n, 54) the displacement by one effect at joint angles (n, 6) and loads (n, 48)."""
    n = len(q)
    rows = states.rows(np.zeros(n, dtype=int)).with_(
        q=q,
        robot=model.robot,
        gravity=model.gravity,
        T_base_body=body_poses(model.robot, q),
        joint_load=load[:, :6],
        body_load=load[:, 6:].reshape(n, 7, 6),
    )
    share = displacement_of(effect, rows)
    result = np.zeros((n, PLACES))
    if share.joint is not None:
        result[:, JOINTS] = share.joint
    for b, xi in share.body.items():
        result[:, 6 + 6 * b : 12 + 6 * b] = xi
    if share.tool is not None:
        result[:, TOOL] = share.tool
    return result


def _displacement_law(model: Model, effect: Effect, states: State, loads: Array) -> Laws | None:
    """The displacement by an effect as a sum, None where it is none."""
    q, (still, nothing) = states.q[:PROBES], (states.q[:1], np.zeros((1, 48)))
    w = loads * np.random.default_rng(0).uniform(-1.0, 1.0, (len(q), 48))

    def ask(angles: Array, load: Array) -> Array:
        n = max(len(angles), len(load))
        return _asked(model, effect, states, np.broadcast_to(angles, (n, 6)), np.broadcast_to(load, (n, 48)))

    constant, whole = ask(still, nothing)[0], ask(q, w)
    alone = np.array([ask(_only(q, j, still), nothing) - constant for j in range(6)])
    twisted = np.array([ask(still, _only(w, j, nothing)) - constant for j in range(6)])
    unit = (ask(still, np.diag(loads)) - constant) / loads[:, None]
    left = whole - constant - alone.sum(axis=0)
    straight, bent = left - w @ unit, left - w[:, 6:] @ unit[6:] - twisted.sum(axis=0)
    if np.abs(bent).max() > SAME:
        return None
    of_angle = {
        (int(p), j): (lambda x, p=p, j=j: ask(_only(np.outer(x, np.ones(6)), j, still), nothing)[:, p] - constant[p],)
        for j in range(6)
        for p in np.flatnonzero(np.abs(alone[j]).max(axis=0) > 1e-3 * SAME)
    }
    if np.abs(straight).max() <= SAME:
        return Laws(constant, unit.T, of_angle)
    of_torque = {
        (int(p), j): (lambda x, p=p, j=j: ask(still, _only(np.outer(x, np.ones(48)), j, nothing))[:, p] - constant[p],)
        for j in range(6)
        for p in np.flatnonzero(np.abs(twisted[j]).max(axis=0) > 1e-3 * SAME)
    }
    unit[:6] = 0.0
    return Laws(constant, unit.T, of_angle, of_torque)


def _only(values: Array, column: int, rest: Array) -> Array:
    """Rows that differ from the row ``rest`` (1, m) in one column, which they take from ``values`` (n, m)."""
    rows = np.repeat(rest, len(values), axis=0)
    rows[:, column] = values[:, column]
    return rows


def _load_law(model: Model, effect: Effect, states: State) -> Laws | None:
    """The loads of an effect as compact masses and torques of single angles, None where they are no such sum."""

    def ask(q: Array) -> tuple[Array, Mapping[int, Array]]:
        rows = states.rows(np.zeros(len(q), dtype=int)).with_(
            q=q, robot=model.robot, gravity=model.gravity, T_base_body=body_poses(model.robot, q)
        )
        share = load_of(effect, rows)
        return np.zeros((len(q), 6)) if share.joint is None else share.joint, share.body

    q, still = states.q[:PROBES], states.q[:1]
    torque, bodies = ask(q)
    first = ask(still)[0]
    alone = np.array([ask(_only(q, j, still))[0] - first for j in range(6)])
    if np.abs(torque - first - alone.sum(axis=0)).max() > SAME * max(1.0, np.abs(torque).max()):
        return None
    curves: dict[tuple[int, int], tuple[OfOne, ...]] = {}
    for k in range(6):
        moved = [j for j in range(6) if np.abs(alone[j, :, k]).max() > 0.0]
        # A constant torque goes with the first angle that it has, or with that of its own joint.
        for j in moved or ([k] if first[0, k] else []):
            level = first[0, k] if j == (moved or [k])[0] else 0.0
            curves[k, j] = (_torque_of(ask, still, k, j, level - first[0, k]),)
    mass, moment = np.zeros(7), np.zeros((7, 3))
    poses = body_poses(model.robot, q)
    for b, wrench in bodies.items():
        found = _compact_mass(poses[:, b], wrench, model.gravity)
        if found is None:
            return None
        mass[b], moment[b] = found
    return Laws(torque=curves, mass=mass, first_moment=moment)


def _torque_of(ask: Asked, still: Array, joint: int, angle: int, level: float) -> OfOne:
    """Torque on a joint as a function of one angle, with a constant added [N m]."""
    return lambda x: np.asarray(ask(_only(np.outer(x, np.ones(6)), angle, still))[0][:, joint] + level)


def _compact_mass(T: Array, wrench: Array, gravity: Array) -> tuple[float, Array] | None:
    """Mass [kg] and first moment (3,) [kg m] whose weight on a body (n, 4, 4) is the wrench (n, 6), if any."""
    n, (gx, gy, gz) = len(T), gravity
    across = -np.array([[0.0, -gz, gy], [gz, 0.0, -gx], [-gy, gx, 0.0]])
    force = np.hstack([np.tile(gravity, n)[:, None], np.zeros((3 * n, 3))])
    # (o + R c) x g is linear in m and m c.
    about = np.hstack([np.cross(T[:, :3, 3], gravity).reshape(-1, 1), (across @ T[:, :3, :3]).reshape(-1, 3)])
    columns, wanted = np.vstack([force, about]), np.concatenate([wrench[:, :3].ravel(), wrench[:, 3:].ravel()])
    x = np.linalg.lstsq(columns, wanted, rcond=None)[0]
    same = np.abs(columns @ x - wanted).max() <= SAME * max(1.0, np.abs(wanted).max())
    return (float(x[0]), x[1:]) if same else None
