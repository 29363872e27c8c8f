"""The check: a corrected program must do in every world what the original does there, to within its corrections."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.worlds.alignment import identities
from tests.worlds.geometry import angle_between, distance_to_arc, distance_to_segment
from tests.worlds.interpreter import Interpreter
from tests.worlds.real_arm import RealArm
from tests.worlds.syntax import Module
from tests.worlds.task import Event
from tests.worlds.world import World

ROUNDING = 0.004
"""mm: three decimals in the text, and single precision (0.00012 at 2 m) in a few operations."""
TURN = math.radians(0.5)
"""Corrections turn a target by at most this."""


LARGEST = 5.0
"""mm: what the function for run time may correct by."""
FOLLOWING = 0.1
"""A correction that follows a run-time value may grow by this share of the largest one: the deflection of the arm changes
by less than a tenth over the displacements that a world draws."""


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


def compare_worlds(
    original: list[Module],
    corrected: list[Module],
    bound_mm: dict[int, float] | float,
    world: World,
    real: RealArm | None = None,
) -> Outcome:
    """Runs both programs in one world and compares motions and effects.

    Args:
        bound_mm: the largest correction [mm], of the program or by line of the original.
        real: the arm that comes to the targets that a function of the corrected program gives.
    """
    first = Interpreter(original, world)
    before = first.run()
    real = real or RealArm()
    second = Interpreter(corrected, world, identities(original, corrected), real.kinematics.functions)
    after = second.run()
    out = Outcome(world.name, stopped=first.stopped)
    largest = bound_mm if isinstance(bound_mm, float) else max([0.0, *bound_mm.values()])
    _events(out, before, after, bound_mm, largest, real)
    if first.stopped != second.stopped:
        out.fault("stop", None, f"the original ends `{first.stopped}`, the corrected program `{second.stopped}`")
    _values(out, first, second, max(largest, real.largest_mm))
    return out


def _events(
    out: Outcome,
    before: list[Event],
    after: list[Event],
    bounds: dict[int, float] | float,
    largest: float,
    real: RealArm,
) -> None:
    k, waiting, start_bound = 0, [], 0.0
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
                _added(out, added, o, (1 + FOLLOWING) * largest)
            own = 0.0 if isinstance(bounds, float) else bounds.get(o.line, 0.0)
            largest = max(largest, real.largest_mm)  # what is left alone may stand on where the arm has come to
            # a motion that is left alone may stand on data that are corrected for others
            _time(out, o, [*waiting, e])
            bound = own + FOLLOWING * largest if own else largest
            if o.line in real.through:
                bound = LARGEST
                if text := real.compare(o, e):
                    out.fault("goal", o, text)
            _motion(out, o, e, bound, start_bound)
            start_bound = bound
            waiting = []
        elif not close(o.values, e.values, largest + ROUNDING):
            out.fault("effect", o, f"{o.values} in the original, {e.values} here")
    for added in waiting:
        out.fault("order", added, "an added target after the last motion")
    if k < len(before):
        out.fault("order", before[k], "missing in the corrected program")


def _motion(out: Outcome, o: Event, e: Event, bound: float, start_bound: float) -> None:
    """One motion beside the original's; an arc may move as far as the correction at either of its ends."""
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
        if arc > max(bound, start_bound) + ROUNDING + 0.05:
            out.fault("goal", o, f"the circle point is {arc:.3f} mm from the original's arc")
    for part in ("speed", "zone", "tool", "wobj", "conf", "extax", "signal", "value", "seam", "weld", "options"):
        if not close(a.get(part), b.get(part), bound + ROUNDING if part == "wobj" else 1e-3):
            out.fault("argument", o, f"{part} is {b.get(part)}, not {a.get(part)}")


def _time(out: Outcome, o: Event, parts: list[Event]) -> None:
    """The argument T gives the time of a whole way: its parts must take that time together."""
    times = [e.values["options"].pop("t", None) for e in (o, *parts)]
    if times[0] is None and any(times[1:]):
        out.fault("argument", o, "a time where the original has none")
    elif times[0] is not None and (None in times or abs(times[0][1] - sum(t[1] for t in times[1:])) > 1e-3):
        out.fault("argument", o, f"T is {times[0]}, its parts have {times[1:]}")


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
    turned = angle_between(a["start"], a["goal"])
    if max(angle_between(a["start"], b["goal"]), angle_between(b["goal"], a["goal"])) > turned + TURN:
        out.fault("added", e, "turned away from the orientations at both ends")
    if b["zone"] is not None and b["zone"][0]:
        out.fault("added", e, "the arm would stop at it")
    for part in ("tool", "wobj", "speed", "seam", "weld"):
        if not close(a.get(part), b.get(part), bound + ROUNDING if part == "wobj" else 1e-3):
            out.fault("argument", e, f"{part} of an added target")


def close(a: Any, b: Any, slack: float) -> bool:
    """Equal; coordinates (three numbers or more together) to within the slack [mm], so are single numbers that may be one:
    whole ones and those below 1 are compared exactly."""
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(close(a[k], b[k], slack) for k in a)
    if isinstance(a, list):
        if isinstance(b, list) and len(a) == len(b) >= 3 and all(type(v) is float for v in [*a, *b]):
            return all(abs(x - y) <= slack for x, y in zip(a, b, strict=True))
        return isinstance(b, list) and len(a) == len(b) and all(close(x, y, slack) for x, y in zip(a, b, strict=True))
    if isinstance(a, bool) or isinstance(b, bool) or not isinstance(a, float) or not isinstance(b, float):
        return bool(a == b)
    if slack > 0.1 and (abs(a) < 1 or (a == int(a) and b == int(b))):
        return a == b
    return abs(a - b) <= slack


def _values(out: Outcome, first: Interpreter, second: Interpreter, largest: float) -> None:
    after = second.final()
    for name, (type_, value) in first.final().items():
        if name not in after:
            out.fault("data", None, f"`{name}` is gone")
        elif not close(value, after[name][1], largest + ROUNDING if type_ != "string" else 0.0):
            out.fault("data", None, f"`{name}` is {after[name][1]} at the end, not {value}")
