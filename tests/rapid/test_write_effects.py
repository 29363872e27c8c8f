"""What may write declared data while a program runs: the text of these files, and what is in none of them."""

from __future__ import annotations

import pytest

from postproc.rapid.program.late_binding import may_be, text_template
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


def written(body: str, more: str = "") -> set[str]:
    """Names of the data that may be written."""
    text = f"MODULE M\n{DATA}\nPROC main()\n{body}\nENDPROC\n{more}\nENDMODULE\n"
    return {key.rsplit(".", 1)[1] for key in WriteEffects(program(text)).may_be_written}


SET = "PROC rSet1()\n  pSet:=pConst; nOwn:=2;\nENDPROC"


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("MoveL pPers,v5,z0,tool0; TPWrite \"a\"; WaitTime 1; ClkReset clk; SetDO do1,1; Incr nOwn;", {"nown"}),
        ("rMeasure;", {"ppers", "n"}),
        ("rMeasure pOwn;", {"ppers", "n", "pown"}),
        ("x:=fMeasure(1);", {"ppers", "n"}),
        ("x:=fMeasure(pOwn);", {"ppers", "n", "pown"}),
        ("x:=Offs(pOwn,0,0,0); y:=CRobT(); z:=Distance(a,b);", set()),
        ("%\"rMeasure\"%;", {"ppers", "n"}),
        ("%\"rMeasure\"% pOwn;", {"ppers", "n", "pown"}),
        ("%sName% nOwn;", {"ppers", "n", "nown"}),
        ("CallByVar \"rMeasure\",2;", {"ppers", "n"}),
        ("MoveLSync pConst,v5,z0,tool0,\"rMeasure\";", {"ppers", "n"}),
        ("IVarValue \"C:\",1,nOwn,intno;", {"nown"}),
        ("SearchL di1,pOwn,pConst,v5,tool0;", {"pown"}),
    ],
)  # fmt: skip
def test_what_is_in_none_of_the_files_may_write_what_it_can_see(body: str, expected: set[str]) -> None:
    assert written(body) == expected


@pytest.mark.parametrize(
    "call", ["rSet1;", '%"rSet1"%;', 'CallByVar "rSet",1;', 'MoveLSync pConst,v5,z0,tool0,"rSet1";']
)
def test_a_procedure_that_is_named_by_a_text_is_looked_up(call: str) -> None:
    assert written(call, SET) == {"pset", "nown"}


@pytest.mark.parametrize("call", ['%"rSet"+ValToStr(n)%;', 'CallByVar "rSet",n;', "%sName%;"])
def test_a_name_of_which_a_part_is_known_only_at_run_time_may_be_another_too(call: str) -> None:
    assert written(call, SET) == {"pset", "nown", "ppers", "n"}


def test_arguments_of_a_call_by_name_go_to_the_procedure() -> None:
    more = "PROC rPut(INOUT robtarget p,num k)\n  p:=pConst;\nENDPROC"
    assert written('%"rPut"% pOwn,nOwn;', more) == {"pown"}


def test_what_interrupts_write_may_be_written() -> None:
    more = "TRAP tSet\n  pSet:=pConst;\nENDTRAP"
    assert written("CONNECT i1 WITH tSet;", more) == {"pset"}


def test_data_of_a_routine_and_constants_are_out_of_reach() -> None:
    text = "PROC rOther()\n  VAR num nIn:=1;\n  rMeasure;\nENDPROC"
    assert written("rOther;", text) == {"ppers", "n"}


@pytest.mark.parametrize(
    ("text", "name", "fits"),
    [
        ('"rSet"+ValToStr(n)', "rSet12", True), ('"rSet"+ValToStr(n)', "rGet12", False),
        ('"M:"+"rSet1"', "RSET1", True), ('"a"+s+"b"', "ab", True), ('"a"+s+"a"', "a", False),
        ("s", "anything", True), ('""', "x", False), ('"x"', "xx", False), ('s+"b"+t+"c"', "abbc", True),
    ],
)  # fmt: skip
def test_templates_of_names(text: str, name: str, fits: bool) -> None:
    assert may_be(text_template(text.encode()), name) is fits


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
