"""Programs compared by meaning."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence

import numpy as np
import pytest

from postproc.rapid.diff.compare import ProgramDiff, compare_programs
from postproc.rapid.diff.difference import Difference
from postproc.rapid.diff.pairing import UNPAIRED_COST, aligned, cheapest_pairs
from postproc.report.terminal import render_text
from postproc.results.convert.difference import difference_document
from tests.rapid.build import UNUSED, module, program, target

DATA = f"CONST robtarget p:={target(100, 0, 0)}; CONST robtarget q:={target(200, 0, 0)}; "
DATA += "PERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[2,[0,0,50],[1,0,0,0],0,0,0]];"
BODY = "MoveJ p,v100,z10,t; SetDO do1,1; MoveL q,v100,fine,t; IF di1=1 THEN MoveL p,v50,fine,t; ENDIF"
TEXT = module(BODY, DATA).decode()
HALF = math.radians(0.5) / 2
ADDED = f"MoveL {target(150, 0, 0)},v100,z1,t; MoveL q,"


def compare(before: str, after: str, tolerance_mm: float = 0.001) -> ProgramDiff:
    return compare_programs(program(before, "a.mod"), program(after, "b.mod"), tolerance_mm)


def of_bodies(before: Sequence[str], after: Sequence[str], tolerance_mm: float = 0.001) -> tuple[Difference, ...]:
    """What differs between two bodies with a statement on each line."""
    return compare(*(module("\n".join(body), DATA).decode() for body in (before, after)), tolerance_mm).differences


def shown(difference: Difference) -> str:
    """Kind, what it is, name, and as far as they differ distance, angle, configuration and arguments."""
    parts = [f"{difference.kind} {difference.what} {difference.name}"]
    parts += [f"{difference.distance_mm:.6g} mm"] if difference.distance_mm else []
    parts += [f"{difference.angle_deg:.6g} deg"] if difference.angle_deg else []
    parts += ["conf {} {}".format(*difference.conf)] if difference.conf else []
    return ", ".join([*parts, *(f"{role}: {before} -> {after}" for role, before, after in difference.arguments)])


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("do1,1", "do1,1", ""),
        ("MoveL q", "! moved\n  movel   Q", ""),
        ("MoveL q,", f"MoveL {target(200, 0, 0)},", ""),
        ("MoveL q,", "MoveL Offs(p,100,0,0),", ""),
        ("v100", "[100,500,5000,1000]", ""),
        ("9E9", "9E+09", ""),
        ("MoveL q,v100", "MoveL q,v200\\V:=100", ""),
        ("do1,1", "do1,1.0", ""),
        ("di1=1", "di1=1E0", ""),
        ("THEN MoveL p,v50,fine,t; ENDIF", "MoveL p,v50,fine,t;", ""),
        ("[200,0,0],[0,1,0,0]", "[200,0,0],[0,-1,0,0]", ""),
        ("PERS", f"CONST robtarget extra:={target(1, 1, 1)};PERS", ""),
        ("[200,0,0]", "[200.3,0,0.4]", "changed motion MoveL, 0.5 mm"),
        ("[200,0,0],[0,1,0,0]", f"[200,0,0],[{-math.sin(HALF)},{math.cos(HALF)},0,0]", "changed motion MoveL, 0.5 deg"),
        ("q,v100,fine", "q,v100,z0", "changed motion MoveL, zone: [TRUE,0,0,0,0,0,0] -> [FALSE,0.3,0.3,0.3,0.03,0.3,0.03]"),
        ("q,v100", "q,v150", "changed motion MoveL, speed: [100,500,5000,1000] -> [150,500,5000,1000]"),
        ("MoveL q", "MoveJ q", "changed motion MoveJ, instruction: MoveL -> MoveJ"),
        ("q,v100,fine,t", "q,v100,fine,t\\Corr", "changed motion MoveL, \\corr:  -> "),
        ("q,v100", "q,v100\\T:=3", "changed motion MoveL, duration: not known -> 3"),
        ("[200,0,0],[0,1,0,0],[0,0,0,0]", "[200,0,0],[0,1,0,0],[0,-1,0,0]", "changed motion MoveL, conf (0, 0, 0, 0) (0, -1, 0, 0)"),
        ("q,v100,fine,t;", "q,v100,fine,tool0;", "changed motion MoveL, tool: "),
        ("[200,0,0],[0,1,0,0],[0,0,0,0],[9E9", "[200,0,0],[0,1,0,0],[0,0,0,0],[7", "changed motion MoveL, external axes: "),
        ("do1,1", "do1,0", "changed statement setdo, text: setdo do1 , 1 ; -> setdo do1 , 0 ;"),
        ("SetDO do1,1;", "", "removed statement setdo do1 , 1 ;"),
        ("di1=1", "di1=0", "changed statement if, text: if di1 = 1 -> if di1 = 0"),
        ("MoveL q,", ADDED, "added motion MoveL"),
        ("SetDO do1,1; MoveL q,v100,fine,t;", "MoveL q,v100,fine,t; SetDO do1,1;",
         "changed statement setdo, motion statements before it: 1 -> 2"),
        ("MoveJ p,v100,z10,t; SetDO do1,1;", "SetDO do1,1; MoveJ p,v100,z10,t;",
         "changed statement setdo, motion statements before it: 1 -> 0"),
        ("MoveL p,v50,fine,t; ENDIF", "ENDIF MoveL p,v50,fine,t;", "changed statement end, motion statements before it: 3 -> 2"),
        ("MoveL q,v100,fine,t; IF di1=1 THEN", "IF di1=1 THEN MoveL q,v100,fine,t;",
         "changed statement if, motion statements before it: 2 -> 1"),
    ],
)  # fmt: skip
def test_what_an_edit_changes(old: str, new: str, expected: str) -> None:
    assert old in TEXT
    differences = compare(TEXT, TEXT.replace(old, new)).differences
    assert len(differences) == bool(expected)
    assert all(shown(difference).startswith(expected) for difference in differences)


def test_what_is_within_the_tolerance_is_measured_and_equal() -> None:
    found = compare(TEXT, TEXT.replace("[200,", "[200.3,"), tolerance_mm=0.31)
    assert found.equal and found.compared == 3 and found.max_distance_mm == pytest.approx(0.3)


def test_data_that_other_statements_use_is_compared() -> None:
    found = compare(TEXT, TEXT.replace("[0,0,100]", "[0,0,101]"))
    assert [d.name for d in found.differences if d.what == "declaration"] == ["t"]


def lines(points: Sequence[float], z: float = 0.0, name: str = "MoveL") -> list[str]:
    return [f"{name} {target(x, 0, z)},v100,z1,t;" for x in points]


SEAM = [float(x) for x in range(0, 5000, 10)]
AMONG = [*SEAM[:31], 305.0, *SEAM[31:59], 585.0, *SEAM[59:78], *SEAM[79:100]]


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        # 3 mm before a target that was itself corrected by 0.5 mm; as many statements before as behind.
        (lines([0, 30, 60]), lines([0, 27, 30, 60], 0.5), [("added", None, 1)]),
        (lines([0, 30, 60]), lines([0, 27, 30], 0.5), [("added", None, 1), ("removed", 2, None)]),
        (lines([0, 27, 30, 60], 0.5), lines([0, 30, 60]), [("removed", 1, None)]),
        (lines(SEAM[:100]), lines(AMONG, 0.1), [("added", None, 31), ("added", None, 60), ("removed", 78, None)]),
        # Longer than what is looked ahead anywhere, and at the same distances as the seam behind it.
        (lines(SEAM), [*lines(SEAM[:100], 0.2), *lines(SEAM[:450], 100), *lines(SEAM[100:], 0.2)],
         [("added", None, 100 + k) for k in range(450)]),
        (lines([0, 10, 20]), [*lines([0]), *lines([400], name="MoveJ"), *lines([20])], [("removed", 1, None), ("added", None, 1)]),
        (lines([0, 10, 20]), [*lines([0]), *lines([10], name="MoveJ"), *lines([20])], [("changed", 1, 1)]),
    ],
)  # fmt: skip
def test_statements_are_paired_with_those_that_they_are(
    before: list[str], after: list[str], expected: list[tuple[str, int | None, int | None]]
) -> None:
    def row(line: int | None) -> int | None:
        return None if line is None else line - 4

    assert [(d.kind, row(d.line_a), row(d.line_b)) for d in of_bodies(before, after, 0.6)] == expected


def test_named_targets_pair_with_themselves_however_far_they_were_moved() -> None:
    moved = TEXT.replace("[200,0,0]", "[200,0,70]").replace("MoveL q,", ADDED.replace("150,0,0", "200,0,1"))
    assert [shown(d) for d in compare(TEXT, moved).differences] == ["added motion MoveL", "changed motion MoveL, 70 mm"]


def test_pairs_cost_least() -> None:
    """The dynamic programming of a band against the plain recursion over all pairings."""
    rng = np.random.default_rng(3)

    def least(costs: np.ndarray, i: int, j: int) -> float:
        if i == 0 or j == 0:
            return UNPAIRED_COST * (i + j)
        both = least(costs, i - 1, j - 1) + costs[i - 1, j - 1]
        return min(both, UNPAIRED_COST + least(costs, i - 1, j), UNPAIRED_COST + least(costs, i, j - 1))

    for n, m in ((1, 1), (4, 6), (6, 3), (5, 5)):
        costs = rng.uniform(0, 2, (n, m))
        pairs = cheapest_pairs(n, m, lambda i, columns, c=costs: c[i, columns], -9, 9)
        total = sum(costs[i, j] if i is not None and j is not None else UNPAIRED_COST for i, j in pairs)
        assert total == pytest.approx(least(costs, n, m))
        assert [i for i, _ in pairs if i is not None] == list(range(n))
        assert [j for _, j in pairs if j is not None] == list(range(m))


def test_a_circle_point_that_moves_farther_than_the_target_is_named() -> None:
    """Where an arc is divided its circle point moves along it, its target stays."""
    body = "MoveL p,v100,fine,t; MoveC {},q,v100,fine,t;"
    (difference,) = of_bodies(*([body.format(target(150, y, 0))] for y in (50, 48)))
    assert difference.distance_mm == pytest.approx(2.0) and difference.at_circle_point
    assert difference.shift_mm == pytest.approx((0.0, -2.0, 0.0))


def test_the_text_for_the_terminal() -> None:
    found = compare(TEXT, TEXT.replace("q,v100,fine", "q,v150,fine").replace("[200,", "[200.25,"))
    sentence, figures, basis, _, heading, columns, row = render_text(difference_document("a", "b", found)).splitlines()
    assert sentence == "1 of 3 motion statements differ, by up to 0.250 mm, the speed of 1."
    assert figures == "largest angle 0.000 deg, statements that differ 1"
    assert (basis, heading) == ("Tolerance 0.001 mm and 0.01 deg.", "What differs:")
    assert columns.split()[:5] == ["what", "where", "line", "before", "line"]
    assert row.split()[:9] == ["changed", "M.main", "4", "4", "MoveL", "q", "0.2500", "0.000", "0.000"]
    assert row.split()[11:13] == ["150.0", "100.0"]


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("MoveL q,vX,fine,tX;", "MoveL q,vX,fine,tY;", "tool: tX -> tY"),
        ("MoveL q,vX,fine,tX;", "MoveL q,v100,fine,tX;", "speed: vX -> v100"),
        ("MoveL q,v20,zX,t;", "MoveL q,v25,zX,t;", "speed: v20 -> v25"),
        ("MoveL q,v20,zX,t\\WObj:=wX;", "MoveL q,v20,zX,t;", "\\wobj: wX -> "),
        ("MoveL pX,v20,z1,t;", "MoveL pY,v20,z1,t;", "to: pX -> pY"),
        ("MoveL Offs(pX,0,0,50),v20,z1,t;", "MoveL Offs(pX,0,0,-50),v20,z1,t;", "to: Offs(pX,0,0,50) -> Offs(pX,0,0,-50)"),
        ("SpotL p,v20,gun1,sp1,t;", "SpotL p,v20,gun1,sp2,t;", "extra: sp1 -> sp2"),
        (f"MoveAbsJ [[1,2,3,4,5,6],{UNUSED}],v5,fine,t;", f"MoveAbsJ [[1,2,3,4,5.5,6],{UNUSED}],v5,fine,t;", "0.5 deg"),
    ],
)  # fmt: skip
def test_what_other_modules_declare_is_compared_by_its_words(before: str, after: str, expected: str) -> None:
    """A single module of a cell: its tools, frames and speeds stand elsewhere."""
    (difference,) = of_bodies([before], [after])
    assert shown(difference).partition(", ")[2] == expected
    assert of_bodies([before], [before]) == ()


@pytest.mark.parametrize(
    ("a", "b", "pairs"),
    [
        ("pqr", "pXr", "pp qX rr"), ("pqrs", "pXr", "pp qX rr s-"), ("pqr", "pqXYr", "pp qq -X -Y rr"),
        ("pqXr", "pr", "pp q- X- rr"), ("pq", "X", "pX q-"), ("", "X", "-X"),
    ],
)  # fmt: skip
def test_sequences_are_paired_in_order(a: str, b: str, pairs: str) -> None:
    assert [f"{x or '-'}{y or '-'}" for x, y in aligned(a, b, operator.eq)] == pairs.split()


def test_a_routine_that_one_program_lacks_is_one_difference() -> None:
    """Its statements and its data are part of it."""
    function = "  LOCAL FUNC num twice(num n)\n    VAR num m;\n    m:=2*n;\n    RETURN m;\n  ENDFUNC\n"
    longer = TEXT.replace("ENDMODULE", function + "ENDMODULE")
    assert [shown(d) for d in compare(TEXT, longer).differences] == ["added statement FUNC twice"]
    assert [shown(d) for d in compare(longer, TEXT).differences] == ["removed statement FUNC twice"]
