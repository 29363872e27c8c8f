"""Numbers as RAPID writes them: plain decimals, no exponent, in the format of their neighbours.

Positions are `num`, single precision: 0.00012 mm at 1 to 2 m, so three decimals in mm carry all there is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MM_DECIMALS = 3
QUATERNION_DECIMALS = 7
DEGREES_DECIMALS = 4
POWERS = np.array([10.0**k for k in range(309)])
"""Of ten, as Python has them: an array's own powers may differ in the last digit."""


def rapid_number(value: float, decimals: int) -> str:
    """Decimal text without exponent, trailing zeros or a negative zero.

    >>> rapid_number(-0.00001, 3), rapid_number(1200.0, 3), rapid_number(0.5, 3)
    ('0', '1200', '0.5')
    """
    return _shortened(f"{value:.{decimals}f}")


def _shortened(text: str) -> str:
    """A decimal text without trailing zeros or a negative zero."""
    if text[-1] == "0" and "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def number_like(original: str, before: float, value: float, least_decimals: int) -> str:
    """Text of a new value in the format of the number that it replaces; the original if both agree when rounded.

    A number that is no decimal (``0x1F``) is replaced by one that is.

    Args:
        original: the number's text in the program; before: its value.
        least_decimals: decimals to write if the original has fewer.

    >>> number_like("600.00", 600, 600.4124, 3), number_like("600.00", 600, 600.0001, 3)
    ('600.412', '600.00')
    """
    if before == value:
        return original
    fraction = original.partition(".")[2]
    written = len(fraction) if fraction.isdigit() else 0
    decimals = max(written, least_decimals)
    if -0.5 < (before - value) * 10.0**decimals < 0.5:
        return original
    return written_like(value, written, decimals)


def written_decimals(texts: NDArray[np.bytes_]) -> NDArray[np.int64]:
    """Decimals of numbers, in the shape of their texts; none of a text that is no plain decimal."""
    fraction = np.char.partition(texts, b".")[..., 2]
    return np.where(np.char.isdigit(fraction), np.char.str_len(fraction), 0)


def written_like(value: float, written: int, decimals: int) -> str:
    """Text of a number with ``decimals``; without trailing zeros if that which it replaces has fewer, ``written``."""
    text = f"{value:.{decimals}f}"
    if text[-1] != "0":
        return text
    if written < decimals:
        return _shortened(text)
    return text if float(text) else text.lstrip("-")
