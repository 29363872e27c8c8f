"""Robtargets written as numbers: their values, and where the numbers stand."""

from __future__ import annotations

import re
from math import isfinite

from postproc.diagnostics import Source
from postproc.rapid.data.records import NO_AXES, RobTarget
from postproc.rapid.data.values import Data, to_conf, to_quat
from postproc.rapid.syntax.expressions import number
from postproc.rapid.syntax.spans import TargetSpans, literal
from postproc.rapid.syntax.tokens import number_text
from postproc.rapid.unknown import Kind, Unknown

NO_AXES_LIST = list(NO_AXES)


def read_literal_numbers(data: bytes, start: int, end: int) -> Data | None:
    """A robtarget's numbers as they are written, or None if the text is more than numbers."""
    found = literal(data, start, end)
    if found is None:
        return None
    n = numbers_of(found)
    return (tuple(n[0:3]), tuple(n[3:7]), tuple(n[7:11]), tuple(n[11:17]))


def read_literal_target(source: Source, start: int, end: int) -> tuple[RobTarget, TargetSpans] | None:
    """The robtarget at ``data[start:end]`` if it consists of numbers alone.

    Raises:
        Unknown: the numbers are no robtarget (orientation zero).
    """
    found = literal(source.data, start, end)
    if found is None:
        return None
    n = numbers_of(found)
    if not isfinite(sum(n)):
        raise Unknown(Kind.NUMBER_TOO_LARGE)
    # The same as to_robtarget, without its checks: there are as many numbers as targets need.
    rot = to_quat((n[3], n[4], n[5], n[6]))
    conf = to_conf(n[7:11])
    extax = NO_AXES if n[11:] == NO_AXES_LIST else (n[11], n[12], n[13], n[14], n[15], n[16])
    return RobTarget((n[0], n[1], n[2]), rot, conf, extax), TargetSpans(source, (start, end))


def numbers_of(found: re.Match[bytes]) -> list[float]:
    """The 17 numbers of a ``literal``."""
    try:
        return [float(group) for group in found.groups()]
    except ValueError:  # signs that stand apart from their digits, hexadecimal numbers
        texts = [number_text(found.string, span) for span in found.regs[1:]]
        return [-number(text[1:]) if text[0] == "-" else number(text) for text in texts]
