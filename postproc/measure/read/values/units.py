"""Units of columns: their factors to SI, how else they are written, and which may stand for each other."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

_ALIKE: tuple[Mapping[str, float], ...] = (
    {"deg": math.pi / 180, "rad": 1.0, "mrad": 1e-3},
    {"mm": 1e-3, "m": 1.0, "um": 1e-6, "in": 0.0254, "inch": 0.0254},
    {"deg_s": math.pi / 180, "rad_s": 1.0},
    {"deg_s2": math.pi / 180, "rad_s2": 1.0},
    {"kg": 1.0, "g": 1e-3, "lb": 0.45359237},
    *({unit: 1.0} for unit in ("N", "Nm", "C")),
    {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0},
    {"1": 1.0},
)
"""Units that may stand for each other, with their factors to SI; temperatures stay in degrees Celsius."""
UNITS: Mapping[str, float] = {unit: factor for kind in _ALIKE for unit, factor in kind.items()}
_WRITTEN = {
    "deg": "° degree degrees",
    "rad": "radian radians",
    "um": "µm \u03bcm micron",
    "deg_s": "deg/s °/s",
    "rad_s": "rad/s",
    "deg_s2": "deg/s2 deg/s^2 deg/s² °/s2 °/s^2 °/s²",
    "rad_s2": "rad/s2 rad/s^2 rad/s²",
    "N": "n",
    "Nm": "nm",
    "C": "°c degc c celsius",
    "s": "sec",
}
_SPELT = {theirs: unit for unit, spellings in _WRITTEN.items() for theirs in spellings.split()}


def stated_unit(header: str) -> str:
    """Return the unit in brackets or at the end of a column's header, by its name in `UNITS`; empty if it has none.

    A unit in brackets that is not known comes back as it is written.
    """
    found = re.search(r"[\[(]([^\[(\])]*+)[\])]", header) or re.search(r"[ _.](rad|deg|mm|m|in)$", header.strip())
    return _spelt(found[1].strip()) if found else ""


def is_unit(cell: str) -> bool:
    """Return whether a cell below a column's name is a unit."""
    return _spelt(cell.strip("[]() ")) in UNITS.keys() - {"1"}


def _spelt(unit: str) -> str:
    """Return the name in `UNITS` of a unit that may be written otherwise; an unknown one as it is."""
    return unit if unit in UNITS else _SPELT.get(unit.lower(), unit)


def fitting(unit: str, standard: str) -> bool:
    """Return whether two units measure the same quantity (mm and in, deg and rad)."""
    return unit == standard or any(unit in alike and standard in alike for alike in _ALIKE)
