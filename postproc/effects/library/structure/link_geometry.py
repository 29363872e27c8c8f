"""Lengths, twists and axes that are not quite parallel."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import XYZ, Displacement, Effect, State, Variant, param, variant


class LinkGeometry(
    Effect,
    unlikely=4.0,
    reads=(),
    after="joint_offset",
    confused_with={
        "joint_offset": "nothing for the turn about a joint's own axis; only one of the two is kept",
        "instrument_frame": "nothing for body 0",
        "tool_frame": "nothing for body 6",
        "transmission_error": "first harmonics resemble an axis out of square: wide ranges of the joints after it",
    },
):
    """Castings are a little longer, shorter or more twisted than the drawing.

    Equation: a constant displacement x_b (translation [m], rotation [rad]) at the distal end of body b, in its axes.
    Six numbers a body are more than any pose can show: shifts along and turns about joint axes repeat each other, so a
    fit keeps the subset that its data determines and holds the rest at null.
    Source: complete and minimal parameter sets, Meggiolaro and Dubowsky (2000); Hayati (1983) for parallel axes.
    Typical size: 0.05 to 0.5 mm and 0.3 to 6 mrad (factory calibration of small arms).
    """

    shift_m: Array = param(unit="m", shape=(7, 3), low=-0.1, high=0.1, typical=3e-4, labels=XYZ)
    turn_rad: Array = param(unit="rad", shape=(7, 3), low=-0.3, high=0.3, typical=1e-3, labels=XYZ)

    def displacement(self, state: State) -> Displacement:
        """Displacements of the ends of bodies 0 to 6, (n, 6) [m], [rad], the same in every pose."""
        rows = np.ones((len(state), 1))
        constant = np.concatenate([self.shift_m, self.turn_rad], axis=1)
        return Displacement(body={b: rows * constant[b] for b in range(7)})

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Return the bodies 1 to 5 together, and each alone."""
        # Bodies 0 and 6 belong to the instrument's frame and to the tool.
        """Forms: bodies 1 to 5 together, then each of them alone."""
        effect, body = current or cls(), np.tile(np.repeat(np.arange(7), 3), 2)
        inner = (body > 0) & (body < 6)
        alone = [variant(effect, f"body {b}", body == b, body == b) for b in range(1, 6)]
        return (variant(effect, "bodies 1 to 5", inner, inner), *alone)
