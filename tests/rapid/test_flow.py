"""Which motions may be the last before a motion statement, on flow graphs drawn by hand."""

from __future__ import annotations

import pytest

from postproc.diagnostics import Source
from postproc.rapid.flow.arrivals import Arrivals, only
from postproc.rapid.flow.states import ANYWHERE
from postproc.rapid.program.program import Program, read_program
from tests.cost import operations

TARGET = "[[%d,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
DATA = "\n".join(
    [f"  CONST robtarget p{name}:={TARGET % k};" for k, name in enumerate("ABCDE")]
    + ["  CONST bool YES:=TRUE;", "  CONST num TWO:=2;", "  PERS bool bDo:=TRUE;", "  PERS num nFirst:=2;"]
    + ["  VAR num nZ;", '  VAR string sName:="rLeft";', "  VAR robtarget pV;", "  VAR intnum iStop;"]
)
MOVE = "MoveL p%s,v100,fine,tool0;"


def program(text: str) -> Program:
    """A module whose lines ``A`` to ``E`` are motions to these targets."""
    lines = [MOVE % word if word in list("ABCDE") else word for line in text.splitlines() for word in [line.strip()]]
    return read_program(Source("p.mod", f"MODULE M\n{DATA}\n{chr(10).join(lines)}\nENDMODULE\n".encode("latin-1")))


def arrivals(text: str) -> dict[str, str]:
    """Of each motion the letters of those before it, ``*`` for anywhere; the same letter twice: the second is a2."""
    read = program(text)
    found = Arrivals(read)
    names: dict[tuple[str, int], str] = {ANYWHERE: "*"}
    for statement in read.statements:
        to = statement.argument("to")
        assert to is not None
        letter = to.text[-1]
        names[statement.key] = letter if letter not in names.values() else letter.lower() + "2"
    return {names[s.key]: "".join(sorted(names[k] for k in found.before(s.key))) for s in read.statements}


def in_main(body: str, more: str = "") -> dict[str, str]:
    return arrivals(f"PROC main()\n{body}\nENDPROC\n{more}")


