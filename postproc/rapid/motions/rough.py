"""Orientations that are farther from a unit quaternion than rounding explains."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from postproc.diagnostics import Diagnostic
from postproc.rapid.program.events import MotionEvent
from postproc.rapid.syntax.tokens import number_text

ROUNDED = 0.002  # of the length: two decimals of each number leave no more than a few times this


def rough_orientations(events: Sequence[MotionEvent]) -> Iterator[Diagnostic]:
    """RAP025 at every target of the events whose quaternion has to be stretched by more than rounding."""
    seen: set[tuple[str, int]] = set()
    for event in events:
        for origin in (event.target_origin, event.via_origin):
            spans = origin.spans if origin is not None else None
            if spans is None or (spans.source.path, spans.whole[0]) in seen:
                continue
            seen.add((spans.source.path, spans.whole[0]))
            length = math.hypot(*(float(number_text(spans.source.data, span)) for span in spans.rot))
            if abs(length - 1.0) > ROUNDED:
                text = f"the orientation is no unit quaternion: its length is {length:.4g}, and it is scaled to 1"
                help_ = "look for a typing error: a wrong digit turns the torch"
                yield Diagnostic("RAP025", "warning", text, spans.source, (spans.rot[0][0], spans.rot[-1][1]), help_)
