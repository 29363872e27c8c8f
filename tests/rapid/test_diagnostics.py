"""The text of every finding, and that each is explained."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from postproc.rapid.walk import walk_program
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
        "  = help: give the file that declares `tTorch` too, often a system module such as user.sys or CalibData.mod"
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


def test_every_code_is_explained() -> None:
    root = Path(__file__).resolve().parents[2]
    used = set()
    for file in (root / "postproc" / "rapid").glob("*.py"):
        used |= set(re.findall(r'"(RAP\d{3})"', file.read_text()))
    explained = re.findall(r"^## (RAP\d{3}) \S", (root / "docs" / "diagnostics" / "RAP.md").read_text(), re.MULTILINE)
    assert sorted(used) == sorted(explained)


def test_missing_tools_are_errors_and_missing_targets_are_warnings() -> None:
    found = walk_program(program(module("MoveL p9,v5,z0,tool0; MoveL p,v5,z0,t9;", P)))
    assert [(d.severity, d.message) for d in found.diagnostics] == [
        ("warning", "the target `p9` has no value in these files"),
        ("error", "the tool `t9` has no value in these files"),
    ]
