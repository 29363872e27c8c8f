"""How the measured pose answers to every place where an effect can move the arm, and to every parameter of an effect.

One matrix a pose serves every effect: its columns by parameter are these columns times the derivative of its
displacement.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import Effect
from postproc.effects.geometry import weight
from postproc.model.arm import ALL_BODIES, Model
from postproc.model.chain import Chain, Directions, deflected_chain, directions, generalised_forces, point_jacobian
from postproc.model.derivatives.places import (
    BODY,
    INSTRUMENT,
    LOAD_PLACES,
    PLACES,
    SETUP,
    TOOL,
    displacement_parts,
    flat,
    load_parts,
    plus,
)
from postproc.model.derivatives.tangent import tangent
from postproc.model.equilibrium import Equilibrium, active_bodies, carries_load, equilibrium
from postproc.model.loads import with_loads
from postproc.robot.kinematics import skew
from postproc.robot.pose import left_jacobian

MANY_POSES = 1000
"""States from which on loads are worked out only where they are read."""


@dataclass(frozen=True)
class Loaded:
    """The states of an equilibrium with their loads, which are computed when they are first read.

    Args:
        along: directions of all coordinates of its chain.
    """

    model: Model
    balance: Equilibrium
    chain: Chain
    along: Directions

    @cached_property
    def every(self) -> State:
        """The states with the loads on the six joints and on the springs of all seven bodies."""
        at = self.balance
        return with_loads(self.model, at.state, at.deflection, self.chain, along=self.along, springs=ALL_BODIES)

    @cached_property
    def read(self) -> State:
        """The states with the loads that the model's effects read, or would read if their parameters were not null.

        Below ``MANY_POSES`` states all loads are computed, since finding out which are read takes as long.
        """
        balance = self.balance
        if len(balance.state) < MANY_POSES or not carries_load(self.model):
            return self.every
        return balance.state if {*active_bodies(nudged(self.model), balance.state)} <= {*balance.bodies} else self.every


@dataclass(frozen=True)
class Sensitivity:
    """Derivative of the TCP pose in the instrument's frame at the present parameters of a model.

    A column is a component of a displacement; `places.placed` says in which order.

    Args:
        matrix: (n, 6, 66) position [m] and rotation vector [rad], instrument axes, per displacement [rad or m].
        loaded: the states, with loads.
        along: directions of the m coordinates whose loads the springs follow; column: (m,) column of each of them.
        springs: effects whose displacement follows the load.
    """

    matrix: Array
    loaded: Loaded
    along: Directions
    column: NDArray[np.int_]
    springs: tuple[Effect, ...]

    @property
    def state(self) -> State:
        """The states with poses of bodies and all loads."""
        return self.loaded.every

    def seen_by(self, effect: Effect) -> State:
        """Return the states with the loads that an effect of the model reads; with all loads for any other effect."""
        known = any(e is effect for e in self.loaded.model.effects)
        return self.loaded.read if known else self.loaded.every

    def by_parameter(self, effect: Effect, free: NDArray[np.bool_]) -> Array:
        """Return the derivative (n, 6, p) of the pose by the free parameters of an effect, at their present values.

        Linear amplitudes are exact; others are central differences over a thousandth of the ordinary size.

        Args:
            free: mask over the effect's vector, with p times True.
        """
        index, state = np.flatnonzero(free), self.seen_by(effect)
        basis = None if effect.missing(state) else effect.joint_basis(state)
        if basis is not None:
            derivative = np.empty((*self.matrix.shape[:2], len(index)))
            for j in np.unique(basis.joint[index]):
                columns = np.flatnonzero(basis.joint[index] == j)
                # Runs of one joint's columns are written as one block.
                for run in np.split(columns, np.flatnonzero(np.diff(columns) > 1) + 1):
                    block = slice(int(run[0]), int(run[-1]) + 1)
                    derivative[:, :, block] = self.matrix[:, :, j, None] * basis.values[:, None, index[block]]
            return derivative
        result = np.zeros((*self.matrix.shape[:2], len(index)))
        for k, moved in enumerate(self._moved(effect, index, state)):
            result[:, :, k] = self.by_places(moved)
        return result

    def by_link_mass(self) -> Array:
        """Return the derivative (n, 6, 6) of the pose by the logarithms of the masses of bodies 1 to 6."""
        robot, state = self.loaded.model.robot, self.loaded.every
        result = np.zeros((*self.matrix.shape[:2], 6))
        for k, body in enumerate(range(1, 7)):
            load = np.zeros((len(state), LOAD_PLACES))
            wrench = weight(state, body, [(robot.mass[body], robot.mass[body] * robot.center[body])])
            load[:, 6 + 6 * body : 12 + 6 * body] = wrench
            result[:, :, k] = self.by_places(self.by_load(load, state))
        return result

    def by_places(self, moved: dict[int, Array]) -> Array:
        """Return the change (n, 6) of the pose by a small displacement [rad or m] in parts as of `placed`."""
        result = np.zeros(self.matrix.shape[:2])
        for at, part in moved.items():
            block = self.matrix[:, :, at : at + 6]
            result += block @ part if part.ndim == 1 else np.einsum("nrm,nm->nr", block, part)
        return result

    def _moved(self, effect: Effect, index: NDArray[np.int_], state: State) -> Iterator[dict[int, Array]]:
        """Yield the derivative of the displacement by each parameter in ``index``, in parts as of `placed`.

        It includes how the springs give under the load that the effect adds. ``state`` are the states that it sees.
        """
        if effect.missing(state):
            return
        x, scale, amplitude = effect.vector(), effect.scale(), effect.amplitudes()
        loads = type(effect).load is not Effect.load

        def answer(values: Array) -> tuple[dict[int, Array], dict[int, Array]]:
            """Return displacement and load of the effect with these parameters, by first column of the place."""
            moved = effect.with_vector(values)
            return displacement_parts(displacement_of(moved, state)), load_parts(load_of(moved, state)) if loads else {}

        answered = None
        if effect.linear and amplitude[index].any():
            # At null nothing moves, which need not be worked out.
            answered = ({}, {}) if effect.is_null else answer(x)
        for i in index:
            exact = answered is not None and bool(amplitude[i])
            step = np.zeros_like(x)
            step[i] = scale[i] if exact else 1e-3 * scale[i]
            high = answer(x + step)
            low = answered if exact and answered is not None else answer(x - step)
            change, load = (plus(a, b, -1.0) for a, b in zip(high, low, strict=True))
            if load:
                change = plus(change, self.by_load(flat(load, len(state), LOAD_PLACES), state))
            yield {at: part / (step[i] if exact else 2 * step[i]) for at, part in change.items()}

    def by_load(self, load: Array, state: State) -> dict[int, Array]:
        """Return the displacement of the springs under an added load, in parts as of `placed`.

        Args:
            load: (n, 54) torques on joints, then wrenches on the seven bodies and the flange about the base origin.
            state: the states of ``loaded`` to which the load is added.
        """
        n = len(state)
        every = np.zeros((n, BODY + 42))
        every[:, self.column] = generalised_forces(self.along, load[:, 6:].reshape(n, 8, 6))
        joints, bodies = np.asarray(state.joint_load) + load[:, :6] + every[:, :6], every[:, 6:].reshape(n, 7, 6)
        loaded = state.with_(joint_load=joints, body_load=None if state.body_load is None else state.body_load + bodies)
        before = self._sprung_by_read if state is self.loaded.read else self._sprung_by_every
        return plus(self._sprung(loaded), before, -1.0)

    @cached_property
    def _sprung_by_read(self) -> dict[int, Array]:
        """Displacement of the springs under the loads of ``loaded.read``, in parts as of `placed`."""
        return self._sprung(self.loaded.read)

    @cached_property
    def _sprung_by_every(self) -> dict[int, Array]:
        """Displacement of the springs under the loads of ``loaded.every``, in parts as of `placed`."""
        return self._sprung(self.loaded.every)

    def _sprung(self, state: State) -> dict[int, Array]:
        """Return the displacement of all springs under the loads of the states, in parts as of `placed`."""
        parts: dict[int, Array] = {}
        for spring in self.springs:
            parts = plus(parts, displacement_parts(displacement_of(spring, state)))
        return parts


def sensitivity(model: Model, at: Equilibrium) -> Sensitivity:
    """Compute the derivative of the measured pose by every displacement at an equilibrium, with loads kept constant."""
    n = len(at.state)
    chain = at.chain
    if chain.tip is None:
        chain = deflected_chain(model.robot, chain.q, at.deflection.body, True)
    along = directions(model.robot, chain, ALL_BODIES)
    column = model.elastic.place
    J = np.zeros((n, 6, PLACES))
    J[:, :, column] = point_jacobian(along, at.T_base_tcp[:, :3, 3])
    R_tool = at.chain.T_base_flange[:, :3, :3] @ at.state.T_flange_tcp[..., :3, :3]
    J[:, :3, TOOL : TOOL + 3] = R_tool
    J[:, 3:, TOOL + 3 : INSTRUMENT] = R_tool @ _turned(at.deflection.tool, n)
    R = at.R_instrument_base
    J[:, :3, :INSTRUMENT] = R @ J[:, :3, :INSTRUMENT]
    J[:, 3:, :INSTRUMENT] = R @ J[:, 3:, :INSTRUMENT]
    turned = _turned(at.deflection.instrument, n)
    J[:, :3, INSTRUMENT : INSTRUMENT + 3] = np.eye(3)
    point = (at.R_instrument_reference @ at.T_reference_tcp[:, :3, 3:])[:, :, 0]
    J[:, :3, INSTRUMENT + 3 : SETUP] = -skew(point) @ turned
    J[:, 3:, INSTRUMENT + 3 : SETUP] = turned
    springs = tuple(e for e in model.effects if "load" in e.reads)
    read = np.flatnonzero((column < BODY) | np.isin((column - BODY) // 6, at.bodies))
    return Sensitivity(J, Loaded(model, at, chain, along), along.some(read), column[read], springs)


def grown_sensitivity(model: Model, state: State) -> Sensitivity:
    """Compute the `Sensitivity` of states with loads that follow the deflection, J_theta (I - C K_E)^-1; slower."""
    balance = equilibrium(model, state, active_bodies(nudged(model), state))
    at, answer = sensitivity(model, balance), tangent(model, balance)
    place = answer.frame.bodies.place
    matrix = at.matrix.copy()
    matrix[:, :, place] = matrix[:, :, place] @ answer.give
    return replace(at, matrix=matrix)


def nudged(model: Model) -> Model:
    """Return the model with every parameter raised by a thousandth of its usual size, so that no effect is null."""
    return model.with_effects(*(e.with_vector(e.vector() + 1e-3 * e.scale()) for e in model.effects))


def _turned(displacement: Array | None, n: int) -> Array:
    """Return (n, 3, 3) the rotation per change of the rotation vector in ``displacement[..., 3:]``; None is zero."""
    vector = np.zeros(3) if displacement is None else np.asarray(displacement)[..., 3:]
    return left_jacobian(np.broadcast_to(vector, (n, 3)))
