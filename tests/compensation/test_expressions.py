"""How an offset goes into the text of a target."""

from __future__ import annotations

import pytest

from postproc.compensation.text.slots import target_expression
from postproc.diagnostics import Source
from postproc.rapid.program.program import Program, read_program
from tests.compensation.build import module, target

OWN = "  FUNC robtarget Offs(robtarget p,num x,num y,num z)\n    RETURN p;\n  ENDFUNC\n"


def program(more: str = "") -> Program:
    return read_program([Source("m.mod", module("", f"MoveJ {target(1350, -500)},v200,fine,tT;", more).encode())])


@pytest.mark.parametrize(
    ("text", "form", "in_tool"),
    [
        ("p", "offset", False),
        ("row{i}.at", "offset", False),
        (target(1, 2), "offset", False),
        ("Offs(p,0,n,5)", "amounts", False),
        ("Offs(Offs(p,1,0,0),0,n,5)", "amounts", False),
        ("RelTool(p,0,0,-60)", "amounts", True),
        ("RelTool(p,0,0,-60\\Rz:=3)", "offset", False),
        ("between(a,b,i/4)", "offset", False),
        ("Offs(RelTool(p,1,2,3),0,0,5)", "amounts", False),
    ],
)
def test_how_an_offset_is_written(text: str, form: str, in_tool: bool) -> None:
    found = target_expression(Source("m.mod", text.encode()), (0, len(text)), program())
    assert (found.form, found.in_tool) == (form, in_tool)


@pytest.mark.parametrize(
    ("text", "form"), [("p", "components"), ("Offs(p,1,2,3)", None), ("RelTool(p,1,2,3)", "amounts")]
)
def test_a_program_with_an_offs_of_its_own(text: str, form: str | None) -> None:
    assert target_expression(Source("m.mod", text.encode()), (0, len(text)), program(OWN)).form == form


@pytest.mark.parametrize(
    ("data", "parameters", "body"),
    [
        ("VAR num offs;", "", ""),
        ("", "num offs", ""),
        ("", "", "VAR num OFFS;"),
        ("", "", "Offs:"),
        ("", "", "FOR offs FROM 1 TO 2 DO\nENDFOR"),
    ],
)
def test_data_parameters_and_labels_hide_the_function_too(data: str, parameters: str, body: str) -> None:
    more = f"  PROC other({parameters})\n{body}\nMoveJ p,v200,fine,tT;\n  ENDPROC\n"
    text = module(data, "other 1;", more)
    source = Source("m.mod", text.encode())
    at = text.index("MoveJ p") + len("MoveJ ")
    assert target_expression(source, (at, at + 1), read_program([source])).form == "components"