GRAPHS = [
    ("straight", "A\nB\nC", "", {"A": "*", "B": "A", "C": "B"}),
    ("if", "A\nIF bDo THEN\nB\nENDIF\nC", "", {"A": "*", "B": "A", "C": "AB"}),
    ("if and else", "A\nIF bDo THEN\nB\nELSE\nC\nENDIF\nD", "", {"A": "*", "B": "A", "C": "A", "D": "BC"}),
    ("a constant decides", "A\nIF YES THEN\nB\nENDIF\nC", "", {"A": "*", "B": "A", "C": "B"}),
    ("a constant excludes", "A\nIF TWO>2 THEN\nB\nENDIF\nC", "", {"A": "*", "B": "", "C": "A"}),
    ("test", "A\nTEST nZ\nCASE 1:\nB\nCASE 2,3:\nC\nDEFAULT:\nD\nENDTEST\nE", "",
     {"A": "*", "B": "A", "C": "A", "D": "A", "E": "BCD"}),
    ("test of a constant", "A\nTEST TWO\nCASE 1:\nB\nCASE 2:\nC\nENDTEST\nD", "",
     {"A": "*", "B": "", "C": "A", "D": "C"}),
    ("for", "A\nFOR i FROM 1 TO 4 DO\nB\nC\nENDFOR\nD", "", {"A": "*", "B": "AC", "C": "B", "D": "C"}),
    ("for by data", "A\nFOR i FROM nFirst TO 4 DO\nB\nENDFOR\nC", "", {"A": "*", "B": "AB", "C": "AB"}),
    ("for once", "A\nFOR i FROM TWO TO 2 DO\nB\nENDFOR\nC", "", {"A": "*", "B": "A", "C": "B"}),
    ("for never", "A\nFOR i FROM 3 TO 2 STEP 1 DO\nB\nENDFOR\nC", "", {"A": "*", "B": "", "C": "A"}),
    ("while", "A\nWHILE bDo DO\nB\nENDWHILE\nC", "", {"A": "*", "B": "AB", "C": "AB"}),
    ("for ever", "A\nWHILE TRUE DO\nB\nENDWHILE\nC", "", {"A": "*", "B": "AB", "C": ""}),
    ("nested loops", "A\nWHILE bDo DO\nFOR i FROM 1 TO 2 DO\nB\nENDFOR\nC\nENDWHILE\nD", "",
     {"A": "*", "B": "ABC", "C": "B", "D": "AC"}),
    ("goto back", "A\nagain:\nB\nC\nIF bDo GOTO again;\nD", "", {"A": "*", "B": "AC", "C": "B", "D": "C"}),
    ("goto ahead", "A\nIF bDo GOTO on;\nB\non:\nC", "", {"A": "*", "B": "A", "C": "AB"}),
    ("goto over what nobody reaches", "A\nGOTO on;\nB\non:\nC", "", {"A": "*", "B": "", "C": "A"}),
    ("return", "A\nrB;\nC", "LOCAL PROC rB()\nIF bDo RETURN;\nB\nENDPROC", {"A": "*", "B": "A", "C": "AB"}),
    ("exit", "A\nIF bDo EXIT;\nB", "", {"A": "*", "B": "A"}),
    ("a new cycle", "A\nIF bDo THEN\nB\nExitCycle;\nENDIF\nC", "", {"A": "*", "B": "A", "C": "A"}),
    ("called twice", "A\nrB;\nC\nrB;\nD", "LOCAL PROC rB()\nB\nENDPROC", {"A": "*", "B": "AC", "C": "B", "D": "B"}),
    ("not local", "A\nrB;\nC", "PROC rB()\nB\nD\nENDPROC", {"A": "*", "B": "*", "C": "D", "D": "B"}),
    ("called by nobody", "A", "LOCAL PROC rB()\nB\nENDPROC", {"A": "*", "B": "*"}),
    ("a routine that moves nothing", "A\nrB;\nB", "LOCAL PROC rB()\nnZ:=1;\nENDPROC", {"A": "*", "B": "A"}),
    ("recursion", "A\nrB 3;\nC", "LOCAL PROC rB(num n)\nIF n>0 THEN\nB\nrB n-1;\nENDIF\nENDPROC",
     {"A": "*", "B": "AB", "C": "AB"}),
    ("one calls the other", "A\nrB;\nD", "LOCAL PROC rB()\nB\nIF bDo rC;\nENDPROC\nLOCAL PROC rC()\nC\nrB;\nENDPROC",
     {"A": "*", "B": "AC", "C": "B", "D": "B"}),
    ("never comes back", "A\nrB;\nC", "LOCAL PROC rB()\nB\nEXIT;\nENDPROC", {"A": "*", "B": "A", "C": ""}),
    ("unseen", "A\nrMenu;\nB\nC", "", {"A": "*", "B": "*", "C": "B"}),
    ("unseen function", "A\nnZ:=fMenu();\nB", "", {"A": "*", "B": "*"}),
    ("late bound by data", "A\n%sName%;\nC", "LOCAL PROC rLeft()\nB\nENDPROC", {"A": "*", "B": "A", "C": "*"}),
    ("late bound by a text", 'A\n%"rLeft"%;\nC', "LOCAL PROC rLeft()\nB\nENDPROC", {"A": "*", "B": "A", "C": "B"}),
    ("a part of a text", 'A\n%"rLeft"+sName%;\nC', "LOCAL PROC rLeft1()\nB\nENDPROC", {"A": "*", "B": "A", "C": "*"}),
    ("present", "A\nrB;\nC", "LOCAL PROC rB(\\num n)\nIF Present(n) THEN\nB\nENDIF\nENDPROC",
     {"A": "*", "B": "A", "C": "AB"}),
    ("a function that moves", "A\nnZ:=fB();\nC", "LOCAL FUNC num fB()\nB\nRETURN 1;\nENDFUNC",
     {"A": "*", "B": "A", "C": "B"}),
    ("a trap that moves", "CONNECT iStop WITH tB;\nA\nB", "TRAP tB\nC\nENDTRAP", {"A": "*", "B": "*", "C": "*"}),
    ("a trap that counts", "CONNECT iStop WITH tB;\nA\nB", "TRAP tB\nnZ:=nZ+1;\nENDTRAP", {"A": "*", "B": "A"}),
    ("a trap that comes back", "CONNECT iStop WITH tB;\nA\nB",
     "TRAP tB\nStopMove;\nStorePath;\npV:=CRobT();\nC\nMoveL pV,v100,fine,tool0;\nRestoPath;\nStartMove;\nENDTRAP",
     {"A": "*", "B": "A", "C": "*", "V": "C"}),
    ("a search", "A\nSearchL di1,pV,pB,v100,tool0;\nC", "", {"A": "*", "B": "A", "C": "*"}),
    ("the path is left", "A\nClearPath;\nB", "", {"A": "*", "B": "*"}),
    ("very many ways", "A\nTEST nZ\n" + "".join(f"CASE {n}:\nB\n" for n in range(9)) + "ENDTEST\nC", "", {"C": "*"}),
]  # fmt: skip
HANDLERS = [
    ("what cannot move", "nZ:=1;\nENDPROC", "nZ:=2;\nRETRY;", {"B": "A"}),
    ("trynext", "C\nD\nENDPROC", "TRYNEXT;", {"C": "A", "D": "*", "B": "*"}),
    ("retry alone", "C\nD\nENDPROC", "RETRY;", {"C": "A", "D": "C", "B": "D"}),
    ("moves and retries", "C\nD\nENDPROC", "E\nRETRY;", {"C": "*", "D": "*", "E": "*"}),
    ("returns", "C\nD\nENDPROC", "RETURN;", {"C": "A", "D": "C", "B": "*"}),
    ("raises", "C\nD\nENDPROC", "RAISE;", {"C": "A", "D": "C", "B": "D"}),
]


