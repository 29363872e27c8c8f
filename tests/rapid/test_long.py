"""Long and deeply nested programs cost what they are long: four times the text, about four times the work."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable

import pytest

from postproc.diagnostics import Diagnostic, Source
from postproc.rapid.execution.walk import walk, walk_program
from postproc.rapid.program.program import read_program
from postproc.rapid.program.references import declaration_uses
from tests.cost import loops, operations
from tests.fuzz.checks import limited

TIMES = 4
MOST = 6.0  # times the operations for TIMES times the text: its square would be 16
HEAD = """MODULE M
  PERS tooldata t1:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,10],[1,0,0,0],0,0,0]];
  CONST robtarget p1:=[[600,0,800],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num a;
  VAR string s:="x";
"""
MOVE = "MoveL Offs(p1,{},0,0),v100,fine,t1;"


def module(body: str, declared: str = "", routines: str = "") -> str:
    """A program whose main holds these statements."""
    return f"{HEAD}{declared}\nPROC main()\nMoveL p1,v100,fine,t1;\n{body}\nENDPROC\n{routines}\nENDMODULE\n"


def repeated(piece: str, count: int, between: str = "\n") -> str:
    """A piece so many times, its braces filled with the number."""
    return between.join(piece.replace("{}", str(i)) for i in range(count))


def nested(opening: str, inner: str, closing: str, depth: int) -> str:
    """A block inside another, ``depth`` times."""
    return f"{repeated(opening, depth)}\n{inner}\n{repeated(closing, depth)}"


SHAPES: dict[str, tuple[int, Callable[[int], str]]] = {
    "statements on one line": (500, lambda n: module(repeated("a:={};", n, " "))),
    "motions on one line": (100, lambda n: module(repeated(MOVE, n, " "))),
    "labels": (375, lambda n: module(repeated("l{}: a:=a+1;", n))),
    "jumps forward": (250, lambda n: module(repeated("GOTO l{};\na:=3;\nl{}:", n))),
    "jumps on a condition": (200, lambda n: module(repeated("IF di1=1 GOTO l{};\na:=3;\nl{}:", n))),
    "jumps back": (200, lambda n: module(repeated("l{}: a:=a+1; IF di1=1 GOTO l{};", n))),
    "routines": (200, lambda n: module(repeated("r{};", n), "", repeated("PROC r{}()\na:={};\nENDPROC", n))),
    "handlers": (
        150,
        lambda n: module(repeated("r{};", n), "", repeated("PROC r{}()\na:={};\nERROR\nTRYNEXT;\nENDPROC", n)),
    ),
    "arms of one IF": (
        200,
        lambda n: module("IF gi1=-1 THEN\n" + repeated("ELSEIF gi1={} THEN\na:={};", n) + "\nENDIF"),
    ),
    "cases with motions": (
        100,
        lambda n: module("TEST gi1\n" + repeated("CASE {}:\n" + MOVE, n) + "\nENDTEST"),
    ),
    "branches with motions": (150, lambda n: module(repeated("IF gi1={} THEN\n" + MOVE + "\nENDIF", n))),
    "declarations": (375, lambda n: module(MOVE.format("a0"), repeated("CONST num a{}:={};", n))),
    "arguments": (375, lambda n: module("r " + ",".join("1" * n) + ";", "", "PROC r()\nENDPROC")),
    "calls by a name": (
        125,
        lambda n: module(repeated('%"r{}"%;', n), "", repeated("PROC r{}()\na:={};\nENDPROC", n)),
    ),
    "a text": (20000, lambda n: module(f's:="{"x" * n}";')),
    "comments": (20000, lambda n: module(repeated("! {}", n))),
}  # fmt: skip


def follow(text: str) -> None:
    """Read and follow a program, with the place of everything that is found."""
    source = Source("long.mod", text.encode())
    program = read_program(source)
    walked = walk_program(program)
    for finding in (*program.diagnostics, *walked.diagnostics):
        finding.as_json()
    for event in walked.events:
        source.position(event.statement.span[0])


@pytest.mark.parametrize("name", SHAPES)
def test_a_long_program_costs_what_it_is_long(name: str) -> None:
    count, text = SHAPES[name]
    short, longer = (operations(lambda n=n: follow(text(n))) for n in (count, TIMES * count))  # type: ignore[misc]
    assert longer < MOST * short


def test_a_cost_that_grows_with_the_square_is_seen() -> None:
    def compare(n: int) -> int:
        return sum(a == b for a in range(n) for b in range(n))

    assert operations(lambda: compare(TIMES * 100)) > 2 * MOST * operations(lambda: compare(100))


PLACES = {
    "comment": "! {}\nMoveL p1,v100,fine,t1;",
    "string": 'TPWrite "{}"; MoveL p1,v100,fine,t1;',
    "call": "{}; MoveL p1,v100,fine,t1;",
    "argument": MOVE,
    "assigned": "a:={}; MoveL p1,v100,fine,t1;",
    "condition": "IF {} THEN MoveL p1,v100,fine,t1; ENDIF",
    "by name": 'SetDataVal "{}",a; CallByVar "{}",1; MoveL p1,v100,fine,t1;',
    "late": '%"{}"+a%; MoveL p1,v100,fine,t1;',
}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("piece", ["a", "a(", "(", "a."])
def test_one_long_word_costs_what_it_is_long(place: str, piece: str) -> None:
    """Ten times the word: in operations, and in time where each of them costs so much more."""

    def run(size: int) -> None:
        program = read_program(
            Source("word.mod", module(PLACES[place].replace("{}", piece * (size // len(piece)))).encode())
        )
        list(walk(program))
        declaration_uses(program)

    assert operations(lambda: run(20_000)) < 11 * operations(lambda: run(2_000))
    assert loops(lambda: run(20_000)) < max(15 * loops(lambda: run(2_000), 2), 5e6)


def test_a_word_of_a_megabyte_in_a_comment_is_read_at_once() -> None:
    text = module(f"! {'a' * 1_000_000}\n{MOVE.format(1)}")
    assert operations(lambda: follow(text)) < 1e5
    assert loops(lambda: follow(text)) < 1e8


@pytest.mark.parametrize(
    ("opening", "closing"),
    [
        ("FOR i{} FROM 1 TO 100 DO", "ENDFOR"),
        ("FOR i{} FROM 1 TO gi1 DO", "ENDFOR"),
        ("WHILE di1=1 DO", "ENDWHILE"),
        ("IF di1=1 THEN", "ENDIF"),
        ("l{}:", "IF di{}=1 GOTO l{};"),
    ],
)
def test_nested_blocks_end(opening: str, closing: str) -> None:
    """Turns inside turns are a power of the depth: from some point on what follows is not known, and this is said."""
    text = module(nested(opening, "a:=a+1;\n" + MOVE.format("a"), closing, 40))
    with limited(120.0):
        walked = walk_program(read_program(Source("deep.mod", text.encode())))
    assert len({event.statement.key for event in walked.events}) == 2
    if opening.startswith("FOR i{} FROM 1 TO 100"):
        assert "RAP033" in [finding.code for finding in walked.diagnostics]


def arms_taken(body: str, condition: str) -> list[float]:
    """Which of two arms are followed after a body: 1 where the condition may hold, 2 where it may not."""
    test = f"IF {condition} THEN\n{MOVE.format(1)}\nELSE\n{MOVE.format(2)}\nENDIF"
    events = walk_program(read_program(Source("text.mod", module(f's:="x";\n{body}\n{test}').encode()))).events
    return sorted({event.target.trans[0] - 600 for event in events if event.target and not event.unreachable} - {0.0})


@pytest.mark.parametrize(
    "body", ["FOR i FROM 1 TO 200 DO\ns:=s+s;\nENDFOR", "s:=NumToStr(1,4000000);", "s:=s+s;\n" * 7]
)
def test_a_text_longer_than_a_string_is_not_known(body: str) -> None:
    assert arms_taken(body, 's="x"') == [1.0, 2.0]


def test_a_text_as_long_as_a_string_is_known() -> None:
    assert arms_taken("s:=s+s;\n" * 6, "StrLen(s)=64") == [1.0]


@pytest.mark.parametrize("body", [MOVE.format("a"), "work a;", "IF a>3 THEN\n" + MOVE.format("a/2") + "\nENDIF"])
def test_what_is_not_known_holds_nothing_of_where_it_was_found(body: str) -> None:
    """Hundreds of executions whose target is not known: a kilobyte or two each."""
    work = "PROC work(num n)\n" + MOVE.format("n+a") + "\nENDPROC"
    text = module(f"FOR i FROM 1 TO 800 DO\na:=GInput(gi1);\n{body}\nENDFOR", "", work)
    program = read_program(Source("unknown.mod", text.encode()))
    tracemalloc.start()
    events = walk_program(program).events
    held, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(events) > 700
    assert held < peak < 4000 * len(events)


def test_findings_on_one_long_line_are_shown_at_once() -> None:
    """A line that is four times as long costs no more operations for as many findings, and none shows more of it."""

    def show(count: int) -> None:
        source = Source("line.mod", b"a:=1; " * count)
        for at in range(0, 6 * count, 6 * count // 100):
            text = Diagnostic("RAP003", "warning", "not understood", source, (at, at + 4)).render(80)
            assert all(len(line) <= 90 for line in text.splitlines())

    assert operations(lambda: show(TIMES * 20_000)) < 1.1 * operations(lambda: show(20_000))
    assert loops(lambda: show(TIMES * 20_000)) < 2 * TIMES * loops(lambda: show(20_000), 2)


@pytest.mark.parametrize("inner", ["r", "r{}"])
def test_records_inside_one_another_are_too_large_to_follow(inner: str) -> None:
    """Two of the level below in each of forty levels, and a record of itself: neither has a value that can be held."""
    if inner == "r":
        records = "RECORD r\nr a;\nr b;\nENDRECORD"
    else:
        levels = (f"RECORD r{i + 1}\nr{i} a;\nr{i} b;\nENDRECORD" for i in range(40))
        records = "RECORD r0\nnum a;\nENDRECORD\n" + "\n".join(levels)
    kind = inner.replace("{}", "40")
    text = module("x.a:=x.b;\n" + MOVE.format("a"), f"VAR {kind} x;").replace("MODULE M\n", f"MODULE M\n{records}\n", 1)
    assert len(walk_program(read_program(Source("records.mod", text.encode()))).events) == 2


def test_what_a_test_asks_is_worked_out_once() -> None:
    """The expression of TEST is evaluated once, however many arms there are, as on a controller."""

    def cost(arms: int) -> int:
        cases = "\n".join(f"CASE {k}:\nn:={k};" for k in range(arms))
        text = (
            "MODULE M\nVAR num n;\nFUNC num fSum()\nVAR num s:=0;\nFOR i FROM 1 TO 200 DO\ns:=s+i;\nENDFOR\nRETURN s;\nENDFUNC\n"
            f"PROC main()\nTEST fSum()\n{cases}\nENDTEST\nMoveL *,v100,fine,tool0;\nENDPROC\nENDMODULE\n"
        )
        program = read_program(Source("m.mod", text.encode()))
        return operations(lambda: walk(program))

    assert cost(40) < 1.5 * cost(1)
