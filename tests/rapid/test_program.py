"""Where declared data is used, and which of its parts are written."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from postproc.rapid.program.references import Use, declaration_uses
from postproc.rapid.program.write_effects import WriteEffects
from tests.rapid.build import module, program, target

P = target(1, 2, 3)
EVERY = """
  MoveL p,v5,z0,tool0\\WObj:=w;   ! p in a comment
  MoveC Offs(p,n,0,0),row{n},v5,z0,tool0;
  go p;
  n:=p.trans.x;
  TPWrite "p" \\Num:=n;
  SearchL di1,found,p,v5,tool0;
  IF Distance(p.trans,found.trans)>n THEN Stop; ENDIF"""
DECLARED = (
    f"CONST robtarget p:={P}; PERS robtarget found:={P}; CONST robtarget near:=p; CONST robtarget row{{2}}:=[p,{P}];"
    'PERS wobjdata w:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]]; VAR num n;'
    "PROC go(robtarget w) MoveL w,v5,z0,tool0; ENDPROC"
)
COUNTED = 'FOR i FROM 1 TO Dim (row, 1) DO MoveL row{i},v5,z0,tool0; ENDFOR TPWrite "Dim(" \\Num:=row{1}.trans.x;'
NAMED = f"PERS robtarget p1:={P}; PERS robtarget q1:={P}; PERS num p2:=0;"


@pytest.mark.parametrize(
    ("body", "data", "expected"),
    [
        (EVERY, DECLARED, {
            "m..p": "other, other, line 5, line 6 displaced, passed to m.go.%w, other, line 10, other",
            "m..found": "other, other", "m..row": "line 6", "m.go.%w": "line 2",
        }),
        (COUNTED, f"CONST robtarget row{{2}}:=[{P},{P}];", {"m..row": "line 4, other"}),
        ('VAR robtarget r; GetDataVal "p"+ValToStr(n),r;', NAMED, {"m..p1": "other", "m.main.r": "other"}),
    ],
    ids=["every kind of use", "its length is no use of an array", "a name in a text"],
)  # fmt: skip
def test_where_data_that_holds_targets_is_used(body: str, data: str, expected: Mapping[str, str]) -> None:
    read = program(module(body, data))
    lines = {statement.key: statement.line for statement in read.statements}

    def shown(use: Use) -> str:
        if use.statement is not None:
            return f"line {lines[use.statement]}" + " displaced" * use.displaced
        return f"passed to {use.parameter}" if use.parameter else "other"

    assert {key: ", ".join(map(shown, uses)) for key, uses in declaration_uses(read).items()} == expected


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("s.trans.x:=1; s.trans:=p.trans; s.robconf.cf1:=0;", [("robconf", "cf1"), ("trans",)]),
        ("s.trans.x:=1; s:=p;", [()]),
        ("", [()]),
    ],
)
def test_a_part_inside_another_that_is_written_does_not_count(body: str, expected: list[tuple[str, ...]]) -> None:
    """In whatever order: what is not known would else differ from run to run."""
    read = program(module(body, f"CONST robtarget p:={P}; LOCAL PERS robtarget s:={P};"))
    declaration = read.declaration("s", "M")
    assert declaration is not None and list(WriteEffects(read).paths(declaration)) == expected
