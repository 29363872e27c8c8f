"""Small programs and what the reader makes of them, one row for each: ``corpus/*.txt``.

A file is made of groups::

    # what the group shows
    with DATA                          declarations that all its programs have; a file's first lines give some to all
    show NAME ..                       what is written of every event beside its place, where it is not the usual value
    + DATA                             further declarations of the program that follows
    STATEMENTS                         the body of ``main``, one line or several; or a file that begins with MODULE
      = EVENT | EVENT                  the motions that are followed: `x` or `x,y,z` of the target, `?` where there is none
      ! CODE severity: message         what is reported of the program
    STATEMENTS => EVENT | EVENT        the same in one line

``@(n)`` stands for ``MoveL Offs(p,n,0,0),v100,z10,tool0;`` and ``@n`` for the same with one word, ``@z(n)`` for one n mm
higher, ``@[q]`` for a move to ``q`` itself, ``@{1,2,3}`` for the numbers of a target.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import JointTarget, RobTarget
from postproc.rapid.execution.walk import walk_program
from tests.rapid.build import module, program, target

FOLDER = Path(__file__).parent / "corpus"
TARGET = re.compile(r"@\{([^{}]*)\}")
MOVE = re.compile(r"@(z?)(?:(\w+)|\(((?:[^()]|\([^()]*\))*)\)|\[([^\[\]]*)\])")


@dataclass(frozen=True)
class Case:
    place: str  # file and line
    text: str  # of the program
    facets: tuple[str, ...]
    expected: str


def written(text: str) -> str:
    """The statements with every short form written out."""

    def move(match: re.Match[str]) -> str:
        up, word, offset, goal = match.groups()
        if goal is not None:
            return f"MoveL {goal},v100,z10,tool0;"
        offset = offset or word
        return f"MoveL Offs(p,{f'0,0,{offset}' if up else f'{offset},0,0'}),v100,z10,tool0;"

    numbers = TARGET.sub(lambda match: target(*match[1].split(",")), text)
    return MOVE.sub(move, numbers)


def cases(path: Path) -> Iterator[Case]:
    """The programs of a file with their rows."""
    groups = re.split(r"^# .*\n", path.read_text(encoding="utf-8"), flags=re.M)
    common, row = "", 1
    for i, group in enumerate(groups):
        data, own, body, expected = common, "", [], []
        facets: tuple[str, ...] = ()
        for number, line in enumerate([*group.splitlines(), ""], row):
            if expected and not line.startswith("  "):
                text = "\n".join(body)
                whole = text if text.startswith("MODULE") else module(text, data + own).decode("latin-1")
                yield Case(f"{path.stem}:{number}", written(whole), facets, "\n".join(expected))
                own, body, expected = "", [], []
            word, _, rest = line.partition(" ")
            statements, arrow, events = line.rpartition(" => ")
            if word == "with":
                data += rest + "\n"
            elif word == "+":
                own += rest + "\n"
            elif word == "show":
                facets = tuple(rest.split())
            elif line.startswith(("  = ", "  ! ")):
                expected.append(line)
            elif arrow:
                body.append(statements)
                expected.append(f"  = {events}")
            elif line:
                body.append(line)
        common = data if i == 0 else common
        row += group.count("\n") + 1


def short(value: Any) -> str:
    """A value as it is written in a row."""
    if isinstance(value, float | int) and not isinstance(value, bool):
        return f"{value:.6g}"
    if isinstance(value, tuple):
        return ",".join(map(short, value))
    return str(value)


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
    "first": (field("first"), False),
    "back": (lambda e: e.resumes_from is not None, False),
    "unreachable": (field("unreachable"), False),
    "unresolved": (field("has_unresolved_runs"), False),
    "start": (field("start"), None),
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


ALL = [case for path in sorted(FOLDER.glob("*.txt")) for case in cases(path)]


@pytest.mark.parametrize("case", ALL, ids=[case.place for case in ALL])
def test_a_program_is_followed_as_its_row_says(case: Case) -> None:
    read = program(case.text)
    walked = walk_program(read)
    lines = [row(walked.events, case.facets)] if "  = " in f"\n{case.expected}" else []
    if "  ! " in case.expected or "findings" in case.facets:
        lines += [
            f"  ! {d.code} {d.severity}: {d.message}" + (f" help: {d.help}" if "help" in case.facets and d.help else "")
            for d in (*read.diagnostics, *walked.diagnostics)
        ]
    assert "\n".join(lines) == case.expected, case.text
