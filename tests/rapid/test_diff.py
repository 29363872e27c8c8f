"""Programs compared by meaning."""

from __future__ import annotations

import json
import math
import operator

import pytest

from postproc.rapid.diff.align import aligned
from postproc.rapid.diff.compare import ProgramDiff, compare_programs
from postproc.report.terminal import render_text
from postproc.results.difference import difference_document
from tests.rapid.build import UNUSED, module, program, target

DATA = f"CONST robtarget p:={target(100, 0, 0)};CONST robtarget q:={target(200, 0, 0)};PERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[2,[0,0,50],[1,0,0,0],0,0,0]];"
BODY = "MoveJ p,v100,z10,t; SetDO do1,1; MoveL q,v100,fine,t; IF di1=1 THEN MoveL p,v50,fine,t; ENDIF"


def compare(body: str, data: str = DATA, tolerance: float = 0.001) -> ProgramDiff:
    return compare_programs(program(module(BODY, DATA), "a.mod"), program(module(body, data), "b.mod"), tolerance)


def kinds(found: ProgramDiff) -> list[tuple[str, str, str]]:
    return [(d.kind, d.what, d.name) for d in found.differences]


@pytest.mark.parametrize(
    ("body", "data"),
    [
        (BODY, DATA),
        (BODY.replace("MoveL q", "! moved\n  movel   Q"), DATA),
        (BODY.replace("q,", target(200, 0, 0) + ","), DATA),
        (BODY.replace("q,", "Offs(p,100,0,0),"), DATA),
        (BODY.replace("v100", "[100,500,5000,1000]"), DATA),
        (BODY, DATA.replace("9E9", "9E+09")),
        (BODY.replace("MoveL q,v100", "MoveL q,v200\\V:=100"), DATA),
        (BODY.replace("do1,1", "do1,1.0").replace("di1=1", "di1=1E0"), DATA),
        (BODY.replace("IF di1=1 THEN MoveL p,v50,fine,t; ENDIF", "IF di1=1 MoveL p,v50,fine,t;"), DATA),
    ],
)
def test_what_means_the_same_is_equal(body: str, data: str) -> None:
    found = compare(body, data)
    assert found.equal, found.differences
    assert found.compared == 3


def test_a_moved_target_is_measured() -> None:
    found = compare(BODY, DATA.replace("[200,0,0],[0,1,0,0]", "[200.3,0,0.4],[0,1,0,0]"))
    assert kinds(found) == [("changed", "motion", "MoveL")]
    assert found.max_distance_mm == pytest.approx(0.5)
    assert compare(BODY, DATA.replace("[200,", "[200.3,"), tolerance=0.31).equal


def test_a_turned_target_is_measured() -> None:
    half = math.radians(0.5) / 2
    turned = f"[200,0,0],[{-math.sin(half)},{math.cos(half)},0,0]"
    found = compare(BODY, DATA.replace("[200,0,0],[0,1,0,0]", turned))
    assert found.max_angle_deg == pytest.approx(0.5, abs=1e-6)
    assert not found.equal


def test_the_same_orientation_with_the_other_sign_is_equal() -> None:
    assert compare(BODY, DATA.replace("[200,0,0],[0,1,0,0]", "[200,0,0],[0,-1,0,0]")).equal


@pytest.mark.parametrize(
    ("old", "new", "role"),
    [
        ("MoveL q,v100,fine", "MoveL q,v100,z0", "zone"), ("MoveL q,v100", "MoveL q,v150", "speed"),
        ("MoveL q", "MoveJ q", "instruction"), ("q,v100,fine,t", "q,v100,fine,t\\Corr", "\\corr"),
        ("q,v100,fine,t", "q,v100,fine,tool0", "tool"), ("q,v100", "q,v100\\T:=3", "duration"),
    ],
)  # fmt: skip
def test_arguments(old: str, new: str, role: str) -> None:
    found = compare(BODY.replace(old, new))
    assert role in [row[0] for d in found.differences for row in d.arguments]


def test_configuration_and_axes() -> None:
    found = compare(BODY, DATA.replace("[200,0,0],[0,1,0,0],[0,0,0,0]", "[200,0,0],[0,1,0,0],[0,-1,0,0]"))
    assert found.differences[0].conf == ((0, 0, 0, 0), (0, -1, 0, 0))
    moved = DATA.replace(
        "CONST robtarget q:=" + target(200, 0, 0), "CONST robtarget q:=" + target(200, 0, 0).replace("[9E9", "[7")
    )
    assert [row[0] for d in compare(BODY, moved).differences for row in d.arguments] == ["external axes"]


def test_added_and_removed_statements_do_not_shift_the_rest() -> None:
    points = [f"MoveL {target(x, 0, 0)},v100,z1,t;" for x in range(0, 1000, 10)]
    more = list(points)
    more.insert(31, f"MoveL {target(305, 0, 1)},v100,z1,t;")
    more.insert(60, f"MoveL {target(585, 0, 1)},v100,z1,t;")
    del more[80]
    moved = [line.replace(",0,0],[0,1", ",0,0.1],[0,1") for line in more]
    a, b = (program(module("\n".join(lines), DATA)) for lines in (points, moved))
    found = compare_programs(a, b, 0.15)
    assert [(d.kind, d.line_a, d.line_b) for d in found.differences] == [
        ("added", None, 4 + 31), ("added", None, 4 + 60), ("removed", 4 + 78, None),
    ]  # fmt: skip
    assert found.max_distance_mm == pytest.approx(0.1)


