"""The model of a real arm: the nominal robot, the effects that make it deviate, and how and where it stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array, gravity_in, invert
from postproc.channels.state import State
from postproc.effects.base import Effect
from postproc.effects.roles import Role
from postproc.model.multibody import Multibody
from postproc.model.pinocchio_bodies import PinocchioBodies
from postproc.model.uncertainty.field import Field
from postproc.robot.arm import Robot
from postproc.robot.cells.cell import LETTERS
from postproc.robot.cells.station import Station

ALL_BODIES = tuple(range(7))


@dataclass(frozen=True, slots=True)
class StatedPrior:
    """What is known of one parameter beside the measured rows: its value and standard deviation, in its own unit.

    Args:
        source: where it is known from: a data sheet, a balance, an earlier table.
    """

    value: float
    sigma: float
    source: str


@dataclass(frozen=True)
class Model:
    """One real arm.

    Args:
        robot: what the controller believes.
        effects: what it does not know, each kind at most once.
        R_world_base: (3, 3) how the base stands in the world: identity on a floor, turned over for a gantry.
        T_flange_tcp: (4, 4) nominal tool, where a program or a table does not name another.
        robot_name: what the model file says about the robot (a library name or a path).
        fit: what `fit` and `add` noted about how the parameters were found.
        priors: what else is known of parameters, by name such as ``joint_compliance.compliance_rad_per_Nm[1]``.
        surest: the arm without what holds near the measured rows alone, for where none is near; None where everything
            holds anywhere.
        stiffness_source: where joint stiffness comes from: ``measured`` on this arm or published for its type,
            ``estimated``, ``controller``, ``user``; empty where nobody says.
        station: where it stands and which external axes carry it and its work; None where nobody says.
        controller: the part of this model that the controller corrects by itself, None where it corrects nothing;
            already: what that is (`controller.PARTS`).
    """

    robot: Robot
    effects: tuple[Effect, ...] = ()
    R_world_base: Array = field(default_factory=lambda: np.eye(3))
    T_flange_tcp: Array = field(default_factory=lambda: np.eye(4))
    robot_name: str = ""
    fit: Mapping[str, Any] = field(default_factory=dict)
    stiffness_source: str = ""
    station: Station | None = None
    controller: Model | None = None
    already: tuple[str, ...] = ()
    priors: Mapping[str, StatedPrior] = field(default_factory=dict)
    surest: Model | None = None

    @property
    def measured_springs(self) -> tuple[int, ...]:
        """Joints, from 1, whose compliance rows have told: the fit has it, and it does not stand at its prior."""
        spring = self.in_role(Role.JOINT_SPRINGS)
        if spring is None or self.fit.get("contradicted"):
            return ()
        known = {*self.fit.get("parameters", ())} - {*self.fit.get("undetermined", ())}
        return tuple(j + 1 for j, name in enumerate(spring.names()) if f"{spring.key}.{name}" in known)

    @cached_property
    def gravity(self) -> Array:
        """Return the gravity vector (3,) in base axes [m/s^2], from how the base stands in the world."""
        return gravity_in(self.R_world_base)

    @cached_property
    def measured(self) -> Field | None:
        """Where the arm was measured, as `fit` and `add` noted it; None where they did not."""
        return Field.of_table(self.fit["measured"]) if "measured" in self.fit else None

    @cached_property
    def _built(self) -> dict[tuple[tuple[int, ...], bool], Multibody]:
        """The rigid-body models that `multibody` has built so far, by its arguments (bodies, carried)."""
        return {}

    def with_arm(self, state: State) -> State:
        """Return the states with this arm's robot, station and gravity; gravity that the states give by row is kept."""
        gravity = state.gravity if state.gravity.ndim == 2 else self.gravity
        return state.with_(robot=self.robot, station=self.station, gravity=gravity)

    def multibody(self, bodies: tuple[int, ...] = (), carried: bool = False) -> Multibody:
        """Return the rigid-body model of the six joints, with virtual springs at the far ends of these bodies.

        It is that of pinocchio, or the recursion in numpy where pinocchio is not installed; both agree to rounding.

        Args:
            bodies: numbers 0 to 6 of the bodies that get a spring.
            carried: the base moves or leans: its motion and gravity are then arguments of `Multibody.rnea`.
        """
        key, gravity = (bodies, carried), None if carried else self.gravity
        if key not in self._built:
            try:
                self._built[key] = PinocchioBodies(self.robot, gravity, bodies)
            except ImportError:
                self._built[key] = Multibody(self.robot, gravity, bodies)
        return self._built[key]

    @property
    def elastic(self) -> Multibody:
        """Rigid-body model of the six joints, with a virtual spring at the far end of each of the seven bodies."""
        return self.multibody(ALL_BODIES)

    def at_station(self, station: Station) -> Model:
        """Return this arm at a place of a cell; gravity there, with axes at zero, gives ``R_world_base`` if known."""
        gravity = station.gravity(np.zeros((1, 6)))
        if gravity is None or not np.isfinite(gravity).all():
            return replace(self, station=station)
        turn, _ = Rotation.align_vectors([[0.0, 0.0, -1.0]], gravity)
        return replace(self, station=station, R_world_base=turn.as_matrix())

    def effect(self, key: str) -> Effect | None:
        """Return the effect with this key, or None where the model has none."""
        return next((e for e in self.effects if e.key == key), None)

    def in_role(self, role: Role) -> Effect | None:
        """Return the first effect with this role, or None where the model has none."""
        return next((e for e in self.effects if e.role is role), None)

    def with_effects(self, *effects: Effect) -> Model:
        """Return this arm with these effects in place of its own, wherever it stands."""
        other = replace(self, effects=tuple(effects), surest=None)
        other.__dict__["_built"] = self._built  # they know the robot and gravity alone
        return other

    def state(self, q: Array, **channels: Any) -> State:
        """Return states at commanded joint angles q (n, 6) [rad]; without ``T_flange_tcp`` with the model's tool.

        Args:
            channels: further fields of `State`.
        """
        channels.setdefault("T_flange_tcp", self.T_flange_tcp)
        return State(np.asarray(q, dtype=float).reshape(-1, 6), **channels)

    def __getstate__(self) -> dict[str, Any]:
        """Return what is pickled: the fields alone, so that equal models have equal pickles."""
        return {each.name: getattr(self, each.name) for each in fields(self)}


