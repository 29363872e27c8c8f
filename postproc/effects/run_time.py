"""What effects put into the tables of the function that corrects targets on a controller (`runtime`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from postproc.arrays import Array

Law = Callable[[Array], Array]
"""A function of one number for many values, (n,) to (n,)."""
Laws = Mapping[tuple[int, int], tuple[Law, ...]]
"""Sums of functions, by the joint that they act on and the joint that they follow (from 0)."""


@dataclass(frozen=True)
class Pull:
    """A line that pulls two bodies towards each other with the force k max(length - slack, 0).

    Args:
        bodies: numbers of both. points: (3,) on each, in its axes [m]. stiffness: k [N/m]. slack: [m].
    """

    bodies: tuple[int, int]
    points: tuple[Array, Array]
    stiffness: float
    slack: float


@dataclass(frozen=True)
class RunTimeTables:
    """Displacements and loads as a function on a controller works them out; those of several effects add.

    Args:
        offset: (6,) displacement of joints [rad]; compliance: (6,) that by the joint's own torque [rad/(N m)].
        body_offset: (7, 6) displacement at the distal end of bodies [m, rad], in their axes; body_compliance:
            (7, 6, 6) that by force and moment there [N, N m].
        by_angle: displacement of a joint [rad] as functions of a commanded angle [rad]. by_torque: of a joint [rad] as
            functions of its own torque [N m]. torque: on a joint [N m] as functions of an angle [rad].
        mass: (7,) on bodies [kg], first_moment: (7, 3) [kg m] in their axes.
        share, shift: what the stated load of tool and payload weighs beyond what is stated, as a share of it, and how
            far its centre is from where it is stated (3,) [m]; load_mass [kg] and load_moment (3,) [kg m] beside it,
            all in tool0.
        pulls: lines between bodies.
    """

    offset: Array = field(default_factory=lambda: np.zeros(6))
    compliance: Array = field(default_factory=lambda: np.zeros(6))
    body_offset: Array = field(default_factory=lambda: np.zeros((7, 6)))
    body_compliance: Array = field(default_factory=lambda: np.zeros((7, 6, 6)))
    by_angle: Laws = field(default_factory=dict)
    by_torque: Laws = field(default_factory=dict)
    torque: Laws = field(default_factory=dict)
    mass: Array = field(default_factory=lambda: np.zeros(7))
    first_moment: Array = field(default_factory=lambda: np.zeros((7, 3)))
    share: float = 0.0
    shift: Array = field(default_factory=lambda: np.zeros(3))
    load_mass: float = 0.0
    load_moment: Array = field(default_factory=lambda: np.zeros(3))
    pulls: tuple[Pull, ...] = ()

    def plus(self, other: RunTimeTables) -> RunTimeTables:
        """Return the sum of two effects' tables."""

        def both(a: Any, b: Any) -> Any:
            """Add two numbers or arrays; of mappings, join the tuples of each key."""
            if isinstance(a, Mapping):
                return {key: a.get(key, ()) + b.get(key, ()) for key in {**a, **b}}
            return a + b

        return RunTimeTables(**{name: both(value, getattr(other, name)) for name, value in vars(self).items()})