def test_other_statements_and_data() -> None:
    assert kinds(compare(BODY.replace("do1,1", "do1,0"))) == [("changed", "statement", "setdo")]
    assert kinds(compare(BODY.replace("SetDO do1,1;", ""))) == [("removed", "statement", "setdo do1 , 1 ;")]
    assert kinds(compare(BODY.replace("di1=1", "di1=0")))[0][:2] == ("changed", "statement")
    found = compare(BODY, DATA.replace("[0,0,100]", "[0,0,101]"))
    assert ("changed", "declaration", "t") in kinds(found)
    assert compare(BODY, DATA + f"CONST robtarget extra:={target(1, 1, 1)};").equal


@pytest.mark.parametrize(
    ("body", "line"),
    [
        ("MoveJ p,v100,z10,t; MoveL q,v100,fine,t; SetDO do1,1; IF di1=1 THEN MoveL p,v50,fine,t; ENDIF", ("1", "2")),
        ("SetDO do1,1; MoveJ p,v100,z10,t; MoveL q,v100,fine,t; IF di1=1 THEN MoveL p,v50,fine,t; ENDIF", ("1", "0")),
        ("MoveJ p,v100,z10,t; SetDO do1,1; MoveL q,v100,fine,t; IF di1=1 THEN ENDIF MoveL p,v50,fine,t;", ("3", "2")),
        ("MoveJ p,v100,z10,t; SetDO do1,1; IF di1=1 THEN MoveL q,v100,fine,t; MoveL p,v50,fine,t; ENDIF", ("2", "1")),
    ],
)
def test_a_statement_that_moves_past_a_motion_is_another_program(body: str, line: tuple[str, str]) -> None:
    found = compare(body)
    assert [d.arguments for d in found.differences] == [(("motion statements before it", *line),)]


def test_added_targets_do_not_shift_the_statements_between_them() -> None:
    added = BODY.replace("MoveL q,", f"MoveL {target(150, 0, 0)},v100,z1,t; MoveL q,")
    assert kinds(compare(added)) == [("added", "motion", "MoveL")]


def lines(points: list[float], shift: float = 0.0, name: str = "MoveL") -> list[str]:
    return [f"{name} {target(x, 0, shift)},v100,z1,t;" for x in points]


def kinds_of(before: list[str], after: list[str], tolerance: float = 0.6) -> list[tuple[str, int | None, int | None]]:
    """What differs, with the place in both lists."""
    a, b = (program(module("\n".join(body), DATA)) for body in (before, after))
    found = compare_programs(a, b, tolerance).differences
    return [
        (d.kind, None if d.line_a is None else d.line_a - 4, None if d.line_b is None else d.line_b - 4) for d in found
    ]


def test_a_target_added_beside_another_is_no_change_of_it() -> None:
    """3 mm before a target that was itself corrected by 0.5 mm; as many statements before as behind."""
    points = [0.0, 30.0, 60.0]
    assert kinds_of(lines(points), lines([0, 27, 30, 60], 0.5)) == [("added", None, 1)]
    assert kinds_of(lines(points), lines([0, 27, 30], 0.5)) == [("added", None, 1), ("removed", 2, None)]
    assert kinds_of(lines([0, 27, 30, 60], 0.5), lines(points)) == [("removed", 1, None)]


def test_a_whole_seam_that_was_put_in_is_added() -> None:
    """Longer than what is looked ahead anywhere, and at the same distances as the seam behind it."""
    seam = [float(x) for x in range(0, 5000, 10)]
    put_in = lines(seam[:450], 100.0)
    found = kinds_of(lines(seam), [*lines(seam[:100], 0.2), *put_in, *lines(seam[100:], 0.2)])
    assert found == [("added", None, 100 + k) for k in range(450)]


def test_names_and_instructions_tell_statements_apart() -> None:
    """Named targets pair with themselves however far they were moved; another instruction elsewhere is another."""
    moved = DATA.replace("[200,0,0]", "[200,0,70]")
    added = BODY.replace("MoveL q,", f"MoveL {target(200, 0, 1)},v100,z1,t; MoveL q,")
    found = compare(added, moved)
    assert [(d.kind, d.name, d.distance_mm) for d in found.differences] == [
        ("added", "MoveL", None), ("changed", "MoveL", pytest.approx(70.0)),
    ]  # fmt: skip
    one, two = lines([0, 10, 20]), [*lines([0]), *lines([400], name="MoveJ"), *lines([20])]
    assert kinds_of(one, two) == [("removed", 1, None), ("added", None, 1)]
    two = [*lines([0]), *lines([10], name="MoveJ"), *lines([20])]
    assert kinds_of(one, two) == [("changed", 1, 1)]


