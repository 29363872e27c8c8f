"""What real programs contain and textbooks do not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from postproc.diagnostics import Source
from postproc.rapid.data.records import RobTarget
from postproc.rapid.execution.walk import walk, walk_program
from postproc.rapid.program.arguments import read_arguments
from postproc.rapid.program.program import read_program
from postproc.rapid.syntax.spans import literal
from tests.rapid.build import UNUSED, events, module, places, program, target

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


def test_code_left_behind_after_the_module_is_reported() -> None:
    assert codes(module("", P) + b"MoveL p,v100,z10,tool0;\nENDMODULE\n") == ["RAP015"]


def test_two_modules_in_one_file_share_their_data() -> None:
    found = program(
        module("MoveL q,v100,z10,tool0;")
        + f"MODULE CalibData\nCONST robtarget q:={target(7, 8, 9)};\nENDMODULE".encode()
    )
    assert [m.name for m in found.modules] == ["M", "CalibData"]
    assert places(walk(found)) == [(7, 8, 9)]


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


def test_free_case() -> None:
    found = events(
        "movel offs(P,0,0,20),V100,Z5,T\\wobj:=W; If 1=1 or b=2 Then MOVEJ p,v5,FINE,tool0; EndIf", P + TOOL + WOBJ
    )
    assert places(found) == [(1, 2, 23), (1, 2, 3)]
    assert [e.statement.instruction for e in found] == ["MoveL", "MoveJ"]
    assert found[0].tool.name == "t"
    assert found[0].wobj.name == "w"
    assert found[1].zone.finep


@pytest.mark.parametrize("option", [", \\WObj:= w", "\\WObj:=w", " \\ WObj := w", "\n  \\WObj:=w ! comment\n"])
def test_blanks_and_commas_around_optional_arguments(option: str) -> None:
    event = events(f"MoveJ p, v100, z5, t{option};", P + TOOL + WOBJ)[0]
    assert event.wobj.uframe.trans == (100, 0, 0)
    assert [a.role for a in event.statement.arguments] == ["to", "speed", "zone", "tool", "\\wobj"]
    assert event.statement.arguments[-1].text == "w"


def test_optional_arguments_between_positional_ones() -> None:
    event = events("ArcL p\\ID:=20, v1000, s, wd\\Weave:=w1, z10, t\\Track:=t1;", P + TOOL + WELD)[0]
    assert [a.role for a in event.statement.arguments] == [
        "to", "\\id", "speed", "seam", "weld", "\\weave", "zone", "tool", "\\track",
    ]  # fmt: skip
    assert event.weld is not None
    assert (event.weld.phase, event.weld.speed) == ("weld", 8.0)


def test_switch_before_the_first_positional_argument() -> None:
    event = events("MoveL \\Conc, p, v100 \\V:=50, z10 \\Z:=3 \\Inpos:=inpos50, tool0;", P)[0]
    assert event.speed.v_tcp == 50
    assert event.zone.pzone_tcp == 3
    assert places([event]) == [(1, 2, 3)]


def test_arguments_given_by_name() -> None:
    event = events("MoveL ToPoint:=p, Speed:=v100, Zone:=fine, Tool:=t;", P + TOOL)[0]
    assert event.tool.name == "t"
    assert places([event]) == [(1, 2, 3)]
    assert event.statement.arguments[0].text == "p"


def test_conditional_optional_argument() -> None:
    data = P + WOBJ + "PROC go(\\PERS wobjdata o\\switch a|switch b) MoveL p,v100,z10,tool0\\WObj?o; ENDPROC"
    found = events("go; go\\o:=w;", data)
    assert [e.wobj.name for e in found] == ["wobj0", "w"]


def test_present_decides_a_branch() -> None:
    data = (
        P
        + "PROC go(\\switch up) IF Present(up) THEN MoveL Offs(p,0,0,9),v5,z0,tool0; ELSE MoveL p,v5,z0,tool0; ENDIF ENDPROC"
    )
    assert places(events("go; go\\up;", data)) == [(1, 2, 3), (1, 2, 12)]


def test_alternatives_in_a_signature() -> None:
    found = program("MODULE M FUNC robtarget f(\\switch R1|switch R2,INOUT num a{*,*}) ENDFUNC ENDMODULE")
    parameters = found.modules[0].routines[0].parameters
    assert [(p.name, p.optional, p.mode, p.rank) for p in parameters] == [
        ("r1", True, "SWITCH", 0), ("r2", True, "SWITCH", 0), ("a", False, "INOUT", 2),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "name", ['"go"+ValToStr(i)', '"go"+NumToStr(i,0)', 'StrPart("xgo",2,2)+ValToStr(i)', '"M:go"+ValToStr(i)']
)
def test_routines_with_numbers_in_their_names(name: str) -> None:
    data = "".join(f"PROC go{i}() MoveL Offs(p,{i},0,0),v5,z0,tool0; ENDPROC " for i in (1, 2))
    found = events(f"FOR i FROM 2 TO 1 DO %{name}%; ENDFOR", P + data)
    assert [place and place[0] for place in places(found)] == [3, 2]


@pytest.mark.parametrize("name", ['"go"+ValToStr(i/3)', '"go"+ValToStr(TRUE)', 'StrPart("go1",2,9)'])
def test_names_that_only_the_controller_can_tell(name: str) -> None:
    found = walk_program(program(module(f"FOR i FROM 1 TO 2 DO %{name}%; ENDFOR", "PROC go1() ENDPROC")))
    assert [d.code for d in found.diagnostics] == ["RAP032"]


def test_late_binding_with_a_known_and_an_unknown_name() -> None:
    data = P + "VAR string n;PROC go() MoveL p,v5,z0,tool0; ENDPROC"
    found = walk_program(program(module('%"go"%; %"M"+":go"%; n:=TestName(); %n%;', data)))
    assert places(found.events) == [(1, 2, 3), (1, 2, 3)]
    assert [d.code for d in found.diagnostics] == ["RAP032"]


def test_placeholder_without_semicolon() -> None:
    assert codes(module("<SMT>\nMoveL p,v5,z0,tool0;", P)) == []
    assert len(events("<SMT>\nMoveL p,v5,z0,tool0;", P)) == 1


@pytest.mark.parametrize(
    "text", ['"Caution!!!"', '"; "', '"""UNUSED"""', '"\\0D\\0A"', '"\\\\WObj:="', '"MoveL p,v1,z0,t;"']
)
def test_strings_that_look_like_code(text: str) -> None:
    found = program(module(f"TPWrite {text}; MoveL p,v5,z0,tool0;", P))
    assert len(found.statements) == 1
    assert found.diagnostics == ()


@pytest.mark.parametrize(
    "comment", ["! MoveL p1,v100,z10,tool0;", "!ArcLStart [[...", 'ip:="1.2.3.4";  !"mCube"', "!", '! "open']
)
def test_comments_that_look_like_code(comment: str) -> None:
    found = program(module(comment + "\nMoveL p,v5,z0,tool0;", P + "PERS string ip;").replace(b"!", b"!\xe2\x80\xa6"))
    assert len(found.statements) == 1


@pytest.mark.parametrize(
    ("spelling", "value"),
    [("9E9", 9e9), ("9E+09", 9e9), ("9e+09", 9e9), ("1E+10", 1e10), ("-5.99539E-06", -5.99539e-6), (".5", 0.5),
     ("0.", 0.0), ("0X140861", 0x140861), ("-0", 0.0), ("0b101", 5.0), ("0o17", 15.0), ("+3", 3.0), ("- 3", -3.0)],
)  # fmt: skip
def test_numbers(spelling: str, value: float) -> None:
    event = events(f"MoveL [[{spelling},0,0],[1,0,0,0],[0,0,0,0],{UNUSED}],v5,z0,tool0;")[0]
    assert places([event]) == [(value, 0, 0)]
    assert event.target_origin.kind == "inline"
    assert event.target_origin.spans is not None
    numbers = literal(event.statement.source.data, *event.target_origin.spans.whole)
    assert numbers is not None and numbers[1] == spelling.encode()


def test_a_number_without_its_zero_after_an_instruction() -> None:
    assert codes(module("WaitTime .5;\nIF TRUE VelSet .5e2,1000;")) == []


def test_arrays_of_targets() -> None:
    rows = f"[{target(1, 0, 0)},\n! a comment, with a comma\n {target(2, 0, 0)}]"
    data = f"PERS robtarget a{{2}}:={rows};CONST robtarget k{{2,2}}:=[\n{rows},{rows.replace('[[1,', '[[5,')}];CONST num n:=2;"
    found = events(
        "MoveL a{2},v5,z0,tool0; MoveL k{2,1},v5,z0,tool0; MoveL k{n,n},v5,z0,tool0; MoveL a{3},v5,z0,tool0;", data
    )
    assert places(found) == [(2, 0, 0), (5, 0, 0), (2, 0, 0), None]
    assert [e.target_origin.kind for e in found] == ["element", "element", "element", "runtime"]
    assert found[0].target_origin.declaration == "m..a"
    spans = found[1].target_origin.spans
    assert spans is not None
    numbers = literal(spans.source.data, *spans.whole)
    assert numbers is not None and numbers[1] == b"5"
    assert found[3].reason == "`a` has no element 3"


def test_aggregate_with_names_and_expressions() -> None:
    data = f"CONST num n{{3}}:=[1,2,3];CONST extjoint x:={UNUSED};"
    event = events("MoveL [[n{1},-n{2},n{3}*2],[1,0,0,0],[0,0,0,0],x],v5,z0,tool0;", data)[0]
    assert places([event]) == [(1, -2, 6)]
    assert event.target_origin.kind == "expression"


def test_persistent_without_value() -> None:
    event = events("MoveL p,v5,z0,tool0\\WObj:=wPr;", P + "PERS wobjdata wPr; !used for pallets\n")[0]
    assert event.reason == "`wPr` has no value in this file"
    assert [d.code for d in event.diagnostics] == ["RAP020"]


def test_two_statements_on_a_line() -> None:
    assert places(events("IF 1 < 2 THEN MoveL p,v5,z0,tool0; MoveL Offs(p,1,0,0),v5,z0,tool0; ENDIF;", P)) == [
        (1, 2, 3), (2, 2, 3),
    ]  # fmt: skip


@pytest.mark.parametrize("condition", ["(b)", "((n=1) AND (b))", "b", "n=1", "NOT (n=2)", "n+1=2"])
def test_compact_if(condition: str) -> None:
    data = P + "CONST num n:=1;CONST bool b:=TRUE;"
    found = events(f"IF {condition} MoveL p,v5,z0,tool0;\nMoveL Offs(p,1,0,0),v5,z0,tool0;", data)
    assert places(found) == [(1, 2, 3), (2, 2, 3)]
    assert not found[0].conditional


def test_handlers_in_the_middle() -> None:
    body = "MoveL p,v5,z0,tool0;\nBACKWARD\nMoveL p,v10,z0,tool0;\nERROR (ERR_X,ERR_Y)\nMoveL p,v20,z0,tool0; RETRY;\nUNDO\nMoveL p,v30,z0,tool0;"
    found = events(body, P)
    assert [e.speed.v_tcp for e in found] == [5, 10, 20, 30]
    assert [e.conditional for e in found] == [False, True, True, True]


STEP = "MoveL Offs(p,n,0,0),v5,z0,tool0; n:=n+1;"


@pytest.mark.parametrize(
    ("jumps", "loops"),
    [
        (f"again: {STEP} IF n<3 GOTO again;", f"{STEP} WHILE n<3 DO {STEP} ENDWHILE"),
        (f"again: {STEP} IF n<3 THEN n:=n+1; GOTO again; ENDIF", f"{STEP} WHILE n<3 DO n:=n+1; {STEP} ENDWHILE"),
        (f"again: {STEP} IF di1=1 GOTO again;", f"{STEP} WHILE di1=1 DO {STEP} ENDWHILE"),
        (f"again: {STEP} n:=0; GOTO again;", f"WHILE TRUE DO {STEP} n:=0; ENDWHILE"),
        (f"IF di1=1 GOTO past; {STEP} past:", f"IF di1=1 THEN ELSE {STEP} ENDIF"),
        (f"again: IF n>=3 GOTO past; {STEP} GOTO again; past:", f"WHILE n<3 DO {STEP} ENDWHILE"),
        (
            f"again: {STEP} IF n>2 THEN n:=9; GOTO past; ENDIF n:=n+0.5; GOTO again; past:",
            f"{STEP} WHILE n<=2 DO n:=n+0.5; {STEP} ENDWHILE n:=9;",
        ),
        (f"again: IF di1=1 GOTO past; {STEP} GOTO again; past:", f"WHILE di1=0 DO {STEP} ENDWHILE"),
        (f"a: b: {STEP} IF n<2 GOTO b; IF n<4 GOTO a;", f"{STEP} {STEP} {STEP} {STEP}"),
    ],
)
def test_jumps_are_followed_as_the_loops_and_branches_that_they_are(jumps: str, loops: str) -> None:
    found, wanted = (events(f"n:=0; {body} MoveL p,v5,z0,tool0;", P + "VAR num n;") for body in (jumps, loops))
    assert places(found) == places(wanted)
    told = [[(e.conditional, e.detached, e.first, e.resumes_from, e.way) for e in each] for each in (found, wanted)]
    assert told[0] == told[1]


def test_a_jump_out_of_a_loop_without_end_leaves_it() -> None:
    body = f"n:=0; again: {STEP} IF di1=1 GOTO past; GOTO again; MoveL p,v9,z0,tool0; past: MoveL p,v5,z0,tool0;"
    last = events(body, P + "VAR num n;")[-1]
    assert last.target is not None and last.detached


def test_what_several_jumps_lead_to_is_not_known() -> None:
    body = f"n:=0; again: {STEP} IF n<3 GOTO again; IF n<5 GOTO again; MoveL p,v5,z0,tool0;"
    found = events(body, P + "VAR num n;")
    assert places(found) == [None, (1, 2, 3)]
    assert "n" in (found[0].reason or "")


def test_case_lists_and_strings() -> None:
    data = P + 'CONST string s:="Weld";CONST num n:=4;'
    body = """TEST n
    CASE 1,4: MoveL p,v5,z0,tool0;
    CASE 2: MoveL p,v10,z0,tool0;
    DEFAULT: MoveL p,v20,z0,tool0;
    ENDTEST
    TEST s CASE "Weld", "Weld:Motion": MoveL p,v30,z0,tool0; ENDTEST
    TEST n CASE 9: MoveL p,v40,z0,tool0; DEFAULT: MoveL p,v50,z0,tool0; ENDTEST"""
    done = [e.speed.v_tcp for e in events(body, data) if not e.conditional]
    assert done == [5, 30, 50]


@pytest.mark.parametrize("blank", [b"\xe3\x80\x80", b"\xc2\xa0", b"\x0b", b"\x0c", b"\t"])
def test_unusual_blanks(blank: bytes) -> None:
    data = module("@MoveL@p,@v5,@z0,@tool0;@", P).replace(b"@", blank)
    assert places(walk(program(data))) == [(1, 2, 3)]


def test_wrapper_procedures_of_other_files_are_named() -> None:
    result = walk_program(program(module("MoveJgJ jgReady,vmax,z50; MoveL p,v5,z0,tool0;", P)))
    assert len(result.events) == 1
    assert [(d.code, d.message) for d in result.diagnostics] == [
        ("RAP031", "the routine `MoveJgJ` is called, is in none of the files, and is taken not to move the arm")
    ]


def test_hidden_position() -> None:
    event = events("MoveJ *, v1000, z5, tool0;")[0]
    assert event.target is None
    assert event.target_origin.kind == "star"
    assert event.reason == "the position is stored without a name (`*`) and not visible in the text"


def test_old_arc_syntax() -> None:
    data = P + TOOL + WELD + "PERS weavedata noweave:=[0,0];CONST robtarget q:=" + target(5, 5, 5) + ";"
    body = "ArcL \\On, p, v100, s, wd, noweave, fine, t; ArcC p, q, v100, s, wd, noweave, z1, t; ArcL \\Off, q, v100, s, wd, noweave, fine, t;"
    found = events(body, data)
    assert [e.weld.phase for e in found if e.weld] == ["start", "weld", "end"]
    assert [e.tool.name for e in found] == ["t"] * 3
    assert found[1].via is not None
    assert found[1].via.trans == (1, 2, 3)
    assert places(found)[1] == (5, 5, 5)


def test_an_own_routine_wins_over_the_instruction() -> None:
    data = P + "PROC MoveLDO(num a) MoveL Offs(p,a,0,0),v5,z0,tool0; ENDPROC"
    found = events("MoveLDO 4;", data)
    assert [e.statement.instruction for e in found] == ["MoveL"]
    assert places(found) == [(5, 2, 3)]


def test_data_named_like_an_instruction() -> None:
    assert places(events("weld:=1; MoveL Offs(p,weld,0,0),v5,z0,tool0;", P + "VAR num weld;")) == [(2, 2, 3)]


def test_cr_cr_lf_line_ends() -> None:
    assert places(walk(program(module("MoveL p,v5,z0,tool0;", P).replace(b"\n", b"\r\r\n")))) == [(1, 2, 3)]


def test_not_taught_orientation_is_refused() -> None:
    event = events(f"MoveL [[1,2,3],[0,0,0,0],[0,0,0,0],{UNUSED}],v5,z0,tool0;")[0]
    assert event.target is None
    assert event.reason == "the orientation is [0,0,0,0]: the position was never taught"


def test_orientations_are_normalised() -> None:
    event = events(f"MoveL [[1,2,3],[0.7071,0,0.7071,0],[0,0,0,0],{UNUSED}],v5,z0,tool0;")[0]
    assert event.target.rot == pytest.approx((0.5**0.5, 0, 0.5**0.5, 0), abs=1e-15)  # type: ignore[union-attr]


def test_missing_end_words_and_semicolons_do_not_hide_statements() -> None:
    text = f"""MODULE M
{P}
PROC a()
  IF n=1 THEN
    MoveL p,v5,z0,tool0
    MoveL p,v10,z0,tool0;
