"""Values that a command line gives in one word: vectors, channels with their value, lists of names."""

from __future__ import annotations

import math
from collections.abc import Iterable

from postproc.diagnostics import PostprocError
from postproc.numbers import read_number

Vector = tuple[float, float, float]


def parse_vector(option: str, text: str, such_as: str = "200,-200,-200") -> Vector:
    """Three numbers with commas between them, ``200,-200,-200``.

    Raises:
        PostprocError: anything else (CLI006).
    """
    try:
        x, y, z = (read_number(part) for part in text.split(","))
    except ValueError:
        x = y = z = math.nan
    if not all(map(math.isfinite, (x, y, z))):
        text, help_ = f"`{option} {text}` is not three numbers", f"write `{option} {such_as}`"
        raise PostprocError.of("CLI006", text, help=help_)
    return x, y, z


def parse_channel(text: str) -> tuple[str, float]:
    """Name and value of a channel, ``temperature=30``, or ``shift=night=1`` of a word.

    Raises:
        PostprocError: anything else (CLI006).
    """
    name, _, value = text.rpartition("=")
    try:
        number = read_number(value)
    except ValueError:
        number = math.nan
    if not (name.strip() and math.isfinite(number)):
        text, help_ = f"`--channel {text}` is not a name and a number", "write `--channel temperature=30`"
        raise PostprocError.of("CLI006", text, help=help_)
    return name.strip(), number


def split_names(words: Iterable[str]) -> list[str]:
    """Names given one after the other or with commas between them, each once."""
    return list(dict.fromkeys(name.strip() for word in words for name in word.split(",") if name.strip()))
