"""What stands around, before and behind the modules, and several files of one task."""

from __future__ import annotations

from dataclasses import replace

import pytest

from postproc.diagnostics import Source
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.arguments import read_arguments
from postproc.rapid.program.program import read_program
from tests.rapid.build import module, places, program, target

P = f"CONST robtarget p:={target(1, 2, 3)};"
TOOL = "PERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[2,[0,0,50],[1,0,0,0],0,0,0]];"
WOBJ = 'PERS wobjdata w:=[FALSE,TRUE,"",[[100,0,0],[1,0,0,0]],[[0,10,0],[1,0,0,0]]];'
WELD = "PERS seamdata s:=[0,0];PERS welddata wd:=[8,0,[0,0,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];"


def codes(text: bytes | str) -> list[str]:
    return [d.code for d in program(text).diagnostics]


@pytest.mark.parametrize(
    "before",
    [
        b"%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n\n",
        b"\xef\xbb\xbf%%%\r\n  VERSION:1\r\n  LANGUAGE:ENGLISH\r\n%%%\r\n",
        b"! TACO Target Robot: T_ROB1\n",
        b"\xe3\x80\x80\xe3\x80\x80\n",
        b"\n\n\t",
    ],
)
def test_text_before_the_module(before: bytes) -> None:
    found = program(before + module("MoveL p,v100,z10,tool0;", P))
    assert [m.name for m in found.modules] == ["M"]
    assert len(found.statements) == 1
    assert found.diagnostics == ()


def test_comment_after_the_module() -> None:
    assert codes(module("", P) + "!      © 2025 TIA".encode()) == []


@pytest.mark.parametrize("first", [0xFC, 0xFD, 0xFE])
def test_encrypted_module(first: int) -> None:
    found = program(bytes([first, 0x48, 0x03, 0x1B, 0x4A, 0x25, 0x1C, 0x58, 0xB0, 0x00, 0x40]))
    assert found.modules == ()
    assert [(d.code, d.severity) for d in found.diagnostics] == [("RAP013", "info")]


@pytest.mark.parametrize(
    ("data", "code"),
    [(b"", "RAP001"), (b" \r\n", "RAP001"), (b"PK\x03\x04\x00\x00", "RAP002"), (b"hello", "RAP011"),
     ("MODULE M\nENDMODULE".encode("utf-16"), "RAP016"), (b"MODULE M\r! new\rENDMODULE\r", "RAP017")],
)  # fmt: skip
def test_files_that_are_no_program(data: bytes, code: str) -> None:
    found = program(data)
    assert [d.code for d in found.diagnostics if d.severity == "error"] == [code]


def test_program_list_is_no_program_and_no_error() -> None:
    assert codes(b'<?xml version="1.0" encoding="ISO-8859-1" ?><Program><Module>M.mod</Module></Program>') == []


@pytest.mark.parametrize(
    ("head", "attributes"),
    [("MODULE X(SYSMODULE)", ("SYSMODULE",)), ("module X ( sysmodule , noStepin )", ("SYSMODULE", "NOSTEPIN"))],
)
def test_module_attributes_in_any_case(head: str, attributes: tuple[str, ...]) -> None:
    assert program(head + "\nendmodule").modules[0].attributes == attributes


def test_alternatives_in_a_signature() -> None:
    found = program("MODULE M FUNC robtarget f(\\switch R1|switch R2,INOUT num a{*,*}) ENDFUNC ENDMODULE")
    parameters = found.modules[0].routines[0].parameters
    assert [(p.name, p.optional, p.mode, p.rank) for p in parameters] == [
        ("r1", True, "SWITCH", 0), ("r2", True, "SWITCH", 0), ("a", False, "INOUT", 2),
    ]  # fmt: skip


@pytest.mark.parametrize("blank", [b"\xe3\x80\x80", b"\xc2\xa0", b"\x0b", b"\x0c", b"\t"])
def test_unusual_blanks(blank: bytes) -> None:
    data = module("@MoveL@p,@v5,@z0,@tool0;@", P).replace(b"@", blank)
    assert places(walk(program(data))) == [(1, 2, 3)]


def test_cr_cr_lf_line_ends() -> None:
    assert places(walk(program(module("MoveL p,v5,z0,tool0;", P).replace(b"\n", b"\r\r\n")))) == [(1, 2, 3)]