@pytest.mark.parametrize(("body", "more", "expected"), [g[1:] for g in GRAPHS], ids=[g[0] for g in GRAPHS])
def test_arrivals(body: str, more: str, expected: dict[str, str]) -> None:
    found = in_main(body, more)
    assert {key: found[key] for key in expected} == expected


@pytest.mark.parametrize(("body", "handler", "expected"), [h[1:] for h in HANDLERS], ids=[h[0] for h in HANDLERS])
def test_handlers(body: str, handler: str, expected: dict[str, str]) -> None:
    """A handler runs from anywhere; what goes on behind it may begin where the failed motion was left."""
    found = in_main("A\nrC;\nB", f"LOCAL PROC rC()\n{body.removesuffix('ENDPROC')}ERROR\n{handler}\nENDPROC")
    assert {key: found[key] for key in expected} == expected


WRITTEN = [
    ("nothing", "MoveL pV,v100,fine,tool0;\nB", "", "pV", True),
    ("it is written", "MoveL pV,v100,fine,tool0;\npV:=pC;\nB", "", "pV", False),
    ("another is written", "MoveL pV,v100,fine,tool0;\nnZ:=1;\nB", "", "pV", True),
    ("on one way", "MoveL pV,v100,fine,tool0;\nIF bDo pV.trans.x:=1;\nB", "", "pV", False),
    ("by a routine", "MoveL pV,v100,fine,tool0;\nrW;\nB", "LOCAL PROC rW()\npV:=pC;\nENDPROC", "pV", False),
    ("through a parameter", "MoveL pV,v100,fine,tool0;\nrW pV;\nB",
     "LOCAL PROC rW(INOUT robtarget p)\np:=pC;\nENDPROC", "pV", False),
    ("by a trap", "MoveL pV,v100,fine,tool0;\nB", "TRAP tW\npV:=pC;\nENDTRAP", "pV", False),
    ("by an instruction", "MoveL Offs(pA,0,0,nZ),v100,fine,tool0;\nTPReadNum nZ,\"z\";\nB", "", "Offs(pA,0,0,nZ)", False),
    ("the displacement", "A\nPDispSet [[1,0,0],[1,0,0,0]];\nB", "", "pA", False),
    ("the loop counter", "FOR i FROM 1 TO 3 DO\nMoveL Offs(pA,i,0,0),v100,fine,tool0;\nB\nENDFOR", "",
     "Offs(pA,i,0,0)", True),
    ("the loop is over", "FOR i FROM 1 TO 3 DO\nMoveL Offs(pA,i,0,0),v100,fine,tool0;\nENDFOR\nB", "",
     "Offs(pA,i,0,0)", False),
]  # fmt: skip


