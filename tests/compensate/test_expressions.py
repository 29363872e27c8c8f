"""How an offset goes into the text of a target, and what the position of a target is made of."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.compensate.text.expressions import Position, position_of, target_expression
from postproc.diagnostics import Source
from postproc.rapid.data.records import RobTarget
from postproc.rapid.program.program import Program, read_program
from tests.compensate.build import module, target

OWN = "  FUNC robtarget Offs(robtarget p,num x,num y,num z)\n    RETURN p;\n  ENDFUNC\n"
TURNED = RobTarget((1000.0, 0.0, 700.0), (0.0, 0.0, 1.0, 0.0), (0, 0, 0, 0), (9e9,) * 6)  # x along -x, z along -z


def program(more: str = "") -> Program:
    return read_program([Source("m.mod", module("", f"MoveJ {target(1350, -500)},v200,fine,tT;", more).encode())])


@pytest.mark.parametrize(
    ("text", "form", "in_tool", "stated"),
    [
        ("p", "offset", False, True),
        ("row{i}.at", "offset", False, True),
        (target(1, 2), "offset", False, False),
        ("Offs(p,0,n,5)", "amounts", False, True),
        ("Offs(Offs(p,1,0,0),0,n,5)", "amounts", False, True),
        ("RelTool(p,0,0,-60)", "amounts", True, False),
        ("RelTool(p,0,0,-60\\Rz:=3)", "offset", False, False),
        ("between(a,b,i/4)", "offset", False, False),
        ("Offs(RelTool(p,1,2,3),0,0,5)", "amounts", False, False),
    ],
)
def test_how_an_offset_is_written(text: str, form: str, in_tool: bool, stated: bool) -> None:
    found = target_expression(Source("t", text.encode()), (0, len(text)), program(), "M")
    assert (found.form, found.in_tool, found.stated) == (form, in_tool, stated)


@pytest.mark.parametrize(
    ("text", "form"), [("p", "components"), ("Offs(p,1,2,3)", None), ("RelTool(p,1,2,3)", "amounts")]
)
def test_a_program_with_an_offs_of_its_own(text: str, form: str | None) -> None:
    assert target_expression(Source("t", text.encode()), (0, len(text)), program(OWN), "M").form == form


@pytest.mark.parametrize(
    ("text", "position"),
    [
        ("p", Position("p")),
        ("(p)", Position("p")),
        ("[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]", Position(None)),
        ("[[1,n,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]", None),
        ("Offs(p,0,Side,5)", Position("p", (("side", (0.0, 1.0, 0.0)),))),
        ("Offs(q{i},2*n,0,0)", Position("q{i}", (("(2*n)", (1.0, 0.0, 0.0)),))),
        ("RelTool(p,0,0,n)", Position("p", (("n", (0.0, 0.0, -1.0)),))),
        ("Offs(RelTool(p,0,0,-3\\Rz:=2),0,n,0)", Position("p", (("n", (0.0, 1.0, 0.0)),))),
        ("RelTool(p,0,n,-3\\Rx:=2)", None),  # along the axes before the turn, which are not those of the value
        ("RelTool(p,0,0,-3\\Rx:=n)", None),
        ("between(a,b,0.5)", None),
    ],
)
def test_what_a_position_is_made_of(text: str, position: Position | None) -> None:
    found = position_of(text, TURNED, program(), "M")
    if position is None or found is None:
        assert found == position
        return
    assert found.reference == position.reference
    assert [name for name, _ in found.terms] == [name for name, _ in position.terms]
    for (_, direction), (_, wanted) in zip(found.terms, position.terms, strict=True):
        np.testing.assert_allclose(direction, wanted, atol=1e-12)


def test_where_a_position_is_with_a_frame() -> None:
    found = Position("p", (("n", (0.0, 0.0, 1.0)),))
    assert found.at(TURNED, {"n": 12.0}).tolist() == [1000.0, 0.0, 712.0]
    with pytest.raises(KeyError):
        found.at(TURNED, {})
