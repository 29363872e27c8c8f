"""Units of columns: their factors to SI, how else they are written, and which may stand for each other."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

UNITS: Mapping[str, float] = {
    "deg": math.pi / 180,
    "rad": 1.0,
    "mrad": 1e-3,
    "mm": 1e-3,
    "m": 1.0,
    "um": 1e-6,
    "in": 0.0254,
    "inch": 0.0254,
    "deg_s": math.pi / 180,
    "rad_s": 1.0,
    "deg_s2": math.pi / 180,
    "rad_s2": 1.0,
    "kg": 1.0,
    "g": 1e-3,
    "lb": 0.45359237,
    "N": 1.0,
    "Nm": 1.0,
    "C": 1.0,
    "ms": 1e-3,
    "s": 1.0,
    "min": 60.0,
    "h": 3600.0,
    "d": 86400.0,
    "1": 1.0,
}
"""Factors to SI (angles in rad, temperatures stay in degrees Celsius)."""

_SPELT = {
    "°": "deg",
    "degree": "deg",
    "degrees": "deg",
    "°c": "C",
    "degc": "C",
    "c": "C",
    "celsius": "C",
    "µm": "um",
    "\u03bcm": "um",
    "micron": "um",
    "radian": "rad",
    "radians": "rad",
    "sec": "s",
    "n": "N",
    "nm": "Nm",
    **{
        f"{angle}/s{power}": f"{unit}_s{'2' if power else ''}"
        for angle, unit in (("deg", "deg"), ("°", "deg"), ("rad", "rad"))
        for power in ("", "2", "^2", "²")
    },
}
_ALIKE = (
    {"mm", "m", "um", "in", "inch"},
    {"deg", "rad", "mrad"},
    {"deg_s", "rad_s"},
    {"deg_s2", "rad_s2"},
    {"s", "ms", "min", "h", "d"},
    {"kg", "g", "lb"},
)
"""Units that may stand for each other."""


def stated_unit(theirs: str) -> str:
    """The unit that a name states in brackets or at its end, as it is called here; what it is not known by stays."""
    found = re.search(r"[\[(]\s*([^\])]*?)\s*[\])]", theirs) or re.search(r"[ _.](rad|deg|mm|m|in)$", theirs.strip())
    return _spelt(found[1]) if found else ""


def is_unit(cell: str) -> bool:
    """Whether a cell below a column's name is its unit."""
    return _spelt(cell.strip("[]() ")) in UNITS.keys() - {"1"}


def _spelt(unit: str) -> str:
    return unit if unit in UNITS else _SPELT.get(unit.lower(), unit)


def fitting(unit: str, standard: str) -> bool:
    """Whether a column that is stated in a unit may be one whose standard unit is another."""
    return unit == standard or any({unit, standard} <= alike for alike in _ALIKE)
