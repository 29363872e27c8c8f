"""The tables of the function from a model: what its effects do, asked over the region, and curves of one number.

No effect is known by its name. One that says what goes into the tables is believed; every other is asked at chosen
states. Where its answers are a sum of what the tables hold, the terms of that sum are its entries; else it is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.diagnostics import PostprocError
from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import Effect
from postproc.effects.run_time import Law, Laws, RunTimeTables
from postproc.model.arm import Model
from postproc.model.equilibrium import equilibrium
from postproc.robot.kinematics import body_poses, skew
from postproc.runtime.conditions import Conditions, known_effects

SAME = 1e-9
"""Difference [rad, m] below which two displacements are one; loads: relative to the largest."""
PROBES = 96
LOADS = 48
"""Numbers of a load: torques on six joints, force and moment at the ends of seven bodies."""
FINE, FINE_NM = 2e-8, 0.01
"""What a curve may be off [rad, N m]."""
TORQUE_SPAN = 1.5
"""How far beyond the largest torque of the region functions of a torque are tabulated."""
COARSEST, FINEST = 8, 4096
"""Numbers of intervals of a curve that are tried, each twice the one before."""


@dataclass(frozen=True)
class CorrectedModel:
    """The part of a model that is corrected at run time.

    Args:
        model: the arm with the effects that are corrected.
        tables: sum of what these effects contribute.
        untold: keys of effects that depend on what a target does not state.
        unfit: keys of effects whose formula the tables cannot represent.
        largest: (48,) largest loads on joints and ends of bodies over the region [N m, N], 1.5 at least.
    """

    model: Model
    tables: RunTimeTables
    untold: tuple[str, ...]
    unfit: tuple[str, ...]
    largest: Array

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the effects that are corrected."""
        return tuple(effect.key for effect in self.model.effects)


def corrected_model(model: Model, conditions: Conditions) -> CorrectedModel:
    """The part of a model that the tables of the run-time function can represent.

    Raises:
        PostprocError: RUN006, the region holds nothing but singular poses; MOD010, the loads of the arm do not settle.
    """
    if np.any(conditions.lower > conditions.upper) or len(conditions.drawn(PROBES, 1)) < PROBES:
        text = "the region holds nothing but singular poses, or lies beyond the limits of the arm"
        raise PostprocError.of("RUN006", text, help="give a region in which axis 5 is bent", exit_code=1)
    known, untold = known_effects(model, conditions.channels)
    states = conditions.states(conditions.drawn(PROBES, 1))
    largest = _largest_loads(known, conditions)
    shares = {e.key: _shares(known, e, states, largest) for e in known.effects}
    kept = known.with_effects(*(e for e in known.effects if shares[e.key] is not None))
    tables = RunTimeTables()
    for share in shares.values():
        tables = tables if share is None else tables.plus(share)
    return CorrectedModel(kept, tables, untold, tuple(key for key, share in shares.items() if share is None), largest)


def _largest_loads(model: Model, conditions: Conditions) -> Array:
    """(48,) largest loads over the region, times 1.5 and never below 1.5 (1 if no effect reads loads).

    They are torques on joints [N m], then force and moment at the ends of the seven bodies [N, N m].
    """
    settled = equilibrium(model, conditions.states(conditions.drawn(400, 4)), tuple(range(7))).state
    if settled.joint_load is None or settled.body_load is None:
        return np.ones(LOADS)
    loads = np.abs(np.hstack([settled.joint_load, settled.body_load.reshape(-1, LOADS - 6)])).max(axis=0)
    return np.asarray(TORQUE_SPAN * np.maximum(loads, 1.0))


def _shares(model: Model, effect: Effect, states: State, largest: Array) -> RunTimeTables | None:
    """What an effect contributes to the tables, found at states and loads up to ``largest`` (48,); None if unfit."""
    stated = effect.run_time_tables()
    if stated is not None:
        return stated
    moved = _Probe(model, effect, states).displacement(largest)
    loaded = _Probe(model, effect, states).load()
    return None if moved is None or loaded is None else moved.plus(loaded)


