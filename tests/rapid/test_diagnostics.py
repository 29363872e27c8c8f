"""The text of every finding, and that each is explained."""

from __future__ import annotations

import pytest

from postproc.diagnostics import PostprocError, Source
from postproc.rapid.execution.walk import walk_program
from postproc.rapid.program.program import read_program
from tests.rapid.build import module, program, target

P = f"CONST robtarget p:={target(1, 2, 3)};"


def rendered(text: bytes | str) -> str:
    found = program(text)
    return "\n".join(d.render() for d in (*found.diagnostics, *walk_program(found).diagnostics))


def test_unknown_tool() -> None:
    assert rendered(module("  MoveL p,v5,z0,tTorch\\WObj:=wobj0;", P)) == (
        "error[RAP020]: the tool `tTorch` has no value in these files\n"
        " --> test.mod:4:17\n"
        "  |\n"
        "4 |   MoveL p,v5,z0,tTorch\\WObj:=wobj0;\n"
        "  |                 ^^^^^^\n"
        "  = help: give the file that declares `tTorch` too (`--with FILE`), often user.sys, CalibData.mod or another task's; "
        "or write a file that declares it, as the pendant shows it: `PERS tooldata tTorch:=..;`"
    )


def test_unknown_work_object_is_reported_once() -> None:
    text = rendered(module("MoveL p,v5,z0,tool0\\WObj:=w; MoveL p,v5,z0,tool0\\WObj:=w;", P))
    assert text.count("RAP020") == 1
    assert "the work object `w` has no value in these files" in text


@pytest.mark.parametrize(
    ("text", "first"),
    [
        ("MODULE M\nPROC main()\n]]; \nENDPROC\nENDMODULE", "warning[RAP003]: `]];` is not understood and is kept as it stands"),
        ("VAR num n;", "warning[RAP004]: data or routines stand outside a MODULE"),
        ("MODULE M\nVAR num n;", "error[RAP005]: module `M` has no ENDMODULE"),
        ("MODULE M PROC a() ENDIF ENDPROC ENDMODULE", "error[RAP006]: `ENDIF` closes nothing in `a`"),
        ("MODULE M PROC a() ENDMODULE", "error[RAP007]: PROC `a` has no ENDPROC"),
        ("MODULE M PROC a()\nn:=1\nENDPROC ENDMODULE", "error[RAP008]: the statement has no `;`"),
        ("MODULE M PROC a() " + "IF a THEN " * 150, "error[RAP009]: blocks are nested deeper than 100"),
        ("MODULE M PROC a() IF b THEN ENDPROC ENDMODULE", "error[RAP010]: IF has no ENDIF"),
        ("hello", "error[RAP011]: there is no MODULE in the file"),
        ("MODULE M VAR num n; ENDMODULE MODULE N VAR num n; ENDMODULE", "warning[RAP012]: `n` is declared in `M` too"),
        ("MODULE M PROC a() MoveL p,v5; ENDPROC ENDMODULE",
         "error[RAP014]: `MoveL` does not have the arguments it needs: to, speed, zone, tool"),
    ],
)  # fmt: skip
def test_messages(text: str, first: str) -> None:
    assert rendered(text).splitlines()[0] == first


def test_missing_tools_are_errors_and_missing_targets_are_warnings() -> None:
    found = walk_program(program(module("MoveL p9,v5,z0,tool0; MoveL p,v5,z0,t9;", P)))
    assert [(d.severity, d.message) for d in found.diagnostics] == [
        ("warning", "the target `p9` has no value in these files"),
        ("error", "the tool `t9` has no value in these files"),
    ]


def test_state_that_only_one_way_sets_is_said() -> None:
    body = "IF di1=1 THEN VelSet 50,800; ConfL\\Off; ENDIF MoveL p,v5,z0,tool0; MoveL p,v5,z0,tool0;"
    found = walk_program(program(module(body, f"CONST robtarget p:={target(0, 0, 0)};"))).diagnostics
    assert [(d.code, d.message.split(" depends")[0]) for d in found] == [
        ("RAP022", "what VelSet sets"), ("RAP022", "what ConfL sets"),
    ]  # fmt: skip
    assert "full speed is taken" in found[0].message


