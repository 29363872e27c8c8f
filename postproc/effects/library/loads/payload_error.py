"""Tool mass and centre of gravity that differ from tooldata."""

from __future__ import annotations

from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import XYZ, Effect, Load, State, Variant, param, variant
from postproc.effects.geometry import Mass, weight
from postproc.effects.run_time import RunTimeTables


class PayloadError(
    Effect,
    reads=("pose",),
    linear=False,
    confused_with={
        "arm_load": "wrist poses: what hangs on the flange turns with it",
        "joint_compliance": "weigh the tool: a compliance answers to every load, this only to the tool's",
        "dress_pack": "the same wrist angle with the hose taken off",
    },
):
    """The tool is heavier, lighter or hangs elsewhere than the program says.

    Equation: extra force m (g - acceleration) at the extra centre c, with m and m c [kg, kg m] in tool0; the share
    ``fraction`` of the stated payload at its stated centre; and the stated payload's centre, wherever that is said to
    be, off by ``centre_m``. Source: Newton.
    Typical size: 1 to 10 kg, 1 to 3 kg m, 20 to 100 mm: 7 to 70 micrometres per load of that size on a 60 kg arm;
    120 kg and 60 kg m at most, twice what it may carry.
    """

    mass_kg: float = param(unit="kg", low=-500.0, high=500.0, typical=3.0, most=40)
    moment_kgm: Array = param(unit="kg m", shape=(3,), low=-200.0, high=200.0, typical=1.0, most=60, labels=XYZ)
    # A payload that was never taken up is -1, about which a fit scatters; below that nothing weighs.
    fraction: float = param(unit="1", low=-1.25, high=5.0, typical=0.1)
    centre_m: Array = param(unit="m", shape=(3,), low=-2.0, high=2.0, typical=0.05, labels=XYZ)

    def load(self, state: State) -> Load:
        """What the tool weighs beyond what is stated, a wrench (n, 6) [N], [N m] on body 6."""
        T_body_flange = np.eye(4) if state.robot is None else state.robot.link[6]
        masses: list[Mass] = [(self.mass_kg, self.moment_kgm)]
        if state.payload_mass is not None:
            stated = np.asarray(state.payload_mass, dtype=float)
            centre = np.zeros(3) if state.payload_center is None else state.payload_center
            first = stated[:, None] * centre
            masses.append((self.fraction * stated, self.fraction * first))
            if np.any(self.centre_m):
                # The stated mass is taken from where it is said to be and put where it is.
                masses += [(stated, first + stated[:, None] * self.centre_m), (-stated, -first)]
        return Load(body={6: weight(state, 6, masses, T_body_flange)})

    def run_time_tables(self) -> RunTimeTables:
        """The mass, moment, share and shift of centre as entries of the tables."""
        return RunTimeTables(
            share=self.fraction, shift=self.centre_m, load_mass=self.mass_kg, load_moment=self.moment_kgm
        )

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: mass and centre; its share, where a payload is stated; its centre, where that payload varies."""
        effect, part = current or cls(), np.arange(8)
        constant, share, centre = part < 4, part == 4, part > 4
        forms = [variant(effect, "mass and centre", constant, constant)]
        stated = state.channel("payload")
        if stated is not None and np.any(stated != 0.0):
            forms.append(variant(effect, "share of the stated payload", share, share))
        if stated is not None and np.ptp(stated) > 0.0:
            # With one payload this is the constant moment again.
            forms.append(variant(effect, "centre of the stated payload", centre, centre))
        return tuple(forms)
