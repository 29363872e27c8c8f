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


MOVE = module("MoveL p,v5,z0,tool0;", P)


@pytest.mark.parametrize(
    "data",
    [
        b"%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n\n" + MOVE,
        b"\xef\xbb\xbf%%%\r\n  VERSION:1\r\n  LANGUAGE:ENGLISH\r\n%%%\r\n" + MOVE,
        b"! TACO Target Robot: T_ROB1\n" + MOVE,
        b"\xe3\x80\x80\xe3\x80\x80\n" + MOVE,
        b"\n\n\t" + MOVE,
        MOVE + "!      © 2025 TIA".encode(),
        MOVE.replace(b"\n", b"\r\r\n"),
        *(MOVE.replace(b" ", blank) for blank in (b"\xe3\x80\x80", b"\xc2\xa0", b"\x0b", b"\x0c", b"\t")),
    ],
)
def test_text_around_a_module_and_unusual_blanks(data: bytes) -> None:
    read = program(data)
    assert read.diagnostics == () and places(walk(read)) == [(1, 2, 3)]


@pytest.mark.parametrize(
    ("data", "findings"),
    [
        *((bytes([first, 0x48, 0x03, 0x1B, 0x4A, 0x25, 0x1C, 0x58, 0xB0, 0x00, 0x40]), ["RAP013 info"]) for first in (0xFC, 0xFD, 0xFE)),
        (b"", ["RAP001 error"]), (b" \r\n", ["RAP001 error"]), (b"PK\x03\x04\x00\x00", ["RAP002 error"]),
        (b"hello", ["RAP011 error"]), ("MODULE M\nENDMODULE".encode("utf-16"), ["RAP016 error"]),
        (b"MODULE M\r! new\rENDMODULE\r", ["RAP017 error"]),
        (b'<?xml version="1.0" encoding="ISO-8859-1" ?><Program><Module>M.mod</Module></Program>', []),
    ],
)  # fmt: skip
def test_files_that_are_no_program(data: bytes, findings: list[str]) -> None:
    read = program(data)
    assert [f"{d.code} {d.severity}" for d in read.diagnostics] == findings
    assert read.statements == ()


@pytest.mark.parametrize(
    ("head", "attributes"),
    [("MODULE X(SYSMODULE)", ("SYSMODULE",)), ("module X ( sysmodule , noStepin )", ("SYSMODULE", "NOSTEPIN"))],
)
def test_module_attributes_in_any_case(head: str, attributes: tuple[str, ...]) -> None:
    assert program(head + "\nendmodule").modules[0].attributes == attributes


def test_alternatives_in_a_signature() -> None:
    read = program("MODULE M FUNC robtarget f(\\switch R1|switch R2,INOUT num a{*,*}) ENDFUNC ENDMODULE")
    parameters = read.modules[0].routines[0].parameters
    assert [(p.name, p.optional, p.mode, p.rank) for p in parameters] == [
        ("r1", True, "SWITCH", 0), ("r2", True, "SWITCH", 0), ("a", False, "INOUT", 2),
    ]  # fmt: skip


def test_a_file_declares_what_another_one_uses() -> None:
    one = Source("main.mod", module("MoveL PX,v5,z0,T\\WObj:=w;"))
    data = f"CONST robtarget px:={target(4, 5, 6)};\n{TOOL}\n{WOBJ}"
    two = Source("user.sys", f"MODULE User(SYSMODULE)\n{data}\nENDMODULE".encode())
    (event,) = walk(read_program([one, two]))
    assert event.reason is None and places([event]) == [(4, 5, 6)] and event.tool.tload.mass == 2
    assert event.target_origin.spans is not None and event.target_origin.spans.source is two


def test_local_data_hides_the_data_of_other_modules() -> None:
    one = Source("a.mod", module("MoveL p,v5,z0,tool0;", f"LOCAL CONST robtarget p:={target(1, 1, 1)};"))
    two = Source("b.mod", module("", P, "B").replace(b"main", b"other"))
    assert places(walk(read_program([two, one]))) == [(1, 1, 1)]


@pytest.mark.parametrize("copy", [MOVE, MOVE.replace(b"MODULE M", b"MODULE m")])
def test_two_modules_of_one_name_are_an_error(copy: bytes) -> None:
    """An older copy in the folder of a task: its routines have the names of the others. What is read along is no copy."""
    one, other = Source("a.mod", MOVE), Source("old a.mod", copy)
    (finding,) = read_program([one, other]).diagnostics
    assert (finding.code, finding.severity, finding.source) == ("RAP012", "error", other)
    assert "stands in `a.mod` too" in finding.message
    assert read_program([one, replace(other, read_only=True)]).diagnostics == ()


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
        assert [(a.span, a.full_span) for a in statement.arguments] == [(span, whole) for _, span, whole in pieces]
        assert [text[slice(*a.span)].decode() for a in statement.arguments] == [a.text for a in statement.arguments]
