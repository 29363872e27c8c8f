"""Long and deeply nested programs cost what they are long: four times the text, about four times the work."""

from __future__ import annotations

import tracemalloc

import pytest

from postproc.diagnostics import Diagnostic, Source
from postproc.rapid.execution import abstract_interpreter
from postproc.rapid.execution.walk import Walk, walk_program
from postproc.rapid.program.program import read_program
from postproc.rapid.program.references import declaration_uses
from tests.cost import loops, operations, within
from tests.fuzz.checks import limited

TIMES = 4
MOST = 6.0  # times the operations for TIMES times the text: its square would be 16
HEAD = """MODULE M
  PERS tooldata t1:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,10],[1,0,0,0],0,0,0]];
  CONST robtarget p1:=[[600,0,800],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num a;
  VAR string s:="x";
"""
FIRST = "MoveL p1,v100,fine,t1;"
MOVE = "MoveL Offs(p1,{},0,0),v100,fine,t1;"


def module(body: str, declared: str = "", routines: str = "") -> str:
    """A program whose main holds these statements."""
    return f"{HEAD}{declared}\nPROC main()\n{FIRST}\n{body}\nENDPROC\n{routines}\nENDMODULE\n"


def repeated(piece: str, count: int, between: str = "\n") -> str:
    """A piece so many times, its braces filled with the number."""
    return between.join(piece.replace("{}", str(i)) for i in range(count))


def follow(text: str) -> Walk:
    """Read and follow a program, with the place of everything that is found."""
    source = Source("long.mod", text.encode())
    program = read_program(source)
    walked = walk_program(program)
    declaration_uses(program)
    for finding in (*program.diagnostics, *walked.diagnostics):
        finding.as_json()
    for event in walked.events:
        source.position(event.statement.span[0])
    return walked