ENDPROC
PROC b()
  ENDIF
  MoveL p,v20,z0,tool0;
  WHILE TRUE DO
    MoveL p,v30,z0,tool0;
ENDMODULE
"""
    found = program(text)
    assert [s.argument("speed").text for s in found.statements] == ["v5", "v10", "v20", "v30"]  # type: ignore[union-attr]
    assert [d.code for d in found.diagnostics] == ["RAP008", "RAP010", "RAP006", "RAP010", "RAP007"]


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


@pytest.mark.parametrize(
    "data, message",
    [
        (P.replace("[1,2,3]", "[1,5,2,3]"), "`p`: 3 numbers are expected in the data"),
        (P.replace("[0,1,0,0]", "[0.1,0.7,-0.7,0.74]"), "`p`: the orientation is no unit quaternion: its length is 1.24, not 1"),
    ],
)  # fmt: skip
def test_numbers_that_a_controller_refuses_are_named_where_they_stand(data: str, message: str) -> None:
    found = walk_program(program(module("MoveL p,v5,z0,tool0; MoveL p,v5,z0,tool0;", data))).diagnostics
    assert [(d.code, d.severity, d.message) for d in found] == [("RAP024", "error", message)]
    assert found[0].span is not None and found[0].span[0] < 40


def test_a_tool_without_its_load_is_named_where_it_is_declared() -> None:
    found = walk_program(
        program(module("MoveL p,v5,z0,t;", P + "PERS tooldata t:=[TRUE,[[0,0,9],[1,0,0,0]]];"))
    ).diagnostics
    assert [(d.code, d.severity, d.message) for d in found] == [("RAP024", "error", "`t`: the value is not a tooldata")]


def test_orientations_that_are_more_than_rounded_are_said_once_where_they_stand() -> None:
    data = P.replace("[0,1,0,0]", "[0,0.97,0,0]")
    (found,) = walk_program(
        program(module("MoveL p,v5,z0,tool0; MoveJ p,v5,z0,tool0; MoveL Offs(p,0,0,9),v5,z0,tool0;", data))
    ).diagnostics
    assert (found.code, found.severity) == ("RAP025", "warning")
    assert (
        found.span is not None and found.source is not None and found.source.data[slice(*found.span)] == b"0,0.97,0,0"
    )


def test_an_orientation_of_a_tool_that_is_more_than_rounded_is_said_where_it_stands() -> None:
    tool = "PERS tooldata t:=[TRUE,[[0,0,9],[0.95,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];"
    (found,) = walk_program(program(module("MoveL p,v5,z0,t;", P + tool))).diagnostics
    assert (found.code, found.severity) == ("RAP025", "warning")
    assert "orientation of `t`" in found.message and "0.95" in found.message


@pytest.mark.parametrize("rot", ["[0.71,0,0.71,0]", "[0.707,0,0.707,0]", "[0,0.95,0,0]"])
def test_rounded_orientations_are_normalised(rot: str) -> None:
    found = events("MoveL p,v5,z0,tool0;", P.replace("[0,1,0,0]", rot))[0]
    assert isinstance(found.target, RobTarget) and sum(q * q for q in found.target.rot) == pytest.approx(1.0)


def test_a_name_twice_in_one_module_is_an_error() -> None:
    found = program(module("VAR num n;", P + P.replace("1,2,3", "1,2,4") + "VAR num n;")).diagnostics
    assert [(d.code, d.severity) for d in found] == [("RAP012", "error")]
    alike = program(module("", P + P)).diagnostics
    assert [(d.code, d.severity) for d in alike] == [("RAP012", "warning")]


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


def test_a_typing_error_in_an_instruction_is_a_warning() -> None:
    found = walk_program(program(module("ArkL p,v5,s,wd,z0,t; Logging p;", P))).diagnostics
    said = [(d.severity, d.message.split("`")[1], (d.help or "").split("?")[0]) for d in found]
    assert said[0] == ("warning", "ArkL", "did you mean `ArcL`")
    assert said[1][:2] == ("info", "Logging")


def test_data_that_an_unknown_instruction_may_write_names_it_and_keeps_its_spelling() -> None:
    data = P + "PERS tooldata tGun:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]]; VAR robtarget pGo;"
    before, after = walk(program(module("MoveL p,v5,z0,tGun; Tool tGun; MoveL p,v5,z0,tGun;", data)))
    assert before.reason is None and before.assumed == ("`tGun` may be written by `Tool`",)
    assert after.reason == "`tGun` may be written by `Tool`"
    both = walk(program(module("MoveL pGo,v5,z0,tGun; Where pGo; pGo:=p;", data)))
    assert both[0].reason == "`pGo` is written by the program and has no certain value here"


def test_a_target_that_breaks_off_in_its_last_number_is_told_at_once() -> None:
    """Digits are taken whole: seventeen numbers that may each be divided in six ways would never end."""
    broken = "[[1234.56789,-2345.67891,3456.78912],[0.123456,0.123456,0.123456,0.123456],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9x]]"
    event = events(f"MoveL {broken},v5,z0,tool0;")[0]
    assert event.target is None


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