@pytest.mark.parametrize(("body", "more", "text", "kept"), [w[1:] for w in WRITTEN], ids=[w[0] for w in WRITTEN])
def test_what_lies_between(body: str, more: str, text: str, kept: bool) -> None:
    """Data is as it was when the arm came only where nothing between can have written it."""
    read = program(f"PROC main()\n{body}\nENDPROC\n{more}")
    found = Arrivals(read)
    goal = next(s for s in read.statements if (to := s.argument("to")) is not None and to.text == "pB")
    assert only(found.before(goal.key)) is not None
    assert found.keeps(goal, text) is kept


def test_parameters_of_another_call_are_other_data() -> None:
    """Where the arm came from one call to the next, a parameter means something else."""
    more = "LOCAL PROC rB(robtarget pGo)\nMoveL pGo,v100,fine,tool0;\nrC pGo;\nENDPROC\n"
    more += "LOCAL PROC rC(robtarget pGo)\nB\nENDPROC"
    read = program(f"PROC main()\nrB pA;\nENDPROC\n{more}")
    found, goal = Arrivals(read), read.statements[-1]
    assert only(found.before(goal.key)) is not None
    assert not found.keeps(goal, "pGo")
    assert found.keeps(goal, "pA tool0 wobj0")


@pytest.mark.parametrize(
    ("body", "expected"), [("A\nB", False), ("A\nIF YES B\nB", False), ("IF bDo THEN\nA\nENDIF", True)]
)
def test_whether_anything_is_open(body: str, expected: bool) -> None:
    read = program(f"PROC main()\n{body.replace('YES B', 'YES nZ:=1;')}\nENDPROC")
    assert Arrivals(read).open is expected


@pytest.mark.parametrize(
    "of",
    [
        lambda n: "PROC main()\n" + "A\n" * n + "ENDPROC",
        lambda n: "PROC main()\n" + "IF bDo THEN\nA\nENDIF\n" * n + "ENDPROC",
        lambda n: "PROC main()\nIF nZ=0 THEN\nA\n" + "ELSEIF nZ=1 THEN\nB\n" * n + "ENDIF\nC\nENDPROC",
        lambda n: "PROC main()\n" + "".join(f"l{k}:\nA\nIF bDo GOTO l{k};\n" for k in range(n)) + "ENDPROC",
        lambda n: "".join(f"LOCAL PROC r{k}()\nA\nr{k + 1};\nENDPROC\n" for k in range(n)) + f"PROC r{n}()\nB\nENDPROC",
        lambda n: "PROC main()\nA\n" + "nZ:=nZ+1;\n" * n + "B\nENDPROC",
    ],
    ids=["line", "branches", "elseif", "jumps", "calls", "assignments"],
)
def test_the_cost_goes_with_the_length(of) -> None:  # type: ignore[no-untyped-def]
    short, longer = (program(of(n)) for n in (500, 2000))
    assert operations(lambda: Arrivals(longer)) < 4.5 * operations(lambda: Arrivals(short))
