"""How the measured pose answers to every place where an effect can move the arm, and to every parameter of an effect.

Places are joints (6), far ends of bodies (7 x 6), tool (6) and instrument (6): 60 columns a pose. One such matrix
    serves
every effect: its columns by parameter are these columns times the derivative of its displacement.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.effects.base import Effect, displacement_of, load_of
from postproc.effects.contract import Displacement, Load, State
from postproc.model.arm import Model
from postproc.model.chain import Directions, directions, point_jacobian, spread
from postproc.model.equilibrium import Equilibrium, active_bodies, equilibrium
from postproc.model.loads import loaded_state
from postproc.model.tangent import tangent
from postproc.robot.kinematics import skew
from postproc.robot.pose import displace

JOINT, BODY, TOOL, INSTRUMENT, PLACES = 0, 6, 48, 54, 60


@dataclass(frozen=True)
class Sensitivity:
    """Derivative of the TCP pose in the instrument's frame at the present parameters of a model.

    Args:
        matrix: (n, 6, 60) position [m] and rotation vector [rad], instrument axes, by place [rad or m].
        state: the states with poses and loads filled in.
        along: directions of all coordinates, to spread loads on the springs; column: (48,) place of each coordinate.
        springs: effects whose displacement follows the load.
    """

    matrix: Array
    state: State
    along: Directions
    column: NDArray[np.int_]
    springs: tuple[Effect, ...]

    def by_parameter(self, effect: Effect, free: NDArray[np.bool_]) -> Array:
        """(n, 6, p) derivative of the pose by the free parameters of an effect, at their present values.

        Linear amplitudes are exact; others are central differences over a thousandth of the ordinary size.
        """
        index = np.flatnonzero(free)
        basis = None if effect.missing(self.state) else effect.basis(self.state)
        if basis is not None:
            found = np.empty((*self.matrix.shape[:2], len(index)))
            for j in np.unique(basis.joint[index]):
                own = np.flatnonzero(basis.joint[index] == j)
                # Runs of one joint's columns are written as one block.
                for run in np.split(own, np.flatnonzero(np.diff(own) > 1) + 1):
                    there = slice(int(run[0]), int(run[-1]) + 1)
                    found[:, :, there] = self.matrix[:, :, j, None] * basis.values[:, None, index[there]]
            return found
        result = np.zeros((*self.matrix.shape[:2], len(index)))
        for k, moved in enumerate(self._moved(effect, index)):
            used = np.flatnonzero(moved.any(axis=0))
            result[:, :, k] = (self.matrix[:, :, used] @ moved[:, used, None])[:, :, 0]
        return result

    def _moved(self, effect: Effect, index: NDArray[np.int_]) -> Iterator[Array]:
        """(n, 60) derivative of the displacement of all places by one parameter of an effect after the other.

        Its load on the springs included.
        """
        state, n = self.state, len(self.state)
        if effect.missing(state):
            return
        x, scale, amplitude = effect.vector(), effect.scale(), effect.amplitudes()

        def answer(values: Array) -> tuple[Array, Array]:
            moved = effect.with_vector(values)
            load = None if type(effect).load is Effect.load else load_of(moved, state)
            return flat(displacement_of(moved, state), n), flat_load(load, n)

        here = None
        if effect.linear and amplitude[index].any():
            # At null nothing moves, which need not be worked out.
            here = (np.zeros((n, PLACES)), np.zeros((n, 54))) if effect.is_null else answer(x)
        for i in index:
            exact = here is not None and bool(amplitude[i])
            step = np.zeros_like(x)
            step[i] = scale[i] if exact else 1e-3 * scale[i]
            high = answer(x + step)
            low = here if exact and here is not None else answer(x - step)
            change, load = high[0] - low[0], high[1] - low[1]
            if load.any():
                change += self.by_load(load)
            yield change / (step[i] if exact else 2 * step[i])

    def by_load(self, load: Array) -> Array:
        """(n, 60) displacement of the springs by a further load (n, 54)."""
        state, n = self.state, len(self.state)
        forces = load[:, 6:].reshape(n, 8, 6)
        every = np.empty((n, 48))
        every[:, self.column] = spread(self.along, np.cumsum(forces[:, ::-1], axis=1)[:, ::-1])
        loaded = state.with_(
            joint_load=np.asarray(state.joint_load) + load[:, :6] + every[:, :6],
            body_load=np.asarray(state.body_load) + every[:, 6:].reshape(n, 7, 6),
        )
        return self._sprung(loaded) - self.sprung

    @cached_property
    def sprung(self) -> Array:
        """(n, 60) displacement of the springs by the loads of the state."""
        return self._sprung(self.state)

    def _sprung(self, state: State) -> Array:
        return sum((flat(displacement_of(spring, state), len(state)) for spring in self.springs), np.zeros((1, PLACES)))


def sensitivity(model: Model, rest: Equilibrium) -> Sensitivity:
    """The Jacobian J_theta of all places at an equilibrium, with all loads worked out."""
    state = loaded_state(model, rest.state, rest.deflection, True)
    n = len(state)
    along = directions(
        model.robot, rest.chain if rest.chain.tip is not None else _with_ends(model, rest), tuple(range(7))
    )
    column = np.empty(48, dtype=int)
    column[model.elastic.joint] = np.arange(6)
    column[model.elastic.spring.ravel()] = np.arange(6, 48)
    J = np.zeros((n, 6, PLACES))
    J[:, :, column] = point_jacobian(along, rest.T_base_tcp[:, :3, 3])
    R_tool = rest.chain.T_base_flange[:, :3, :3] @ state.T_flange_tcp[..., :3, :3]
    J[:, :3, TOOL : TOOL + 3] = R_tool
    J[:, 3:, TOOL + 3 : INSTRUMENT] = R_tool @ _turning(rest.deflection.tool, n)
    T = _instrument(rest, n)
    R = T[:, :3, :3]
    J[:, :3, :INSTRUMENT] = R @ J[:, :3, :INSTRUMENT]
    J[:, 3:, :INSTRUMENT] = R @ J[:, 3:, :INSTRUMENT]
    left = _turning(rest.deflection.instrument, n)
    J[:, :3, INSTRUMENT : INSTRUMENT + 3] = np.eye(3)
    J[:, :3, INSTRUMENT + 3 :] = -skew((R @ rest.T_base_tcp[:, :3, 3:])[:, :, 0]) @ left
    J[:, 3:, INSTRUMENT + 3 :] = left
    springs = tuple(e for e in model.effects if "load" in e.reads)
    return Sensitivity(J, state, along, column, springs)


def grown_sensitivity(model: Model, state: State) -> Sensitivity:
    """The same with what the deflected arm carries besides, J_theta (I - C K_E)^-1: exact, and slower."""
    nudged = model.with_effects(*(e.with_vector(e.vector() + 1e-3 * e.scale()) for e in model.effects))
    rest = equilibrium(model, state, active_bodies(nudged, state))
    at, found = sensitivity(model, rest), tangent(model, rest)
    bodies = found.frame.bodies
    place = np.empty(bodies.size, dtype=int)
    place[bodies.joint] = np.arange(6)
    for b, columns in bodies.columns.items():
        place[columns] = BODY + 6 * b + np.arange(6)
    matrix = at.matrix.copy()
    matrix[:, :, place] = matrix[:, :, place] @ found.give
    return replace(at, matrix=matrix)


def at_least_ordinary(model: Model, spring: Effect) -> Effect:
    """A joint compliance that a missing load has pushed towards zero would hide that load.

    Half the stated one is taken; where none is stated, a fifth of the typical one of the fitted joints.
    """
    if spring.key != "joint_compliance":
        return spring
    x, stated = spring.vector(), model.robot.joint_compliance
    fitted = float(np.median(x[x > 0])) if (x > 0).any() else 0.0
    return spring.with_vector(np.maximum(x, 0.2 * fitted if stated is None else 0.5 * stated))


def flat(displacement: Displacement, n: int) -> Array:
    """(n, 60) a displacement by place."""
    result = np.zeros((n, PLACES))
    if displacement.joint is not None:
        result[:, JOINT:BODY] = displacement.joint
    for body, xi in displacement.body.items():
        result[:, BODY + 6 * body : BODY + 6 * body + 6] += xi
    if displacement.tool is not None:
        result[:, TOOL:INSTRUMENT] = displacement.tool
    if displacement.instrument is not None:
        result[:, INSTRUMENT:] = displacement.instrument
    return result


def flat_load(load: Load | None, n: int) -> Array:
    """(n, 54) a load: torques of the joints (6), then the wrench that every body and the tool carry (8 x 6)."""
    result = np.zeros((n, 54))
    if load is not None and load.joint is not None:
        result[:, :6] = load.joint
    for body, wrench in ({} if load is None else load.body).items():
        result[:, 6 + 6 * body : 12 + 6 * body] = wrench
    return result


def _with_ends(model: Model, rest: Equilibrium):  # type: ignore[no-untyped-def]
    from postproc.model.chain import deflected_chain

    return deflected_chain(model.robot, rest.chain.q, rest.deflection.body, True)


def _instrument(rest: Equilibrium, n: int) -> Array:
    T = np.eye(4) if rest.deflection.instrument is None else displace(rest.deflection.instrument)
    return np.asarray(np.broadcast_to(T, (n, 4, 4)))


def _turning(displacement: Array | None, n: int) -> Array:
    """(n, 3, 3) left Jacobian of the rotation vector: what a change of it turns, in the axes before the rotation.

    J = I + (1 - cos t)/t^2 S + (t - sin t)/t^3 S^2 (Chirikjian 2011, Sec. 10.8.1); the instrument may be set up at any
    angle.
    """
    vector = np.zeros(3) if displacement is None else np.asarray(displacement)[..., 3:]
    vector = np.broadcast_to(vector, (n, 3))
    t = np.linalg.norm(vector, axis=1)[:, None, None]
    S = skew(vector)
    small = t < 1e-5
    safe = np.where(small, 1.0, t)
    a = np.where(small, 0.5, (1 - np.cos(safe)) / safe**2)
    b = np.where(small, 1 / 6, (safe - np.sin(safe)) / safe**3)
    return np.asarray(np.eye(3) + a * S + b * (S @ S))


def rotation_vectors(R: Array) -> Array:
    """(n, 3) rotation vectors of (n, 3, 3) rotations; NaN rows stay NaN."""
    result = np.full((len(R), 3), np.nan)
    good = np.isfinite(R).all(axis=(1, 2))
    if good.any():
        result[good] = Rotation.from_matrix(R[good]).as_rotvec()
    return result
