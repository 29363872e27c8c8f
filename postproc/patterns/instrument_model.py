"""What an instrument reads of the measured point, azimuth, elevation and distance, and where errors of each move it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from postproc.arrays import Array
from postproc.estimation.channels import varies
from postproc.model.equilibrium import Equilibrium
from postproc.patterns.curves import GEAR, LOW, fixed, line, of_signal, sways, waves
from postproc.patterns.formula import Block, block, product_of
from postproc.patterns.signals import TOOL, Signal, place_code
from postproc.robot.pose import displace

SEEN = "seen"
"""What a draft calls the (n, 3) measured point as the instrument sees it [m]."""
_LEVEL = f"{SEEN} @ [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0] * 3]"
_RISING = f"np.cross({_LEVEL} / np.hypot({SEEN}[:, 0], {SEEN}[:, 1])[:, None], {SEEN})"
WRIST = ("q5", "q6", "q4")
"""Channels that turn the tool most."""
WAYS: Mapping[str, tuple[str, str]] = {
    "azimuth": (f"np.cross([0.0, 0.0, 1.0], {SEEN})", "rad"),
    "elevation": (_RISING, "rad"),
    "distance": (f"{SEEN} / np.linalg.norm({SEEN}, axis=1)[:, None]", "m"),
    "scale": (SEEN, "1"),
}
"""Text and unit of how the measured point moves with an error of each reading: tangential, radial, in proportion.

Sources: ASME B89.4.19-2006; Hughes, Forbes, Lewis, Sun, Veal and Nasr (2011), Meas. Sci. Technol. 22, 045103.
"""


@dataclass(frozen=True)
class Sight:
    """The measured point as an instrument sees it, as predicted by a model.

    Args:
        point: (n, 3) in the axes of the instrument [m]; code: expression of a state for it, empty where there is none.
        beam: (n, 3) unit direction to it in the axes of the tool: a reflector that is seen from the side is off.
        beam_code: expression of a state for that, (3, n).
    """

    point: Array
    code: str
    beam: Array
    beam_code: str

    @classmethod
    def of(cls, rest: Equilibrium) -> Sight:
        """Return the sight of the points that a model predicts; measured points would explain their own noise.

        Args:
            rest: the model's equilibrium at the measured states.
        """
        frame = rest.deflection.instrument
        # Where it drifts, by millimetres: on average.
        T = np.eye(4) if frame is None else displace(np.atleast_2d(frame).mean(axis=0))
        seen = rest.T_reference_tcp
        # Text of a state tells where the arm is on its base alone.
        place = place_code(rest.state, rest.T_base_tcp[:, :3, 3]) if rest.state.T_reference_base is None else ""
        code = f"{place} @ {np.round(T[:3].T, 6).tolist()}" if place else ""
        point = seen[:, :3, 3] @ T[:3, :3].T + T[:3, 3]
        beam = np.einsum("nji,nj->ni", seen[:, :3, :3], point @ T[:3, :3])
        text = f"np.einsum('nji,nj->in', ({TOOL})[:, :3, :3], {SEEN} @ {np.round(T[:3, :3], 6).tolist()})"
        text = f"({text} / np.linalg.norm({SEEN}, axis=1))" if code else ""
        return cls(point, code, beam / np.linalg.norm(point, axis=1)[:, None], text)

    def moves(self) -> dict[str, Array]:
        """Return (n, 3) displacement of the point by a unit error of each reading, by the name of the reading.

        They are azimuth and elevation [m/rad], distance [m/m] and scale [m], an error in proportion to the distance.
        """
        x, y, z = self.point.T
        level, whole = np.maximum(np.hypot(x, y), 1e-9), np.maximum(np.linalg.norm(self.point, axis=1), 1e-9)
        return {
            "azimuth": np.stack([-y, x, 0 * x], axis=1),
            "elevation": np.stack([-x * z / level, -y * z / level, level], axis=1),
            "distance": self.point / whole[:, None],
            "scale": self.point,
        }

    def blocks(self, slow: Iterable[Signal] = ()) -> Iterator[Block]:
        """Yield patterns of the instrument's readings and of the beam's direction in tool axes, and a constant error.

        Args:
            slow: channels, such as temperatures, by which the air may bend and stretch the line of sight.
        """
        known = SEEN if self.code else ""
        flat, whole = f"np.hypot({SEEN}[:, 0], {SEEN}[:, 1])", f"np.linalg.norm({SEEN}, axis=1)"
        x, y, z = self.point.T
        level = np.hypot(x, y)
        rising, far = (f"np.arctan2({SEEN}[:, 2], {flat})", whole) if known else ("", "")
        elevation = Signal(("elevation",), np.arctan2(z, level), rising, "q", "the instrument's elevation")
        distance = Signal(("distance",), np.hypot(level, z), far, "x", "the instrument's distance")
        for signal in (azimuth(self.point, known, "the instrument's azimuth"), elevation, distance):
            yield from _shapes(signal, "instrument")
        for k, axis in enumerate("xyz" if known else ""):
            u, (i, j) = self.beam, ((k + 1) % 3, (k + 2) % 3)
            for way, values, code in (
                ("to", np.arccos(u[:, k]), f"np.arccos({self.beam_code}[{k}])"),
                ("around", np.arctan2(u[:, j], u[:, i]), f"np.arctan2({self.beam_code}[{j}], {self.beam_code}[{i}])"),
            ):
                label = f"the beam's angle {way} axis {axis} of the tool"
                yield from _shapes(Signal(WRIST, values, code, "q", label), "instrument", max(LOW) + 1)
        for air in slow:
            yield product_of(line(replace(air, label=air.whole)), line(distance), "product", "instrument")
        always = Signal(("x", "y", "z"), np.ones(len(x)), "np.ones(len(state))", "", "")
        yield block(fixed(lambda x: x, "the same everywhere", "field"), always, where="instrument")


def around(position: Array, code: str) -> Iterator[Block]:
    """Yield curves and waves of the tool's azimuth about joint 1, for a footing that turns or tilts with it.

    Args:
        position: (n, 3) of the tool in base axes [m]; code: expression of a state for it, may be empty.
    """
    return _shapes(azimuth(position, code, "the tool's azimuth"), "base")


def azimuth(point: Array, code: str, label: str) -> Signal:
    """Return the azimuth of points (n, 3) [rad] as a signal; it jumps by 2 pi opposite to their mean direction.

    Args:
        code: expression of a state for the points, may be empty; label: what the azimuth is called.
    """
    back = float(np.arctan2(*point.mean(axis=0)[1::-1])) - np.pi
    values = np.mod(np.arctan2(point[:, 1], point[:, 0]) - back, 2 * np.pi) + back
    text = f"np.mod(np.arctan2({code}[:, 1], {code}[:, 0]) - {back:.4f}, 2 * np.pi) + {back:.4f}" if code else ""
    return Signal(("azimuth",), values, text, "q", f"{label} atan2(y, x)", bare=True)


def _shapes(signal: Signal, where: str, most: int = GEAR) -> Iterator[Block]:
    """Yield the curves of a signal and its waves up to order ``most``, for one place; none of a constant signal."""
    if varies(signal.values):
        some = waves(signal, range(1, most + 1)) if signal.unit == "q" else sways(signal)
        yield from (b.with_(where=where) for b in (*of_signal(signal), some))
