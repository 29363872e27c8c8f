"""How RAPID text is written: numbers in the format of their neighbours, lines like those around them.

Numbers are plain decimals without exponent. Positions are `num`, single precision: 0.00012 mm at 1 to 2 m, so three
decimals in mm carry all there is. RAPID takes a line break wherever it takes a blank.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from postproc.rapid.syntax.tokens import tokenize

MM_DECIMALS = 3
QUATERNION_DECIMALS = 7
DEGREES_DECIMALS = 4
POWERS_OF_TEN = np.array([10.0**k for k in range(309)])
"""Of ten, as Python has them: an array's own powers may differ in the last digit."""
LONGEST_LINE = 200  # characters of what stays on one line: a target takes more than a hundred
LINE_WIDTH = 110  # of the lines of what is longer
_FIXED = ('"', "!", "\n")  # a text, a comment or lines of its own: left as it is


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


def broken(text: str, lead: str, newline: str) -> str:
    """A statement or an argument with line breaks if it has more than 200 characters, otherwise as it is.

    Breaks stand after commas, and before the signs of a sum that is still too long. Text with a string, a comment or
    breaks of its own stays as it is.

    Args:
        lead: blanks before the statement; continued lines are indented by one step more.
        newline: the line end to use.
    """
    if len(text) <= LONGEST_LINE or any(mark in text for mark in _FIXED):
        return text
    lines, step = [""], "\t" if "\t" in lead else "  "
    for part in _parts(text, commas=True):
        for piece in [part] if len(part) <= LINE_WIDTH else _parts(part, commas=False):
            if lines[-1] and len(lines[-1]) + len(piece) > LINE_WIDTH:
                lines.append("")
            lines[-1] += piece
    return f"{newline}{lead}{step}".join(lines)


def _parts(text: str, commas: bool) -> Sequence[str]:
    """The text cut into parts that may stand on lines of their own.

    With ``commas`` it is cut behind commas outside brackets or inside one pair; otherwise before the + and - signs of a
    sum outside brackets.
    """
    data, depth, cuts, last = text.encode("latin-1", "replace"), 0, [0], ""
    for kind, (start, end) in tokenize(data):
        token = data[start:end].decode("latin-1")
        depth += token in ("(", "[", "{")
        depth -= token in (")", "]", "}")
        if depth <= 1 and commas and token == ",":
            cuts.append(end)
        elif depth <= 0 and not commas and token in ("+", "-") and last not in ("", ",", "("):
            cuts.append(start)
        last = last if kind == "blank" else token
    return [text[a:b] for a, b in zip(cuts, [*cuts[1:], len(text)], strict=True) if b > a]


def line_style(data: bytes, offset: int) -> tuple[bytes, bytes]:
    """Indentation of the line at a byte offset (blanks before it only), and its line end, CR LF or LF."""
    start = data.rfind(b"\n", 0, offset) + 1
    before = data[start:offset]
    indent = before[: len(before) - len(before.lstrip())]
    end = data.find(b"\n", offset)
    if end < 0:
        end = start - 1
    newline = b"\r\n" if end > 0 and data[end - 1 : end] == b"\r" else b"\n"
    return indent, newline


def indent_after(data: bytes, offset: int) -> str:
    """Indentation of the first line with text after the line at a byte offset; two blanks if there is none near."""
    for line in data[offset : offset + 4096].split(b"\n")[1:]:
        if line.strip():
            return line[: len(line) - len(line.lstrip())].decode("latin-1")
    return "  "
