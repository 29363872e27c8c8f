"""Which parts of declared data a program writes, and what holds where the arm stands; the rest is in ``corpus/assumed.txt``."""

from __future__ import annotations

import pytest

from postproc.rapid.program.write_effects import WriteEffects
from tests.rapid.build import module, program, target

DATA = f"""
CONST robtarget pConst:={target(1, 2, 3)};
PERS robtarget pPers:={target(1, 2, 3)};
LOCAL PERS robtarget pOwn:={target(1, 2, 3)};
LOCAL PERS robtarget pSet:={target(1, 2, 3)};
VAR num n:=1;
LOCAL VAR num nOwn:=1;
"""


def test_data_that_is_set_to_where_the_arm_stands() -> None:
    """Straight, from other such data, through a routine, by a search; external axes are no place."""
    names = ["a", "b", "c", "d", "e", "f"]
    data = "".join(f"PERS robtarget {name}:={target(1, 2, 3)};\n" for name in names)
    routines = """PROC keep(INOUT robtarget r)
  r:=CRobT();
ENDPROC
PROC pass_on()
  keep c;
  d:=Offs(c,0,0,5);
  e.extax:=a.extax;
  f:=Offs(e,0,0,5);
ENDPROC
"""
    body = "a:=CRobT(); SearchL di1,b,e,v5,tool0;"
    effects = WriteEffects(program(module(body, data + routines)))
    assert {key.split(".")[-1] for key in effects.measured} == {"a", "b", "c", "d"}


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("pSet.trans.x:=1; pSet.trans:=pConst.trans; pSet.robconf.cf1:=0;", [("robconf", "cf1"), ("trans",)]),
        ("pSet.trans.x:=1; pSet:=pConst;", [()]),
        ("nOwn:=1;", [()]),
    ],
)
def test_a_part_inside_another_that_is_written_is_not_told_apart(body: str, expected: list[tuple[str, ...]]) -> None:
    """In whatever order: what is not known would else differ from run to run."""
    read = program(f"MODULE M\n{DATA}\nPROC main()\n{body}\nENDPROC\nENDMODULE\n")
    declaration = read.declaration("pSet", "M")
    assert declaration is not None
    assert list(WriteEffects(read).paths(declaration)) == expected


FOUND = """
FUNC robtarget fFound()
  VAR robtarget p;
  SearchL di1,p,pConst,v5,tool0;
  RETURN p;
ENDFUNC
PROC rSay(string s,num x)
  VAR robtarget p;
  p:=CRobT();
ENDPROC
"""


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("pSet:=CRobT();", {"pset"}),
        ("pSet:=fFound();", {"pset"}),
        ("pSet:=pConst; pOwn:=CRobT(); pSet.trans:=pOwn.trans;", {"pset", "pown"}),
        ("rSay \"a\",n; pSet:=pConst;", set()),
        ("pSet.extax:=pOwn.extax; pOwn:=CRobT();", {"pown"}),
        ("pSet:=CalcRobT(jThere,tool0);", set()),
    ],
)  # fmt: skip
def test_what_holds_where_the_arm_stands_is_followed_from_where_it_is_read(body: str, expected: set[str]) -> None:
    read = program(f"MODULE M\n{DATA}\nPROC main()\n{body}\nENDPROC\n{FOUND}\nENDMODULE\n")
    assert {key.rsplit(".", 1)[1] for key in WriteEffects(read).measured if ".." in key} == expected
