"""Numbers as people write them, and lengths as documents state them."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

LARGEST_NUMBER = 1e30
"""Products of larger ones could not be formed; nothing that arms or instruments are made of comes near."""


def read_number(text: str) -> float:
    """Parse a number; unlike ``float`` it takes neither ``-18_2316`` nor digits of other scripts.

    Raises:
        ValueError: the text is none.
    """
    if "_" in text or not text.isascii():
        raise ValueError(f"not a number: {text!r}")
    return float(text)


def mm(value: float, decimals: int = 6) -> float:
    """Return metres in millimetres, or radians in milliradians, rounded to some decimals for documents."""
    return round(float(value) * 1e3, decimals)


def mm_or_none(value: float | None) -> float | None:
    """Return what `mm` does, and None where the value is None or not finite."""
    return None if value is None or not isfinite(value) else mm(value)


def percent_range(shares: Sequence[float]) -> str:
    """Return the lower and the upper end of a share in percent: ``3 to 45 %``."""
    return "{:.0f} to {:.0f} %".format(*(100 * share for share in shares))


def on_arm_text(expected_mm: Sequence[float] | None) -> str:
    """The largest deviation that is expected on the arm as text: ``0.12 to 0.85 mm``, or that it is not known.

    Args:
        expected_mm: lower and upper end of the interval.
    """
    return "not known" if expected_mm is None else "{:.2f} to {:.2f} mm".format(*expected_mm)