def test_a_circle_point_is_told_apart_from_the_target() -> None:
    """Where an arc is divided its circle point moves along it, its target stays."""
    body = "MoveL p,v100,fine,t; MoveC {},q,v100,fine,t;"
    one, two = (program(module(body.format(target(150, y, 0)), DATA)) for y in (50, 48))
    (difference,) = compare_programs(one, two, 0.001).differences
    assert difference.distance_mm == pytest.approx(2.0) and difference.at_circle_point
    assert difference.shift_mm == pytest.approx((0.0, -2.0, 0.0))


def test_joint_targets() -> None:
    one = program(module(f"MoveAbsJ [[1,2,3,4,5,6],{UNUSED}],v5,fine,tool0;"))
    two = program(module(f"MoveAbsJ [[1,2,3,4,5.5,6],{UNUSED}],v5,fine,tool0;"))
    assert compare_programs(one, two, 0.1).max_angle_deg == pytest.approx(0.5)


def test_text_and_json() -> None:
    found = compare(BODY.replace("q,v100,fine", "q,v150,fine"), DATA.replace("[200,", "[200.25,"))
    document = difference_document("a.mod", "b.mod", found)
    sentence, figures, basis, _, heading, columns, row = render_text(document).splitlines()
    assert sentence == "Of 3 motion statements and all others: 1 changed."
    assert figures == "largest distance 0.250 mm, largest angle 0.000 deg, statements that differ 1"
    assert (basis, heading) == ("Tolerance 0.001 mm and 0.01 deg.", "What differs:")
    assert columns.split()[:5] == ["what", "where", "line", "before", "line"]
    assert row.split()[:8] == ["changed", "M.main", "4", "4", "MoveL", "0.2500", "0.000", "0.000"]
    assert row.split()[10:12] == ["150.0", "100.0"]
    data = json.loads(json.dumps(document.values, allow_nan=False))
    assert data["schema"] == "postproc/diff/1"
    assert data["differences"][0]["distance_mm"] == pytest.approx(0.25)
    assert data["differences"][0]["line_b"] == 4


@pytest.mark.parametrize(
    ("before", "after", "rows"),
    [
        ("MoveL q,vX,fine,tX;", "MoveL q,vX,fine,tY;", [("tool", "tX", "tY")]),
        ("MoveL q,vX,fine,tX;", "MoveL q,v100,fine,tX;", [("speed", "vX", "v100")]),
        ("MoveL q,v20,zX,t;", "MoveL q,v25,zX,t;", [("speed", "v20", "v25")]),
        ("MoveL q,v20,zX,t\\WObj:=wX;", "MoveL q,v20,zX,t;", [("\\wobj", "wX", "")]),
        ("MoveL pX,v20,z1,t;", "MoveL pY,v20,z1,t;", [("to", "pX", "pY")]),
        ("MoveL Offs(pX,0,0,50),v20,z1,t;", "MoveL Offs(pX,0,0,-50),v20,z1,t;", [("to", "Offs(pX,0,0,50)", "Offs(pX,0,0,-50)")]),
        ("SpotL p,v20,gun1,sp1,t;", "SpotL p,v20,gun1,sp2,t;", [("extra", "sp1", "sp2")]),
    ],
)  # fmt: skip
def test_what_other_modules_declare_is_compared_by_its_words(
    before: str, after: str, rows: list[tuple[str, str, str]]
) -> None:
    """A single module of a cell: its tools, frames and speeds stand elsewhere."""
    a, b = (program(module(body, DATA), f"{name}.mod") for name, body in (("a", before), ("b", after)))
    (difference,) = compare_programs(a, b, 0.001).differences
    assert list(difference.arguments) == rows
    assert compare_programs(a, a, 0.001).equal


@pytest.mark.parametrize(
    ("a", "b", "pairs"),
    [
        ("pqr", "pXr", ["pp", "qX", "rr"]),
        ("pqrs", "pXr", ["pp", "qX", "rr", "s-"]),
        ("pqr", "pqXYr", ["pp", "qq", "-X", "-Y", "rr"]),
        ("pqXr", "pr", ["pp", "q-", "X-", "rr"]),
        ("pq", "X", ["pX", "q-"]),
        ("", "X", ["-X"]),
    ],
)
def test_sequences_are_paired_in_order(a: str, b: str, pairs: list[str]) -> None:
    assert [f"{x or '-'}{y or '-'}" for x, y in aligned(a, b, operator.eq)] == pairs


def test_a_routine_that_one_program_lacks_is_one_difference() -> None:
    """Its statements and its data are part of it."""
    own = b"  LOCAL FUNC num twice(num n)\n    VAR num m;\n    m:=2*n;\n    RETURN m;\n  ENDFUNC\n"
    text = module(BODY, DATA)
    longer = text.replace(b"ENDMODULE", own + b"ENDMODULE")
    assert longer != text
    for a, b, kind in ((text, longer, "added"), (longer, text, "removed")):
        found = compare_programs(program(a, "a.mod"), program(b, "b.mod"), 0.001)
        assert kinds(found) == [(kind, "statement", "FUNC twice")]
