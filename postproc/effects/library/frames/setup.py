"""What a measurement without a tracker leaves open: where a tip is, how a plane lies, where a gauge has its zero."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.base import XYZ, Displacement, Effect, State, param, structure
from postproc.effects.roles import Role


class Setup(
    Effect,
    role=Role.SETUPS,
    unlikely=np.inf,
    reads=("setup",),
    about_data=True,
    confused_with={"joint_offset": "nothing for joint 1: a tip, a plane and an anchor turn with it"},
):
    """Unknowns of tips, planes, anchors and gauges, by the names that a table gives them (`tip spike`).

    Equation: a tip reads p - c, an anchor abs(p - c) - z, a plane n.p - z, a gauge n.p - z of the TCP p. Point c and
    zero z are as written; n of a plane is the base's z turned by the rotation vector (a, b, 0).
    Source: rigid-body geometry. Typical size: any, as things were set up; 1 mm and 1 mrad where that was measured.
    """

    point: tuple[str, ...] = structure(("tip 1",))
    plane: tuple[str, ...] = structure(("plane 1",))
    zero: tuple[str, ...] = structure(("plane 1",))
    point_m: Array = param(unit="m", shape=("point", 3), typical=1e-3, labels=XYZ)
    tilt_rad: Array = param(unit="rad", shape=("plane", 2), typical=1e-3, labels=("x", "y"))
    zero_m: Array = param(unit="m", shape=("zero",), typical=1e-3)

    def displacement(self, state: State) -> Displacement:
        """Unknowns of the set-up of each row, (n, 6) [m], [rad]: 0 in rows of set-ups that are not listed."""
        parts = (self.point, self.point_m), (self.plane, self.tilt_rad), (self.zero, self.zero_m[:, None])
        columns = [np.pad(values, ((0, 1), (0, 0)))[_index(names, state)] for names, values in parts]
        return Displacement(setup=np.hstack(columns))

    def to_file(self) -> dict[str, Any]:
        """Return names and values for ``[effects.setup]``; values of nothing are left out."""
        return {key: value for key, value in super().to_file().items() if value or key in self.structures()}


def _index(names: tuple[str, ...], state: State) -> NDArray[np.intp]:
    """Return (n,) place of each row's set-up among names, the number of names where it is not one of them."""
    known = {name: k for k, name in enumerate(names)}
    place = np.array([*(known.get(name, len(names)) for name in state.setup_names), len(names)])
    return np.asarray(place[np.asarray(state.setup, dtype=int)])
