"""Robtargets written as numbers: their values, and where the numbers stand."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from math import hypot, isfinite

from postproc.diagnostics import Source
from postproc.rapid.data.records import NO_AXES, Ax6, Quat, RobTarget
from postproc.rapid.data.values import Data, to_conf, to_quat
from postproc.rapid.syntax.expressions import number
from postproc.rapid.syntax.spans import TargetSpans, literal, literal_parts
from postproc.rapid.syntax.tokens import number_text
from postproc.rapid.unknown import Kind, Unknown

ROUNDED_NORM = 0.002  # of the length of a quaternion: two decimals of each number leave no more than a few times this


def read_literal_numbers(data: bytes, start: int, end: int) -> Data | None:
    """17 numbers of a robtarget as ((x, y, z), (q1..q4), (cf1, cf4, cf6, cfx), (eax_a..eax_f)), as they are written.

    None if the text is anything else than literal numbers.
    """
    match = literal(data, start, end)
    if match is None:
        return None
    n = numbers_of(match)
    return (tuple(n[0:3]), tuple(n[3:7]), tuple(n[7:11]), tuple(n[11:17]))


def read_literal_target(source: Source, start: int, end: int) -> tuple[RobTarget, TargetSpans] | None:
    """The robtarget at ``data[start:end]`` and its place in the text; None if it does not consist of numbers alone.

    Raises:
        Unknown: the numbers are no robtarget (too large, orientation zero or no unit quaternion).
    """
    parts = literal_parts(source.data, start, end)
    if parts is not None:
        x, y, z, behind = parts.groups()
        trans, others = (float(x), float(y), float(z)), _written(behind)
    else:
        match = literal(source.data, start, end)
        if match is None:
            return None
        n = numbers_of(match)
        trans, others = (n[0], n[1], n[2]), _behind(n[3:])
    if not isfinite(trans[0] + trans[1] + trans[2]):
        raise Unknown(Kind.NUMBER_TOO_LARGE)
    rot, conf, extax, rough = others
    return RobTarget(trans, rot, conf, extax), TargetSpans(source, (start, end), rough)


Behind = tuple[Quat, tuple[int, int, int, int], Ax6, bool]


@lru_cache(maxsize=4096)
def _written(behind: bytes) -> Behind:
    """Orientation, configuration, axes and roughness as in `_behind`, of the text ``[q1,..],[cf1,..],[eax_a,..]``."""
    return _behind([float(number) for number in behind.translate(None, b"[]").split(b",")])


def _behind(n: Sequence[float]) -> Behind:
    """Orientation, configuration, external axes, and whether the quaternion's length is over ``ROUNDED_NORM`` from 1.

    Args:
        n: the 14 numbers of a robtarget that follow its position.

    Raises:
        Unknown: a number is too large, or the first four are no orientation.
    """
    if not isfinite(sum(n)):
        raise Unknown(Kind.NUMBER_TOO_LARGE)
    rot, conf = to_quat(tuple(n[0:4])), to_conf(n[4:8])
    extax = NO_AXES if tuple(n[8:]) == NO_AXES else (n[8], n[9], n[10], n[11], n[12], n[13])
    return rot, conf, extax, abs(hypot(*n[0:4]) - 1.0) > ROUNDED_NORM


def numbers_of(match: re.Match[bytes]) -> list[float]:
    """The 17 numbers of a robtarget from a match that ``literal`` returned, as floats in the order of the text."""
    try:
        return [float(group) for group in match.groups()]
    except ValueError:  # signs that stand apart from their digits, hexadecimal numbers
        texts = [number_text(match.string, span) for span in match.regs[1:]]
        return [-number(text[1:]) if text[0] == "-" else number(text) for text in texts]
