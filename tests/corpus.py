"""Files of small programs with a row for what the product must make of each; rooms read them in `test_corpus.py`.

A file is made of groups::

    # what the group shows [NAME ..]   with what is written beside the usual, as by `show`
    with DATA                          declarations that all its programs have; a file's first lines give some to all
    show NAME ..                       what is written beside the usual, where it has not the usual value
    + DATA                             further declarations of the program that follows
    at NAME X Y Z, ..                  targets that it declares, `with at` of all; where Z is as usual it is left out
    lent DATA                          what a second file has, which is read along and not changed
    use NAME=VALUE ..                  options with which it and those behind it are converted
    STATEMENTS                         the body of ``main``, one line or several; or a file that begins with MODULE
      = EVENT | EVENT                  what is made of its motions, one after another
      ! CODE severity: message         what is reported of the program, in groups where one has a finding or shows `findings`
      > TEXT                           what a conversion makes of its text
    STATEMENTS => EVENT | EVENT        the same in one line

``@(n)`` stands for ``MoveL Offs(p,n,0,0),v100,z10,tool0;`` and ``@n`` for the same with one word, ``@z(n)`` for one n mm
higher, ``@[q]`` for a move to ``q`` itself, ``@{1,2,3}`` for the numbers of a target.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.rapid import build

TARGET = re.compile(r"@\{([^{}]*)\}")
MOVE = re.compile(r"@(z?)(?:(\w+)|\(((?:[^()]|\([^()]*\))*)\)|\[([^\[\]]*)\])")


@dataclass(frozen=True)
class Case:
    place: str  # file and line
    text: str  # of the program
    facets: tuple[str, ...]
    expected: str
    reports: bool  # whether the row must name every finding: some program of its group has one, or `findings` are shown
    options: dict[str, Any]
    lent: str  # module that is read along


def usual_module(data: str, body: str) -> str:
    """The module of the reader's rooms."""
    return build.module(body, data).decode("latin-1")


def written(text: str, target: Callable[..., str] = build.target) -> str:
    """The statements with every short form written out; what makes a target of its numbers."""

    def move(match: re.Match[str]) -> str:
        up, word, offset, goal = match.groups()
        if goal is not None:
            return f"MoveL {goal},v100,z10,tool0;"
        offset = offset or word
        return f"MoveL Offs(p,{f'0,0,{offset}' if up else f'{offset},0,0'}),v100,z10,tool0;"

    numbers = TARGET.sub(lambda match: target(*match[1].split(",")), text)
    return MOVE.sub(move, numbers)


def declared(places: str) -> str:
    """Declarations of targets: `name x y z` of each, separated by commas."""
    each = (place.split() for place in places.split(","))
    return "\n".join(f"CONST robtarget {name}:=@{{{','.join(at)}}};" for name, *at in each)


def option(text: str) -> tuple[str, Any]:
    """Name and value of an option that is written as `name=value`."""
    name, _, value = text.partition("=")
    try:
        return name, ast.literal_eval(value)
    except (SyntaxError, ValueError):
        return name, value


def cases(
    path: Path, module: Callable[[str, str], str] = usual_module, target: Callable[..., str] = build.target
) -> Iterator[Case]:
    """The programs of a file with their rows; what makes a module of data and a body, and a target of its numbers."""
    first, *rest = re.split(r"^# .*?(?: \[([\w -]+)\])?\n", path.read_text(encoding="utf-8"), flags=re.M)
    common, row = "", 1
    for i, (shown, group) in enumerate([("", first), *zip(rest[::2], rest[1::2], strict=True)]):
        data, own, body, expected = common, "", [], []
        facets = tuple((shown or "").split())
        options: dict[str, Any] = {}
        lent = ""
        for number, line in enumerate([*group.splitlines(), ""], row):
            if expected and not line.startswith("  "):
                text = "\n".join(body)
                whole = text if text.startswith("MODULE") else module(data + own, text)
                reports = "\n  ! " in group or "findings" in facets
                texts = [written(each, target) for each in (whole, lent)]
                place = f"{path.stem}:{number}"
                yield Case(place, texts[0], facets, "\n".join(expected), reports, options, texts[1])
                own, body, expected = "", [], []
            word, _, after = line.partition(" ")
            statements, arrow, events = line.rpartition(" => ")
            if word == "with":
                data += (declared(after[3:]) if after.startswith("at ") else after) + "\n"
            elif word == "+":
                own += after + "\n"
            elif word == "at":
                own += declared(after) + "\n"
            elif word == "lent":
                lent += after + "\n"
            elif word == "use":
                options = dict(map(option, after.split()))
            elif word == "show":
                facets = tuple(after.split())
            elif line.startswith(("  = ", "  ! ", "  > ")):
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
