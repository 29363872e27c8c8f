"""The check: a corrected program must do in every world what the original does there, to within its corrections."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.worlds.alignment import identities
from tests.worlds.geometry import angle_between, distance_to_arc, distance_to_segment
from tests.worlds.interpreter import Event, Interpreter
from tests.worlds.syntax import Module
from tests.worlds.world import World

ROUNDING = 0.004
"""mm: three decimals in the text, and single precision (0.00012 at 2 m) in a few operations."""
TURN = math.radians(0.5)
"""Corrections turn a target by at most this."""


@dataclass
class Outcome:
    """What a comparison found: faults in words, the largest distance of a goal and of an added target over its bound [mm]."""

    world: str
    faults: list[str] = field(default_factory=list)
    goal_mm: float = 0.0
    added_mm: float = 0.0
    motions: int = 0
    added: int = 0
    stopped: str = ""

    def fault(self, kind: str, event: Event | None, text: str) -> None:
        where = f"line {event.line} {event.name}" if event is not None else "end"
        self.faults.append(f"{kind}: {where}: {text}")


def compare_worlds(original: list[Module], corrected: list[Module], bound_mm: dict[int, float] | float, world: World) -> Outcome:
    """Runs both programs in one world and compares motions and effects.

    Args:
        bound_mm: the largest correction [mm], of the program or by line of the original.
    """
    first = Interpreter(original, world)
    before = first.run()
    second = Interpreter(corrected, world, identities(original, corrected))
    after = second.run()
    out = Outcome(world.name, stopped=first.stopped)
    largest = bound_mm if isinstance(bound_mm, float) else max([0.0, *bound_mm.values()])
    _events(out, before, after, bound_mm, largest)
    if first.stopped != second.stopped:
        out.fault("stop", None, f"the original ends `{first.stopped}`, the corrected program `{second.stopped}`")
    _values(out, first, second, largest)
    return out


def _events(out: Outcome, before: list[Event], after: list[Event], bounds: dict[int, float] | float, largest: float) -> None:
    k, waiting = 0, []
    for e in after:
        if e.inserted:
            if e.motion:
                waiting.append(e)
            else:
                out.fault("effect", e, "an added statement does more than move")
            continue
        if k >= len(before):
            out.fault("order", e, "the original has ended here")
            return
        o = before[k]
        k += 1
        if o.identity != e.identity or o.name.rstrip("0") != e.name:
            out.fault("order", o, f"`{o.name}` in the original, `{e.name}` in line {e.line} here")
            return
        if o.motion:
            for added in waiting:
                _added(out, added, o, largest)
            waiting = []
            bound = largest if isinstance(bounds, float) else bounds.get(o.line) or largest  # what is left alone may stand on others
            _motion(out, o, e, bound)
        elif not close(o.values, e.values, largest + ROUNDING):
            out.fault("effect", o, f"{o.values} in the original, {e.values} here")
    for added in waiting:
        out.fault("order", added, "an added target after the last motion")
    if k < len(before):
        out.fault("order", before[k], "missing in the corrected program")


def _motion(out: Outcome, o: Event, e: Event, bound: float) -> None:
    a, b = o.values, e.values
    out.motions += 1
    d = float(np.linalg.norm(a["goal"][:3, 3] - b["goal"][:3, 3]))
    out.goal_mm = max(out.goal_mm, d - bound)
    if d > bound + ROUNDING:
        out.fault("goal", o, f"{d:.3f} mm from the original's, its correction is {bound:.3f} mm")
    if angle_between(a["goal"], b["goal"]) > TURN:
        out.fault("goal", o, f"turned by {math.degrees(angle_between(a['goal'], b['goal'])):.2f} degrees")
    if "via" in a:
        arc = distance_to_arc(b["via"][:3, 3], a["start"][:3, 3], a["via"][:3, 3], a["goal"][:3, 3])
        if arc > bound + ROUNDING + 0.05:
            out.fault("goal", o, f"the circle point is {arc:.3f} mm from the original's arc")
    for part in ("speed", "zone", "tool", "wobj", "conf", "extax", "signal", "value", "seam", "weld"):
        if not close(a.get(part), b.get(part), 1e-3):
            out.fault("argument", o, f"{part} is {b.get(part)}, not {a.get(part)}")


def _added(out: Outcome, e: Event, o: Event, bound: float) -> None:
    a, b = o.values, e.values
    out.added += 1
    if a["family"] != b["family"]:
        out.fault("added", e, f"added to the way of `{o.name}`")
    p, start, goal = b["goal"][:3, 3], a["start"][:3, 3], a["goal"][:3, 3]
    if "via" in a:
        d = distance_to_arc(p, start, a["via"][:3, 3], goal)
    else:
        d = distance_to_segment(p, start, goal)
    if a["family"] in "JA":  # between the goals, joints lead the tool on a curve of its own
        d = max(0.0, d - 0.5 * float(np.linalg.norm(goal - start)))
    out.added_mm = max(out.added_mm, d - bound)
    if d > bound + ROUNDING:
        out.fault("added", e, f"{d:.3f} mm from the original's way, the largest correction is {bound:.3f} mm")
    for part in ("tool", "wobj"):
        if not close(a.get(part), b.get(part), 1e-3):
            out.fault("argument", e, f"{part} of an added target")


def close(a: Any, b: Any, slack: float) -> bool:
    """Equal, numbers to within the slack (lengths in mm)."""
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(close(a[k], b[k], slack) for k in a)
    if isinstance(a, list):
        return isinstance(b, list) and len(a) == len(b) and all(close(x, y, slack) for x, y in zip(a, b, strict=True))
    if isinstance(a, bool) or isinstance(b, bool) or not isinstance(a, float) or not isinstance(b, float):
        return bool(a == b)
    return abs(a - b) <= slack


def _values(out: Outcome, first: Interpreter, second: Interpreter, largest: float) -> None:
    after = second.final()
    for name, (type_, value) in first.final().items():
        if name not in after:
            out.fault("data", None, f"`{name}` is gone")
        elif not close(value, after[name][1], largest + ROUNDING if type_ != "string" else 0.0):
            out.fault("data", None, f"`{name}` is {after[name][1]} at the end, not {value}")
