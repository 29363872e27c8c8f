"""What every effect is: parameters with units, and a load, a displacement, or both.

State goes in, loads and displacements come out; contributions add, so no effect needs another effect's output.
Every effect vanishes at the null value of its parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from postproc.arrays import Array


@dataclass(frozen=True, slots=True)
class Load:
    """Forces an effect adds.

    Args:
        joint: (n, 6) torques that act on the joints in the positive direction [N m].
        body: wrench on a body by its number, (n, 6) force [N] and moment [N m] about the base origin, base axes.
    """

    joint: Array | None = None
    body: Mapping[int, Array] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Displacement:
    """Where an effect moves the arm.

    Args:
        joint: (n, 6) joint angles [rad].
        body: displacement at the distal end of a body by its number, (n, 6) translation [m], rotation [rad], body axes.
        tool: (n, 6) or (6,) at the TCP in tool axes; instrument: (n, 6) or (6,) of the base as the instrument sees it.
        setup: (n, 6) unknowns of what a row reads where it measures no position (`measure.kinds`).
    """

    joint: Array | None = None
    body: Mapping[int, Array] = field(default_factory=dict)
    tool: Array | None = None
    instrument: Array | None = None
    setup: Array | None = None