def with_axes(station: Station, state: State, positions: Array) -> State:
    """Return the states with external axes at these positions (n, 6) [m], [rad].

    Sets ``T_reference_base``: measured points are in the frame of the unit that carries work, else in the world.
    Gravity is set by row where a turning axis carries the arm.
    """
    unit, gravity = station.work, station.gravity(positions)
    state = state.with_(external_axes=positions)
    if unit is not None or not station.in_world:
        T = station.base(positions) if unit is None else invert(station.frame(unit, positions))
        state = state.with_(T_reference_base=T, work=np.full(len(state), unit or ""))
    turning = any(station.joints[axis].kind == "rotary" for axis, side in station.sides(None).items() if side > 0)
    return state if gravity is None or not turning else state.with_(gravity=gravity)


def in_world(station: Station) -> Station:
    """Return the station with all units marked as carrying nothing: measured points then count in the world."""
    units = {name: replace(unit, idle=True) for name, unit in station.cell.units.items()}
    return replace(station, cell=replace(station.cell, units=units))


def as_written(station: Station, positions: Array) -> dict[str, Array]:
    """Convert positions (n, 6) [m, rad] to columns ``eax_a`` .. of the station's axes, in mm and degrees."""
    scales = {axis: 1e3 if joint.kind == "linear" else 180.0 / np.pi for axis, joint in station.joints.items()}
    return {f"eax_{axis}": scale * positions[:, LETTERS.index(axis)] for axis, scale in sorted(scales.items())}
