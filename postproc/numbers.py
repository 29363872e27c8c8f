"""Numbers as people write them, and lengths as documents state them."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, isfinite, log10

LARGEST_NUMBER = 1e30
"""Products of larger ones could not be formed; nothing that arms or instruments are made of comes near."""

MOST_DECIMALS = 5
"""Of lengths [mm] in documents."""
SHARE_DECIMALS = 3
"""Of shares in documents."""


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


def above(value: float, limit: float, digits: int) -> str:
    """Return a number as text; one above a limit has as many decimals as it needs to read so.

    Args:
        digits: decimals that it has at least.
    """
    while digits < MOST_DECIMALS and value > limit >= float(f"{value:.{digits}f}"):
        digits += 1
    return f"{value:.{digits}f}"


def mm_or_none(value: float | None) -> float | None:
    """Return what `mm` does, and None where the value is None or not finite."""
    return None if value is None or not isfinite(value) else mm(value)


def percent_range(shares: Sequence[float]) -> str:
    """Return the lower and the upper end of a share in percent: ``3 to 45 %``, or one figure where both are equal.

    They are rounded as documents have them first: a share and its entry in a document read alike.
    """
    return f"{range_text([100 * round(share, SHARE_DECIMALS) for share in shares], 0)} %"


def decimals_of(scale: float) -> int:
    """Return the decimals of figures that are judged by a tolerance or by a noise: the last digit is a tenth of it.

    Two for 0.1 and for 0.2, three for 0.01; at least none and at most six.

    Args:
        scale: the tolerance or the noise, in the unit of the figures; not positive or not finite gives three.
    """
    if not (scale > 0 and isfinite(scale)):
        return 3
    return min(max(ceil(1 - log10(scale) - 1e-9), 0), 6)


def fixed(value: float | None, decimals: int) -> str:
    """Return a number with so many decimals and without a minus before zero; empty for None."""
    return "" if value is None else f"{value:z.{decimals}f}"


def range_text(interval: Sequence[float] | None, decimals: int, unit: str = "", guess: bool = False) -> str:
    """Return an interval as text, ``0.12 to 0.85``, one figure where its ends read alike, or that it is not known.

    Args:
        unit: written behind it. guess: it is called one.
    """
    if interval is None:
        return "not known"
    ends = " to ".join(dict.fromkeys(fixed(end, decimals) for end in interval))
    return ends + f" {unit}" * bool(unit) + ", a guess" * guess


def on_arm_text(expected_mm: Sequence[float] | None, decimals: int = 2, guess: bool = False) -> str:
    """Return the largest deviation that is expected on the arm: ``0.12 to 0.85 mm``, or that it is not known.

    Args:
        expected_mm: lower and upper end of the interval. guess: it is called one.
    """
    return range_text(expected_mm, decimals, "mm", guess)