ROUTINE = "PROC r{}()\na:={};\nENDPROC"
# How often what is repeated in main, with declarations and routines that are repeated as often, on one line or on lines.
SHAPES: dict[str, tuple[int, str, str, str, str]] = {
    "statements on one line": (150, "a:={}; ", "", "", "LINE"),
    "motions on one line": (40, MOVE + " ", "", "", "LINE"),
    "labels": (120, "l{}: a:=a+1;", "", "", "LINES"),
    "jumps forward": (80, "GOTO l{};\na:=3;\nl{}:", "", "", "LINES"),
    "jumps on a condition": (60, "IF di1=1 GOTO l{};\na:=3;\nl{}:", "", "", "LINES"),
    "jumps back": (60, "l{}: a:=a+1; IF di1=1 GOTO l{};", "", "", "LINES"),
    "routines": (60, "r{};", "", ROUTINE, "LINES"),
    "handlers": (50, "r{};", "", ROUTINE.replace("ENDPROC", "ERROR\nTRYNEXT;\nENDPROC"), "LINES"),
    "arms of one IF": (60, "ELSEIF gi1={} THEN\na:={};", "", "", "IF gi1=-1 THEN\nLINES\nENDIF"),
    "cases with motions": (40, "CASE {}:\n" + MOVE, "", "", "TEST gi1\nLINES\nENDTEST"),
    "branches with motions": (40, "IF gi1={} THEN\n" + MOVE + "\nENDIF", "", "", "LINES"),
    "declarations": (120, "a:=a{};", "CONST num a{}:={};", "", "LINES"),
    "arguments": (120, "1,", "", "", "r LINE 1;"),
    "calls by a name": (50, '%"r{}"%;', "", ROUTINE, "LINES"),
    "a text": (5_000, "x", "", "", 's:="LINE";'),
    "comments": (4_000, "! {}", "", "", "LINES"),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_long_program_costs_what_it_is_long(name: str) -> None:
    count, piece, declared, routines, around = SHAPES[name]

    def text(n: int) -> str:
        body = around.replace("LINES", repeated(piece, n)).replace("LINE", repeated(piece, n, ""))
        return module(body, repeated(declared, n), repeated(routines, n))

    short, longer = (operations(lambda n=n: follow(text(n))) for n in (count, TIMES * count))  # type: ignore[misc]
    assert longer < MOST * short


def test_a_cost_that_grows_with_the_square_is_seen() -> None:
    def compare(n: int) -> int:
        return sum(a == b for a in range(n) for b in range(n))

    assert operations(lambda: compare(TIMES * 100)) > 2 * MOST * operations(lambda: compare(100))


PLACES = {
    "comment": "! {}\n" + FIRST,
    "string": 'TPWrite "{}"; ' + FIRST,
    "call": "{}; " + FIRST,
    "argument": MOVE,
    "assigned": "a:={}; " + FIRST,
    "condition": f"IF {{}} THEN {FIRST} ENDIF",
    "by name": 'SetDataVal "{}",a; CallByVar "{}",1; ' + FIRST,
    "late": '%"{}"+a%; ' + FIRST,
}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("piece", ["a(", "a."])
def test_one_long_word_costs_what_it_is_long(place: str, piece: str) -> None:
    """Ten times the word: in operations, and in time where each of them costs so much more."""

    def run(size: int) -> None:
        follow(module(PLACES[place].replace("{}", piece * (size // len(piece)))))

    assert operations(lambda: run(8_000)) < 11 * operations(lambda: run(800))
    assert within(lambda: run(20_000), max(40 * loops(lambda: run(2_000), 2), 5e6))


def test_a_word_of_a_megabyte_in_a_comment_is_read_at_once() -> None:
    text = module(f"! {'a' * 1_000_000}\n{MOVE.format(1)}")
    assert operations(lambda: follow(text)) < 1e5
    assert within(lambda: follow(text), 1e8)


FEW_STEPS = abstract_interpreter.MAX_STEPS // 10
"""Of a program that is cut off: what is then said of it is the same as after all."""


@pytest.mark.parametrize(
    ("opening", "closing", "findings"),
    [
        ("FOR i{} FROM 1 TO 100 DO", "ENDFOR", ["RAP033"]),
        ("FOR i{} FROM 1 TO gi1 DO", "ENDFOR", []),
        ("WHILE di1=1 DO", "ENDWHILE", []),
        ("IF di1=1 THEN", "ENDIF", []),
        ("l{}:", "IF di{}=1 GOTO l{};", []),
    ],
)
def test_nested_blocks_end(opening: str, closing: str, findings: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Turns inside turns are a power of the depth: from some point on what follows is not known, and this is said."""
    if findings:
        monkeypatch.setattr(abstract_interpreter, "MAX_STEPS", FEW_STEPS)
    text = module(f"{repeated(opening, 40)}\na:=a+1;\n{MOVE.format('a')}\n{repeated(closing, 40)}")
    with limited(120.0):
        walked = follow(text)
    assert len({event.statement.key for event in walked.events}) == 2
    assert [finding.code for finding in walked.diagnostics] == findings
    assert findings or len(walked.events) < 400


def test_calls_that_multiply_are_cut_off_and_still_accounted_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(abstract_interpreter, "MAX_STEPS", FEW_STEPS)
    routines = "\n".join(f"PROC r{n}() r{n + 1}; r{n + 1}; ENDPROC" for n in range(24))
    walked = follow(module("r0;", "", f"{routines}\nPROC r24() {MOVE.format(1)} ENDPROC"))
    assert [finding.code for finding in walked.diagnostics] == ["RAP033"]
    assert len({event.statement.key for event in walked.events}) == 2


@pytest.mark.parametrize("body", [MOVE.format("a"), "work a;", "IF a>3 THEN\n" + MOVE.format("a/2") + "\nENDIF"])
def test_what_is_not_known_holds_nothing_of_where_it_was_found(body: str) -> None:
    """Hundreds of executions whose target is not known: a kilobyte or two each."""
    work = f"PROC work(num n)\n{MOVE.format('n+a')}\nENDPROC"
    program = read_program(
        Source("unknown.mod", module(f"FOR i FROM 1 TO 300 DO\na:=GInput(gi1);\n{body}\nENDFOR", "", work).encode())
    )
    tracemalloc.start()
    events = walk_program(program).events
    kept, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(events) > 290
    assert kept < peak < 4000 * len(events)


def test_findings_on_one_long_line_are_shown_at_once() -> None:
    """A line that is four times as long costs no more operations for as many findings, and none shows more of it."""

    def show(count: int) -> None:
        source = Source("line.mod", b"a:=1; " * count)
        for at in range(0, 6 * count, 6 * count // 100):
            text = Diagnostic("RAP003", "warning", "not understood", source, (at, at + 4)).render(80)
            assert all(len(line) <= 90 for line in text.splitlines())

    assert operations(lambda: show(TIMES * 5_000)) < 1.1 * operations(lambda: show(5_000))
    assert within(lambda: show(TIMES * 5_000), 4 * TIMES * loops(lambda: show(5_000), 2))


LEVELS = "RECORD r0\nnum a;\nENDRECORD\n" + "".join(
    f"RECORD r{i + 1}\nr{i} a;\nr{i} b;\nENDRECORD\n" for i in range(40)
)


@pytest.mark.parametrize(("records", "kind"), [("RECORD r\nr a;\nr b;\nENDRECORD", "r"), (LEVELS, "r40")])
def test_records_inside_one_another_are_too_large_to_follow(records: str, kind: str) -> None:
    """Two of the level below in each of forty levels, and a record of itself: neither has a value that can be held."""
    text = module("x.a:=x.b;\n" + MOVE.format("a"), f"VAR {kind} x;").replace("MODULE M\n", f"MODULE M\n{records}\n", 1)
    assert len(follow(text).events) == 2


def test_what_a_test_asks_is_worked_out_once() -> None:
    """The expression of TEST is evaluated once, however many arms there are, as on a controller."""
    counting = "FUNC num fSum()\nVAR num s:=0;\nFOR i FROM 1 TO 200 DO\ns:=s+i;\nENDFOR\nRETURN s;\nENDFUNC"
    one, many = (module(f"TEST fSum()\n{repeated('CASE {}:', n)}\na:=1;\nENDTEST", "", counting) for n in (1, 40))
    assert operations(lambda: follow(many)) < 1.5 * operations(lambda: follow(one))