@dataclass(frozen=True)
class _Probe:
    """An effect that is evaluated at states of the region to find its entries in the tables."""

    model: Model
    effect: Effect
    states: State

    def displacement(self, largest: Array) -> RunTimeTables | None:
        """The effect's displacements as table entries; None if the entries do not reproduce them at random states.

        Args:
            largest: (48,) loads within which it is evaluated.
        """
        q = self.states.q[:PROBES]
        w = largest * np.random.default_rng(0).uniform(-1.0, 1.0, (len(q), LOADS))
        still, nothing = q[:1], np.zeros((1, LOADS))
        joint, body = (part[0] for part in self.moves(still, nothing)[:2])
        turned = [self.moves(_alone(q[:, j], j, still), nothing)[0] - joint for j in range(6)]
        twisted = [self.moves(still, _alone(w[:, j], j, nothing))[0] - joint for j in range(6)]
        unit = [part / largest[:, None] for part in self.moves(still, np.diag(largest))[:2]]
        unit = [unit[0] - joint / largest[:, None], unit[1] - body / largest[:, None]]
        compliance = np.array([unit[1][6 + 6 * b :, 6 * b : 6 * b + 6][:6].T for b in range(7)])
        by_its_torque = np.stack([twisted[j][:, j] for j in range(6)], axis=1)
        bent = np.einsum("bik,nbk->nbi", compliance, w[:, 6:].reshape(-1, 7, 6)).reshape(len(q), -1)
        expected = joint + sum(turned) + by_its_torque, body + bent, np.zeros(6)
        if any(np.abs(a - b).max() > SAME for a, b in zip(self.moves(q, w), expected, strict=True)):
            return None
        linear = np.abs(by_its_torque - w[:, :6] * np.diag(unit[0])).max(axis=0) <= SAME
        return RunTimeTables(
            joint,
            np.where(linear, np.diag(unit[0]), 0.0),
            body.reshape(7, 6),
            compliance,
            by_angle={
                (int(p), j): (self._of_angle(int(p), j),)
                for j in range(6)
                for p in np.flatnonzero(np.abs(turned[j]).max(axis=0) > 1e-3 * SAME)
            },
            by_torque={(int(j), int(j)): (self._of_torque(int(j)),) for j in np.flatnonzero(~linear)},
        )

    def _of_angle(self, joint: int, source: int) -> Law:
        """Displacement of a joint (n,) [rad] by the angle of joint ``source`` (n,) [rad], less a constant."""
        still, nothing = self.states.q[:1], np.zeros((1, LOADS))
        level = self.moves(still, nothing)[0][0, joint]
        return lambda x: self.moves(_alone(x, source, still), nothing)[0][:, joint] - level

    def _of_torque(self, joint: int) -> Law:
        """Displacement of a joint (n,) [rad] by the torque on it (n,) [N m], less that without torque."""
        still, nothing = self.states.q[:1], np.zeros((1, LOADS))
        level = self.moves(still, nothing)[0][0, joint]
        return lambda x: self.moves(still, _alone(x, joint, nothing))[0][:, joint] - level

    def _torque(self, joint: int, source: int, less: float) -> Law:
        """Torque on a joint (n,) [N m] by the angle of joint ``source`` (n,) [rad], less a constant [N m]."""
        still = self.states.q[:1]
        return lambda x: self.pushes(_alone(x, source, still))[0][:, joint] - less

    def load(self) -> RunTimeTables | None:
        """The effect's loads as point masses on bodies and torques by angle; None if these do not reproduce them."""
        q, still = self.states.q[:PROBES], self.states.q[:1]
        torque, wrenches = self.pushes(q)
        first = self.pushes(still)[0][0]
        turned = np.array([self.pushes(_alone(q[:, j], j, still))[0] - first for j in range(6)])
        if np.abs(torque - first - turned.sum(axis=0)).max() > SAME * max(1.0, np.abs(torque).max()):
            return None
        laws: dict[tuple[int, int], tuple[Law, ...]] = {}
        for k in range(6):
            moved = [j for j in range(6) if np.abs(turned[j, :, k]).max() > 0.0]
            # A constant torque goes with the first angle that it has, or with that of its own joint.
            for j in moved or ([k] if first[k] else []):
                extra = 0.0 if j == (moved or [k])[0] else first[k]
                laws[k, j] = (self._torque(k, j, extra),)
        mass, moment, poses = np.zeros(7), np.zeros((7, 3)), body_poses(self.model.robot, q)
        for b, wrench in wrenches.items():
            compact = _compact_mass(poses[:, b], wrench, self.model.gravity)
            if compact is None:
                return None
            mass[b], moment[b] = compact
        return RunTimeTables(torque=laws, mass=mass, first_moment=moment)

    def moves(self, q: Array, load: Array) -> tuple[Array, Array, Array]:
        """The effect's displacements of joints (n, 6), of bodies (n, 42) and of the tool (n, 6).

        Args:
            q: (n or 1, 6) joint angles [rad].
            load: (n or 1, 48) torques on joints, then force and moment at the ends of the bodies.
        """
        n = max(len(q), len(load))
        q, load = np.broadcast_to(q, (n, 6)), np.broadcast_to(load, (n, LOADS))
        share = displacement_of(
            self.effect, self._at(q, joint_load=load[:, :6], body_load=load[:, 6:].reshape(n, 7, 6))
        )
        body = np.zeros((n, 7, 6))
        for b, xi in share.body.items():
            body[:, b] = xi
        joint, tool = (np.zeros(6) if part is None else part for part in (share.joint, share.tool))
        return np.broadcast_to(joint, (n, 6)), body.reshape(n, -1), np.broadcast_to(tool, (n, 6))

    def pushes(self, q: Array) -> tuple[Array, dict[int, Array]]:
        """The effect's torques (n, 6) on joints, and wrenches (n, 6) on bodies by index, at angles (n, 6) [rad]."""
        share = load_of(self.effect, self._at(q))
        return np.zeros((len(q), 6)) if share.joint is None else share.joint, dict(share.body)

    def _at(self, q: Array, **loads: Array) -> State:
        """The states with joint angles q (n, 6) and these load fields, otherwise as the first state."""
        rows, robot = self.states.rows(np.zeros(len(q), dtype=int)), self.model.robot
        return rows.with_(q=q, robot=robot, gravity=self.model.gravity, T_base_body=body_poses(robot, q), **loads)


