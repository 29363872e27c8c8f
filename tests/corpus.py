"""Files of small programs with a row for what the product must make of each; rooms read them in `test_corpus.py`.

A file is made of groups::

    # what the group shows
    with DATA                          declarations that all its programs have; a file's first lines give some to all
    show NAME ..                       what is written beside the usual, where it has not the usual value
    + DATA                             further declarations of the program that follows
    STATEMENTS                         the body of ``main``, one line or several; or a file that begins with MODULE
      = EVENT | EVENT                  what is made of its motions, one after another
      ! CODE severity: message         what is reported of the program, in groups where one has a finding or shows `findings`
    STATEMENTS => EVENT | EVENT        the same in one line

``@(n)`` stands for ``MoveL Offs(p,n,0,0),v100,z10,tool0;`` and ``@n`` for the same with one word, ``@z(n)`` for one n mm
higher, ``@[q]`` for a move to ``q`` itself, ``@{1,2,3}`` for the numbers of a target.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.rapid.build import module, target

TARGET = re.compile(r"@\{([^{}]*)\}")
MOVE = re.compile(r"@(z?)(?:(\w+)|\(((?:[^()]|\([^()]*\))*)\)|\[([^\[\]]*)\])")


@dataclass(frozen=True)
class Case:
    place: str  # file and line
    text: str  # of the program
    facets: tuple[str, ...]
    expected: str
    reports: bool  # whether the row must name every finding: some program of its group has one, or `findings` are shown


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
                reports = "\n  ! " in group or "findings" in facets
                yield Case(f"{path.stem}:{number}", written(whole), facets, "\n".join(expected), reports)
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
