r"""Lines and arcs whose ends state different wrists: only ``SingArea\Wrist`` leads the arm over them.

The lowest bit of ``cfx`` is the sign of axis 5 (Technical reference manual RAPID, ``confdata``). The setting lasts from
routine to routine: a program that uses it may rely on it where the text, followed from its start, has it off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from types import MappingProxyType

from postproc.diagnostics import Diagnostic
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import RobTarget

SETTING = "wrist_in_joints"


def assume_wrist(events: Sequence[MotionEvent]) -> tuple[list[MotionEvent], list[Diagnostic]]:
    r"""The events, with ``SingArea\Wrist`` switched on where a line or arc would change the sign of axis 5.

    Nothing changes in a program that never switches it on.

    Returns:
        The events, and RAP026 at each statement for which it is assumed.
    """
    assumed = list(events)
    if not any([now.options.get(SETTING) for now in {event.in_force for event in events}]):
        return assumed, []
    findings: dict[object, Diagnostic] = {}
    for i, (before, event) in enumerate(pairwise(events), 1):
        if not event.options.get(SETTING) and _flips(before, event):
            options = MappingProxyType({**event.options, SETTING: True})
            assumed[i] = replace(event, in_force=replace(event.in_force, options=options))
            argument = event.statement.argument("to")
            span = event.statement.span if argument is None else argument.span
            text = r"axis 5 changes its sign on the way to this target: `SingArea\Wrist` is taken to be in force here"
            help_ = r"set it in front, if an operator starts here; other paths of the program set it elsewhere"
            finding = Diagnostic("RAP026", "warning", text, event.statement.source, span, help_)
            findings.setdefault(event.statement.key, finding)
    return assumed, list(findings.values())


def _flips(before: MotionEvent, event: MotionEvent) -> bool:
    """Whether a line or arc, monitored by ConfL, has ends whose configurations state different signs of axis 5."""
    in_space = event.statement.interpolation in ("line", "arc") and not event.first and event.resumes_from is None
    if not in_space or not all(e.options.get("conf_l") is not False for e in (before, event)):
        return False
    ends = before.target, event.target
    bits = [target.robconf[3] for target in ends if isinstance(target, RobTarget)]
    return len(bits) == 2 and bool((bits[0] ^ bits[1]) & 1)