def _alone(x: Array, column: int, row: Array) -> Array:
    """Copies (n, m) of a ``row`` (1, m), with one column set to x (n,)."""
    rows = np.repeat(row, len(x), axis=0)
    rows[:, column] = x
    return rows


def _compact_mass(T: Array, wrench: Array, gravity: Array) -> tuple[float, Array] | None:
    """Mass [kg] and first moment (3,) [kg m] whose weight on a body is the wrench in all poses, else None.

    Args:
        T: (n, 4, 4) poses of the body.
        wrench: (n, 6) force [N] and moment [N m].
        gravity: (3,) in base axes [m/s^2].
    """
    n = len(T)
    force = np.hstack([np.tile(gravity, n)[:, None], np.zeros((3 * n, 3))])
    # (o + R c) x g is linear in m and m c.
    about = np.hstack([np.cross(T[:, :3, 3], gravity).reshape(-1, 1), (-skew(gravity) @ T[:, :3, :3]).reshape(-1, 3)])
    columns, wanted = np.vstack([force, about]), np.concatenate([wrench[:, :3].ravel(), wrench[:, 3:].ravel()])
    x = np.linalg.lstsq(columns, wanted, rcond=None)[0]
    same = np.abs(columns @ x - wanted).max() <= SAME * max(1.0, np.abs(wanted).max())
    return (float(x[0]), x[1:]) if same else None