@pytest.mark.parametrize(
    "statement",
    [
        "MoveLGO p,v5,z30,tool0,go1\\Value:=5;", "MoveLGO p,v5,z30,tool0\\WObj:=wobj0,go1\\DValue:=5;",
        "MoveJGO p,v5,z30,tool0,go1\\Value:=5;", "MoveCGO p,p,v5,z30,tool0,go1\\Value:=5;", "MoveLGO p,v5,z30,tool0,go1,5;",
        "MoveLAO p,v5,z30,tool0,ao1,1.1;", "MoveLDO p,v5,z30,tool0,do1,1;", "MoveLSync p,v5,z30,tool0,\"proc1\";",
        "CapL p,v100,cdata,weavestart,weave,z50,gun1;", "CapL p,v500,cdata\\Movestart_timer:=2,wstart,w1,fine,tool0\\T1:=gunon;",
        "CapC p,p,v100,cdata,weavestart,weave,fine,tool0;", "TriggLIOs p,v500,\\TriggData1:=gunon,z50,tool0;",
        "TriggJIOs p,v500\\T:=2,\\TriggData1:=mytriggios,z50,tool0;", "TriggL p,v500,trigg1\\T2:=trigg2,fine,tool0;",
        "TriggC p,p,v500,gunon,fine,tool0;", "MoveExtJ jpos10,vrot10,z50;", "MoveExtJ \\Conc,j,vrot10\\T:=5,fine\\InPos:=inpos20;",
        "SearchExtJ \\Stop,di1,sp,jpos20,vlin50;", "SearchL \\Stop,di2,sp,p,v100,tool0;", "SearchC di1\\Flanks,sp,p,p,v100,tool0;",
        "MoveAbsJ j1\\NoEOffs,v1000\\T:=5,fine,tool0;",
    ],
)  # fmt: skip
def test_arguments_as_the_manuals_give_them(statement: str) -> None:
    """Forms of the instructions in the reference manual: every one has the arguments that its signature asks for."""
    found = program(module(statement, f"CONST robtarget p:={target(0, 0, 0)};"))
    assert len(found.statements) == 1
    assert [d.code for d in found.diagnostics] == []


@pytest.mark.parametrize(
    ("body", "data", "question"),
    [
        ("MoveL p,v5,z0,tTroch;", "PERS tooldata tTorch:=[TRUE,[[0,0,1],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];", "tTorch"),
        (r"MoveL p,v5,z0,tool0\WObj:=wobjO;", "", "wobj0"),
        ("MoveL pStrt,v5,z0,tool0;", f"CONST robtarget pStart:={target(1, 2, 3)};", "pStart"),
        ("MoveL p,v5,zSaem,tool0;", "CONST zonedata zSeam:=[FALSE,1,1,1,0.1,1,0.1];", "zSeam"),
        ("MoveL Offs(p,0,0,nHeigth),v5,z0,tool0;", "CONST num nHeight:=5;", "nHeight"),
        ("MoveL p,v5,z0,tool0; rAproach;", "", "rApproach"),
    ],
)  # fmt: skip
def test_a_misspelt_name_is_asked_about(body: str, data: str, question: str) -> None:
    text = module(body, P + data).replace(b"ENDMODULE", b"PROC rApproach()\nENDPROC\nENDMODULE")
    assert f"did you mean `{question}`? If not, give the file" in rendered(text)


@pytest.mark.parametrize("name", ["p20", "tOther", "x"])
def test_what_is_no_misspelling_is_not_asked_about(name: str) -> None:
    """Names that differ in digits alone are siblings, and data of another type is not meant."""
    data = P + f"CONST robtarget p10:={target(1, 2, 3)};VAR num tOthen;"
    assert "did you mean" not in rendered(module(f"MoveL {name},v5,z0,tool0;", data))


def test_a_routine_that_is_called_is_not_meant_by_another_name() -> None:
    text = module("MoveL p,v5,z0,tool0; rApproach; rAproach;", P)
    text = text.replace(b"ENDMODULE", b"PROC rApproach()\nENDPROC\nENDMODULE")
    assert "did you mean" not in rendered(text)


def test_constants_and_first_routines_are_asked_about() -> None:
    source = Source("test.mod", module("MoveL p,v5,z0,tool0;", P + "VAR num nLayer:=1;"))
    found = read_program(source, ["nLayr"])
    assert [d.help for d in found.diagnostics] == ["did you mean `nLayer`?"]
    with pytest.raises(PostprocError, match=r"did you mean `main`\? The routines are: main"):
        walk_program(found, "mian")
