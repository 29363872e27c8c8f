"""Statements with the function around their targets, a row of ``statements.txt`` each: all else stays byte for byte."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from postproc.diagnostics import Source
from postproc.rapid.program.program import read_program
from postproc.rapid.syntax.spans import edited
from postproc.runtime.programs.reach import run_time_edits
from tests.worlds.parser import parse

FRAME = "[[0,0,0],[1,0,0,0]]"
HEAD = f"""MODULE m\r
    PERS tooldata tWeld1:=[TRUE,{FRAME},[1,[0,0,10],[1,0,0,0],0,0,0]];\r
    TASK PERS wobjdata wobjWeldLine1:=[FALSE,TRUE,"",{FRAME},{FRAME}];\r
  PROC main()\r
    """
TAIL = " ! kept\r\n  ENDPROC\r\nENDMODULE"
ROWS = re.findall(r"^(\S.*)\n  (?:> (.*)|= as it is)$", Path(__file__).with_name("statements.txt").read_text(), re.M)


def corrected(statement: str) -> str:
    """The only motion statement of a program through the function, empty where it stays; others can read the text."""
    data = f"{HEAD}{statement}{TAIL}".encode("latin-1")
    (motion,) = read_program(Source("m.mod", data)).statements
    edits = run_time_edits(motion)
    if edits is None:
        return ""
    text = b"".join(edited(data, edits)).decode("latin-1")
    assert text.startswith(HEAD) and text.endswith(TAIL)
    parse(text)
    return text[len(HEAD) : -len(TAIL)]


@pytest.mark.parametrize(("statement", "expected"), ROWS, ids=[statement for statement, _ in ROWS])
def test_the_target_goes_through_the_function(statement: str, expected: str) -> None:
    assert corrected(statement) == expected
    assert not expected or corrected(expected) == expected


def test_every_row_is_read() -> None:
    assert len(ROWS) == 14
