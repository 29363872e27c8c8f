"""Places of the arm, and of what measures it, at which a law may act, and the amplitudes that it has there."""

from __future__ import annotations

from collections.abc import Mapping

from postproc.channels.sight import READINGS

SHIFT, TURN = (("shift_m", 3),), (("turn_rad", 3),)
WEIGHT = (("mass_kg", 1), ("moment_kgm", 3))
LEANS = "base, as it leans"
"""The base that tilts the way its overturning moment pulls it, about a point that nobody knows."""
FRAMES = ("instrument, shifted and turned", "base, shifted and turned")
"""What stands somewhere else, or leans about a point that nobody knows."""
SEATED = "tool, shifted and turned"
"""What a flange or a changer does that gives way, where orientations are measured."""
LOADED = {"body 2, under a weight": 2, "body 3, under a weight": 3, "tool, under a weight": 6}
"""What carries a weight that nobody modelled: a tank on the arm, a drum, a tool; and the body that it rides on."""
READ = {"azimuth": "turn_rad", "elevation": "turn_rad", "distance": "shift_m", "scale": "share"}
PLACES: Mapping[str, tuple[tuple[str, int], ...]] = {
    **{f"joint {j}": (("turn_rad", 1),) for j in range(1, 7)},
    "base": TURN,
    "instrument": SHIFT,
    "instrument, turned": TURN,
    **dict.fromkeys(FRAMES, SHIFT + TURN),
    LEANS: (("turn_rad", 1), ("shift_m", 1)),
    "tool": SHIFT,
    SEATED: SHIFT + TURN,
    **{f"instrument, {reading}": ((READ[reading], 1),) for reading in READINGS},
    **dict.fromkeys(LOADED, WEIGHT),
    **{f"body {b}{how}": move for b in range(1, 6) for how, move in (("", TURN), (", shifted", SHIFT))},
}
"""Amplitudes of a law at each place: how many of each parameter of `curve`, along the axes of the place. Joints turn;
so do base and far ends of bodies, which also shift; the tool shifts; instruments shift, turn or read wrongly."""
