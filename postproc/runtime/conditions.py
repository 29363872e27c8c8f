"""What a module for run time is made for: tool, forces, channels, region, bound."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.effects.asking import displacement_of
from postproc.effects.base import FILLED_BY_MODEL, Effect
from postproc.effects.roles import Role
from postproc.model.arm import Model
from postproc.robot.kinematics import body_poses

KNOWN_CHANNELS = frozenset({"q", "payload", "wrench", *FILLED_BY_MODEL})
"""What a controller knows of the arm at a target; side of approach, speeds and time it does not know yet."""


@dataclass(frozen=True)
class Conditions:
    """What the correction at run time is made for.

    Args:
        lower, upper: (6,) region of joint angles [rad].
        T_flange_tcp: (4, 4) tool for which errors are stated; the module reads the tool of each call.
        mass: of its load [kg].
        center: (3,) of its load in tool0 [m].
        force, moment: of the process on the TCP, base axes [N], [N m].
        force_on: ``all``: always; ``arc``: where a call gives the option `Weld`.
        channels: constants of what effects read and a controller does not know: temperature [degC], others.
        bound_m: largest correction [m]; beyond it a target is returned unchanged.
        source: name of the model file; empty for the shipped model.
    """

    lower: Array
    upper: Array
    T_flange_tcp: Array = field(default_factory=lambda: np.eye(4))
    mass: float = 0.0
    center: Array = field(default_factory=lambda: np.zeros(3))
    force: Array = field(default_factory=lambda: np.zeros(3))
    moment: Array = field(default_factory=lambda: np.zeros(3))
    force_on: Literal["all", "arc"] = "all"
    channels: Mapping[str, float] = field(default_factory=dict)
    bound_m: float = 0.005
    source: str = ""

    @property
    def forced(self) -> bool:
        """Whether a process force or moment acts."""
        return bool(np.any(self.force) or np.any(self.moment))

    def states(self, q: Array) -> State:
        """States at joint angles (n, 6) [rad] with load, channels and the process force, whatever ``force_on`` says."""
        n = len(q)
        stated = {name: np.full(n, value) for name, value in self.channels.items()}
        return State(
            q=q,
            payload_mass=np.full(n, self.mass),
            payload_center=np.tile(self.center, (n, 1)),
            wrench=np.tile(np.concatenate([self.force, self.moment]), (n, 1)) if self.forced else None,
            temperature=stated.get("temperature"),
            channels=stated,
            T_flange_tcp=self.T_flange_tcp,
        )

    def drawn(self, count: int, seed: int) -> Array:
        """Random joint angles (up to count, 6) [rad], uniform over the region, none with a straight wrist."""
        q = np.random.default_rng(seed).uniform(self.lower, self.upper, (4 * count, 6))
        return q[np.abs(np.sin(q[:, 4])) > SINGULAR_SINE][:count]

    def spread(self, count: int) -> Array:
        """Joint angles (up to count, 6) [rad] that fill the region evenly (Halton sequence), no straight wrist."""
        from scipy.stats.qmc import Halton

        q = self.lower + Halton(6, seed=5).random(4 * count) * (self.upper - self.lower)
        return np.asarray(q[np.abs(np.sin(q[:, 4])) > SINGULAR_SINE][:count])


SINGULAR_SINE = np.sin(np.radians(2.0))
"""Sine of the angle of axis 5 below which axes 4 and 6 are one, and a target is returned as it came."""


def known_effects(model: Model, channels: Mapping[str, float]) -> tuple[Model, tuple[str, ...]]:
    """The model with the effects that depend only on what a controller knows at a target, and keys of those left out.

    An effect is left out if it reads a channel which nobody states (direction of approach, speeds, time, temperature),
    and so is the error of the measured tool, as other tools count as calibrated. Effects that do nothing, or describe
    the data or the instrument, are in neither.

    Args:
        channels: constants that are stated, by name of the channel.
    """
    model = model.surest or model  # the tables hold laws of the whole region
    ours = [e for e in model.effects if not e.about_data and not e.is_null and not _moves_instrument(e, model)]

    def is_known(effect: Effect) -> bool:
        """Whether an effect reads only what a controller knows at a target, and is not the error of the tool."""
        known = all(name in KNOWN_CHANNELS or name in channels for name in effect.reads)
        return known and effect.role is not Role.TOOL_FRAME

    return model.with_effects(*filter(is_known, ours)), tuple(e.key for e in ours if not is_known(e))


def _moves_instrument(effect: Effect, model: Model) -> bool:
    """Whether an effect displaces the frame of the measuring instrument, found by evaluating it at one pose."""
    one, six = np.ones(1), np.zeros((1, 6))
    probe = State(
        q=six + 0.1, v=six, a=six, approach=six + 1.0, payload_mass=one, payload_center=np.zeros((1, 3)), wrench=six,
        temperature=20.0 * one, time=one, session=np.zeros(1, dtype=int), robot=model.robot, joint_load=six,
        T_base_body=body_poses(model.robot, six), body_load=np.zeros((1, 7, 6)),
    )  # fmt: skip
    return displacement_of(effect, probe).instrument is not None