def test_several_files_of_one_task() -> None:
    one = Source("main.mod", module("MoveL PX,v5,z0,TT\\WObj:=w;"))
    two = Source(
        "user.sys",
        f"MODULE User(SYSMODULE)\nCONST robtarget px:={target(4, 5, 6)};\n{TOOL.replace(' t:', ' tt:')}\n{WOBJ}\nENDMODULE".encode(),
    )
    found = walk(read_program([one, two]))
    assert places(found) == [(4, 5, 6)]
    assert found[0].tool.tload.mass == 2
    assert found[0].target_origin.spans is not None
    assert found[0].target_origin.spans.source is two
    assert found[0].reason is None


def test_local_data_hides_the_data_of_other_modules() -> None:
    one = Source("a.mod", module("MoveL p,v5,z0,tool0;", f"LOCAL CONST robtarget p:={target(1, 1, 1)};"))
    two = Source("b.mod", module("", P, "B").replace(b"main", b"other"))
    assert places(walk(read_program([two, one]))) == [(1, 1, 1)]


def test_two_modules_of_one_name_are_an_error() -> None:
    """An older copy in the folder of a task: its routines have the names of the others. What is read along is no copy."""
    files = [Source(f"{name}.mod", module("MoveL p,v5,z0,tool0;", P)) for name in ("a", "old a")]
    shouted = replace(files[1], data=files[1].data.replace(b"MODULE M", b"MODULE m"))
    for other in (files[1], shouted):
        [found] = read_program([files[0], other]).diagnostics
        assert (found.code, found.severity, found.source) == ("RAP012", "error", other)
        assert "stands in `a.mod` too" in found.message
    assert read_program([files[0], replace(files[1], read_only=True)]).diagnostics == ()


@pytest.mark.parametrize(("scope", "tool", "codes"), [("", "t", []), ("TASK ", None, ["RAP012"]), ("LOCAL ", None, [])])
def test_only_global_persistent_data_is_one_object_in_all_tasks(scope: str, tool: str | None, codes: list[str]) -> None:
    """TASK PERS data has the name of another task's PERS data and is not it, so it has no value from there."""
    own = module("MoveL p,v5,z0,t;", P + f"{scope}PERS tooldata t;")
    files = [Source("own.mod", own), Source("other.mod", module("", TOOL, name="Other"), read_only=True)]
    read = read_program(files)
    assert [d.code for d in read.diagnostics] == codes
    event = walk(read)[0]
    assert (event.tool.name if event.reason is None else None) == tool


STATEMENTS = r"""
    MoveL p1,v100,z10,tool0;
    MoveL p1234,v100,z10,tool0;
    MoveL p1 ,v100,z10,tool0;
    MoveL p1! here, or there
      ,v100,z10,tool0;
    MoveL \Conc,p1,v100,z10,tool0;
    MoveL p1\ID:=5,v100,z10,tool0;
    MoveL ToPoint:=p1,v100,z10,tool0\WObj:=wobj0;
    MoveL Offs(p1,0,0,5),v100\V:=50,z10,tool0;
    MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tool0;
    MoveL [[ 1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tool0;
    MoveC p1,p2,v100,z10,tool0;
    MoveC p1 , [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]] ,v100,z10,tool0;
    MoveC p1\X,p2,v100,z10,tool0;
    MoveC p1;
    MoveL ;
    SearchL di1,p1,p2,v100,tool0;
    MoveLSync p1,v100,z10,tool0,"proc1";
    ArcL p1,v100,sm1,wd1\Weave:=wv1,z1,tool0;
    ArcL p22,v100,sm1,wd1\Weave:=wv1,z1,tool0;
"""


def test_statements_of_one_shape_say_where_their_own_arguments_stand() -> None:
    """What is read once for all that read alike is what each gives when it is read alone."""
    text = f"MODULE M\nPROC main()\n{STATEMENTS}ENDPROC\nENDMODULE\n".encode()
    program = read_program(Source("m.mod", text))
    assert len(program.statements) == STATEMENTS.count(";")
    assert program.statements[0].shape is program.statements[1].shape is not program.statements[2].shape
    assert program.statements[-1].shape is program.statements[-2].shape
    for statement in program.statements:
        name = len(statement.source.data[slice(*statement.span)].split()[0].rstrip(b";"))
        pieces = read_arguments(text, statement.span[0] + name, statement.span[1])
        assert [(a.span, a.whole) for a in statement.arguments] == [(span, whole) for _, span, whole in pieces]
        assert [text[slice(*a.span)].decode() for a in statement.arguments] == [a.text for a in statement.arguments]