@dataclass(frozen=True, eq=False)
class Curve:
    """A function as equally spaced values, interpolated by a cubic through the four nearest.

    Args:
        joint: index of the joint that it acts on, from 0.
        source: index of the joint whose angle or torque is its argument.
        low: argument of the second value.
        step: between arguments.
        values: (m,) single precision, from one step below the range to one step above.
    """

    joint: int
    source: int
    low: float
    step: float
    values: NDArray[np.float32]


@dataclass(frozen=True)
class CurveTables:
    """The functions of one variable as tables; angles and displacements in degrees, torques in N m.

    Args:
        torque: torques on joints by angle.
        by_torque: displacements of joints by torque.
        by_angle: displacements of joints by angle.
    """

    torque: Sequence[Curve]
    by_torque: Sequence[Curve]
    by_angle: Sequence[Curve]

    @property
    def every(self) -> list[Curve]:
        """All curves in the order in which the module holds them."""
        return [*self.torque, *self.by_torque, *self.by_angle]


def curves_of(corrected: CorrectedModel, conditions: Conditions) -> CurveTables:
    """Curves of all functions over the region, with as few values as their tolerance allows.

    Args:
        conditions: has the region of joint angles.
    """
    degree = np.pi / 180.0
    low, high = np.degrees(conditions.lower), np.degrees(conditions.upper)

    def every(laws: Laws, begin: Array, end: Array, units: tuple[float, float], fine: float) -> list[Curve]:
        """Curves of functions whose argument and value are tabulated in other units.

        Args:
            begin, end: (6,) range of the argument, by its joint.
            units: of argument and value, in the units of the functions.
            fine: tolerance.
        """
        curves = []
        for key, some in laws.items():
            law: Law = partial(_total, some, units)
            curves.append(tabulated(key, law, float(begin[key[1]]), float(end[key[1]]), fine))
        return curves

    tables, span = corrected.tables, corrected.largest
    return CurveTables(
        every(tables.torque, low, high, (degree, 1.0), FINE_NM),
        every(tables.by_torque, -span, span, (1.0, degree), FINE / degree),
        every(tables.by_angle, low, high, (degree, degree), FINE / degree),
    )


def _total(laws: Sequence[Law], units: tuple[float, float], x: Array) -> Array:
    """Sum of functions at x (n,), with argument and result in other units than theirs.

    Args:
        units: of x and of the result, in the units of the functions.
    """
    return np.asarray(sum(law(x * units[0]) for law in laws) / units[1])


def tabulated(key: tuple[int, int], function: Law, low: float, high: float, tolerance: float) -> Curve:
    """The coarsest curve within a tolerance of a function; the finest one, of 4096 intervals, if none is.

    Args:
        key: joint that the function acts on, joint whose angle or torque is its argument, from 0.
        low, high: the range of the argument.
        tolerance: in the unit of the values.
    """
    count = COARSEST
    between = np.linspace(low, high, 4 * FINEST + 1)
    wanted = function(between)
    while True:
        step = (high - low) / count
        values = np.asarray(function(low + step * np.arange(-1.0, count + 2.0)), dtype=np.float32)
        curve = Curve(*key, low, step, values)
        if np.abs(_at(curve, between) - wanted).max() <= tolerance or count >= FINEST:
            return curve
        count *= 2


def _at(curve: Curve, x: Array) -> Array:
    """Values of a curve at x (n,), by Lagrange's cubic through four neighbours and constant outside the range."""
    f = curve.values.astype(float)
    u = np.clip((x - curve.low) / curve.step, 0.0, len(f) - 3.0)
    k = np.minimum(np.trunc(u), len(f) - 4.0).astype(int)
    u = u - k
    second, third = f[k] - 2.0 * f[k + 1] + f[k + 2], f[k + 3] - 3.0 * f[k + 2] + 3.0 * f[k + 1] - f[k]
    return np.asarray(f[k + 1] + u * (f[k + 2] - f[k + 1]) + u * (u - 1.0) * (second + third * (u + 1.0) / 3.0) / 2.0)
