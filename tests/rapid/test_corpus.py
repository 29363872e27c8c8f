"""Small programs and the motions that the reader follows in them: a row for each in ``corpus/*.txt``.

A motion is shown as `x` or `x,y,z` of its target, `?` where there is none; what is as `target()` writes it is left out.
`show taught-NAME` states with `--taught` that data stands as routines set it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from postproc.diagnostics import Source
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import JointTarget, RobTarget
from postproc.rapid.execution.measured import say_measured
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.program.program import read_program
from tests.corpus import Case, cases, short


def field(path: str) -> Callable[[MotionEvent], Any]:
    def value(event: MotionEvent) -> Any:
        result: Any = event
        for name in path.split("."):
            result = getattr(result, name, None)
        return result

    return value


# What a row can show: how it is read, and the value that is not written.
FACETS: dict[str, tuple[Callable[[MotionEvent], Any], Any]] = {
    "tool": (field("tool.name"), "tool0"),
    "toolframe": (field("tool.tframe.trans"), (0, 0, 0)),
    "wobj": (field("wobj.name"), "wobj0"),
    "load": (field("gripload.mass"), 0),
    "tload": (field("tool.tload.mass"), 0.001),
    "speed": (field("speed.v_tcp"), 100),
    "axisspeed": (lambda e: (e.speed.v_leax, e.speed.v_reax), (5000, 1000)),
    "zone": (lambda e: "fine" if e.zone.finep else e.zone.pzone_tcp, 10),
    "time": (field("duration"), None),
    "instruction": (field("statement.instruction"), "MoveL"),
    "roles": (lambda e: " ".join(e.statement.roles), ""),
    "by": (field("statement.interpolation"), "line"),
    "routine": (field("statement.routine"), "main"),
    "kind": (field("target_origin.kind"), "declared"),
    "of": (field("target_origin.declaration"), None),
    "weld": (lambda e: e.weld and f"{e.weld.phase} {e.weld.speed}", None),
    "displaced": (field("displacement.trans"), (0, 0, 0)),
    "frames": (lambda e: (e.wobj.uframe.trans[0], e.wobj.oframe.trans[0]), (0, 0)),
    "override": (field("velocity_override"), 100),
    "limit": (field("velocity_limit"), None),
    "acceleration": (field("acceleration"), 100),
    "options": (lambda e: "/".join(f"{k}:{v}" for k, v in e.options.items()), "conf_l:True/conf_j:True/wrist_in_joints:False"),
    "wrist": (lambda e: e.options.get("wrist_in_joints"), False),
    "offset": (field("axis_offset"), (0,) * 6),
    "units": (lambda e: "/".join(f"{k}:{v}" for k, v in e.units or ()), ""),
    "conditional": (field("conditional"), False),
    "detached": (field("detached"), False),
    "first": (field("start_unknown"), False),
    "back": (lambda e: e.resumes_from is not None, False),
    "unreachable": (field("unreachable"), False),
    "unresolved": (field("has_unresolved_runs"), False),
    "numbers": (lambda e: "/".join(f"{k}:{v:g}" for k, v in e.numbers if not k.startswith("p.")), ""),
    "assumed": (lambda e: "; ".join(text for text in e.assumed if not text.startswith("what ")), ""),
    "state": (lambda e: "; ".join(text for text in e.assumed if text.startswith("what ")), ""),
    "why": (field("reason"), None),
}  # fmt: skip


def place(event: MotionEvent) -> str:
    """Target of an event: what is as in `target()` of the builders is not written."""

    def robtarget(goal: RobTarget) -> str:
        text = short(goal.trans) if any(goal.trans[1:]) else short(goal.trans[0])
        turned = "" if goal.rot == (0, 1, 0, 0) else f" rot {short(goal.rot)}"
        posture = "" if goal.robconf == (0, 0, 0, 0) else f" conf {short(goal.robconf)}"
        axes = "" if min(goal.extax) >= 9e9 else f" axes {short(goal.extax)}"
        return text + turned + posture + axes

    via = "" if event.via is None else f"via {robtarget(event.via)} to "
    if event.target is None:
        return via + "?"
    if isinstance(event.target, JointTarget):
        return f"joints {short(event.target.robax)}"
    return via + robtarget(event.target)


def row(events: list[MotionEvent], facets: tuple[str, ...]) -> str:
    parts = []
    for event in events:
        shown = [place(event)]
        for name in facets:
            get, usual = FACETS.get(name, (None, None))
            if get is not None and (value := get(event)) != usual:
                shown.append(name if value is True else f"{name} {short(value)}")
        parts.append(" ".join(shown))
    return "  = " + (" | ".join(parts) or "nothing")


ALL = [case for path in sorted((Path(__file__).parent / "corpus").glob("*.txt")) for case in cases(path)]


@pytest.mark.parametrize("case", ALL, ids=[case.place for case in ALL])
def test_a_program_is_followed_as_its_row_says(case: Case) -> None:
    taught = [name.removeprefix("taught-") for name in case.facets if name.startswith("taught-")]
    read = read_program(Source("test.mod", case.text.encode("latin-1")), taught)
    walked = walk_program(read)
    measured = say_measured(read, walked.events).values() if case.place.startswith("taught") else ()
    lines = [row(walked.events, case.facets)] if "  = " in f"\n{case.expected}" else []
    if case.reports:
        lines += [
            f"  ! {d.code} {d.severity}: {d.message}" + (f" help: {d.help}" if "help" in case.facets and d.help else "")
            for d in (*read.diagnostics, *walked.diagnostics, *measured)
        ]
    assert "\n".join(lines) == case.expected, case.text
