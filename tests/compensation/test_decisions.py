"""Which text is changed: numbers in place, an inline target, or nothing, with the reason; through the whole conversion."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.text.insertions import ELSEWHERE
from postproc.report.terminal import render_text
from postproc.results.conversion import conversion_document
from tests.compensation.build import (
    body_of,
    codes,
    convert,
    events,
    independent,
    lines_of,
    module,
    outcome,
    places,
    target,
    written,
)

A, B, C = target(1350, -500), target(1350, -380), target(1270, -380, 760)
NUMBERS = re.compile(r"[+-]?\d+\.?\d*(?:E[+-]?\d+)?")


def rendered(conversion: Conversion) -> str:
    """What the terminal shows, on one line."""
    return " ".join(render_text(conversion_document("m.mod", conversion)).split())


def accurate(text: str, conversion: Conversion) -> None:
    """The written program keeps the promise, by another reader and another arm."""
    found = independent(text, conversion)
    assert found.violations == []
    assert found.after <= 0.01
    assert found.goal_after <= 0.003
    assert found.before > 0.5


def test_a_target_used_once_is_edited_in_place() -> None:
    text = module(
        f"CONST robtarget p1:={A};\nCONST robtarget p2:={B};", "MoveJ p1,v200,fine,tT;\nMoveL p2,v50,fine,tT;"
    )
    found = convert(text)
    assert [o.status for o in found.outcomes] == ["compensated"] * 2
    assert body_of(written(found)) == body_of(text)
    before, after = (lines_of(t) for t in (text, written(found)))
    after = [line for line in after if not line.startswith("! ")]
    changed = [(x, y) for x, y in zip(before, after, strict=True) if x != y]
    assert [x.split(":=")[0] for x, _ in changed] == ["CONST robtarget p1", "CONST robtarget p2"]
    for x, y in changed:
        assert NUMBERS.sub("#", x) == NUMBERS.sub("#", y)
        assert y.endswith(x[x.index(",[-1,0,-1,0]") :])
    accurate(text, found)


def test_numbers_keep_the_format_of_their_neighbours() -> None:
    """More decimals than needed are kept, fewer are extended to three, no blank moves."""
    text = module(
        "CONST robtarget p1 := [ [1350.00,-5.0E2 , 700.123450],[0.300294,-0.01573800,0.95241,0.049914], "
        "[-1,0,-1,0],[9E+09,9E+09,9E9,9E9,9E9,9E9] ]; ! seam start",
        f"MoveJ p1,v200,fine,tT;\nMoveL {B},v50,fine,tT;",
    )
    line = next(x for x in lines_of(written(convert(text))) if "p1 :=" in x)
    assert re.fullmatch(
        r"CONST robtarget p1 := \[ \[\d+\.\d{3},-\d+\.\d{1,3} , \d+\.\d{6}\],\[0\.3\d{0,6},-0\.01\d{6},0\.95\d{1,5},0\.05\d{0,5}\], "
        r"\[-1,0,-1,0\],\[9E\+09,9E\+09,9E9,9E9,9E9,9E9\] \]; ! seam start",
        line,
    ), line


@pytest.mark.parametrize("newline", ["\r\n", "\n"])
def test_bytes_that_need_no_change_are_kept(newline: str) -> None:
    text = module(
        f'CONST robtarget p1:={A}; ! Blechstärke\t5 mm\nVAR string s:="Naht für Ä";\nCONST robtarget p2:={B};',
        'TPWrite "größer \\ als";\nMoveJ p1,v200,fine,tT;\nMoveL   p2 ,v50,fine,tT ;  ! blanks   kept',
    ).replace("\n", newline)
    out = convert(text).output
    assert out is not None
    assert out.count(b"\n") - text.count("\n") == sum(x.startswith("! ") for x in lines_of(out.decode("latin-1")))
    assert (b"\r" in out) == (newline == "\r\n")
    assert out.count(b"\r\n") == (out.count(b"\n") if newline == "\r\n" else 0)
    kept = [x for x in text.encode("latin-1").splitlines(keepends=True) if b"robtarget" not in x]
    rest = [x for x in out.splitlines(keepends=True) if b"robtarget" not in x and not x.lstrip().startswith(b"! ")]
    assert rest == kept


def test_two_uses_in_the_same_context_share_the_declaration() -> None:
    text = module(
        f"CONST robtarget p1:={A};\nCONST robtarget p2:={B};",
        "MoveJ p1,v200,fine,tT;\nMoveL p2,v50,fine,tT;\nMoveL p1,v50,fine,tT;",
    )
    found = convert(text)
    assert body_of(written(found)) == body_of(text)
    assert [o.status for o in found.outcomes] == ["compensated"] * 3
    accurate(text, found)


def test_one_target_under_two_tools_becomes_two() -> None:
    """The tools differ in weight and length, so the arm bends differently: one declaration cannot serve both."""
    text = module(
        f"CONST robtarget p1:={A};",
        f"MoveJ p1,v200,fine,tT;\nMoveL {B},v50,fine,tT;\nMoveJ p1,v200,fine,tLong;\nMoveL {B},v50,fine,tLong;",
    )
    found = convert(text)
    assert [o.status for o in found.outcomes] == ["compensated"] * 4
    first, _, second, _ = places(written(found))
    assert math.dist(first, second) > 0.02
    accurate(text, found)


def test_target_and_its_offset() -> None:
    """Offs of a corrected target would carry the wrong correction: the offset gets a value of its own."""
    text = module(
        f"CONST robtarget p1:={A};",
        f"MoveJ Offs(p1,0,0,120),v200,fine,tT;\nMoveL p1,v50,fine,tT;\nMoveL {B},v50,fine,tT;\nMoveL Offs(p1,0,0,120),v50,fine,tT;",
    )
    found = convert(text)
    assert [o.status for o in found.outcomes] == ["compensated"] * 4
    accurate(text, found)


def test_offset_read_elsewhere_keeps_the_declaration() -> None:
    """What a program computes from a target must not change: the statement displaces it."""
    text = module(
        f"CONST robtarget p1:={A};\nVAR num x;",
        f"x:=p1.trans.x;\nMoveJ p1,v200,fine,tT;\nMoveL {B},v50,fine,tT;",
    )
    found = convert(text)
    assert f"CONST robtarget p1:={A};" in lines_of(written(found))
    assert re.fullmatch(r"MoveJ Offs\(p1(,-?\d\.\d+){3}\),v200,fine,tT;", body_of(written(found))[1])
    accurate(text, found)


def test_a_routine_called_twice_is_edited_once() -> None:
    text = module(
        f"CONST robtarget p1:={A};\nCONST robtarget p2:={B};",
        "seam;\nseam;",
        "  PROC seam()\n    MoveJ p1,v200,fine,tT;\n    MoveL p2,v50,fine,tT;\n  ENDPROC\n",
    )
    found = convert(text)
    assert len(events(written(found))) == 4
    assert [o.status for o in found.outcomes] == ["compensated"] * 2
    assert places(written(found))[:2] == places(written(found))[2:]
    accurate(text, found)


def test_array_element_with_a_literal_index() -> None:
    """Only the elements that are used change."""
    text = module(
        f"CONST robtarget p{{3}}:=[{A},\n{C},\n{B}];",
        "MoveJ p{1},v200,fine,tT;\nMoveL p{3},v50,fine,tT;",
    )
    found = convert(text)
    assert body_of(written(found)) == body_of(text)
    assert f"{C}," in lines_of(written(found))
    accurate(text, found)


def test_array_in_a_loop() -> None:
    text = module(
        f"CONST robtarget p{{3}}:=[{A},\n{B},\n{C}];\nVAR num i;",
        "MoveJ p{1},v200,fine,tT;\nFOR i FROM 1 TO 3 DO\nMoveL p{i},v50,fine,tT;\nENDFOR",
    )
    found = convert(text)
    out = written(found)
    assert [o.status for o in found.outcomes] == ["compensated"] * 2
    assert "MoveL p{i},v50,fine,tT;" in body_of(out)
    assert np.linalg.norm(np.subtract(places(out), places(text)), axis=1).min() > 0.5


def test_loop_over_ways_that_need_different_insertions() -> None:
    """Nothing can be added before a statement that runs on different ways: its targets are corrected, and a warning says so."""
    far = target(1350, -20)
    text = module(
        f"CONST robtarget p{{5}}:=[{A},\n{A},\n{far},\n{A},\n{target(1150, -500, 850)}];\nVAR num i;",
        "MoveJ p{1},v200,fine,tT;\nFOR i FROM 3 TO 5 STEP 2 DO\nMoveL p{i},v50,fine,tT;\nENDFOR",
    )
    found = convert(text)
    assert found.report["added_targets"] == 0
    assert body_of(written(found)) == body_of(text)
    warning = next(d for d in found.diagnostics if d.code == "CMP006")
    assert warning.help == f"no target was added: {ELSEWHERE}"  # p{1}, then p{3}
    assert found.report["max_error_after_mm"] > 0.01


def test_relative_tool_target() -> None:
    text = module(
        f"CONST robtarget p1:={A};",
        f"MoveJ RelTool(p1,0,0,-80),v200,fine,tT;\nMoveL RelTool(p1,0,0,0\\Rz:=10),v50,fine,tT;\nMoveL {B},v50,fine,tT;",
    )
    found = convert(text)
    assert [o.status for o in found.outcomes] == ["compensated"] * 3
    accurate(text, found)


def test_a_target_taught_at_run_time_is_left_alone() -> None:
    text = module(
        f"PERS robtarget pFound:={C};",
        f"MoveJ {A},v200,fine,tT;\nMoveL {B},v50,fine,tT;\npFound:=CRobT(\\Tool:=tT);\nMoveL pFound,v50,fine,tT;",
    )
    found = convert(text)
    last = outcome(found, 2)
    assert last.status == "skipped" and last.reason
    assert f"PERS robtarget pFound:={C};" in lines_of(written(found))
    assert body_of(written(found))[-1] == "MoveL pFound,v50,fine,tT;"


def test_joint_targets_are_left_alone() -> None:
    home = "CONST jointtarget jHome:=[[0,-20,20,0,60,0],[9E9,9E9,9E9,9E9,9E9,9E9]];"
    text = module(home, f"MoveAbsJ jHome\\NoEOffs,v200,fine,tT;\nMoveJ {A},v200,fine,tT;\nMoveL {B},v50,fine,tT;")
    found = convert(text)
    assert (outcome(found, 0).status, outcome(found, 1).status) == ("unchanged", "compensated")
    assert "joint" in (outcome(found, 0).reason or "")
    assert home in lines_of(written(found))
    accurate(text, found)


def test_a_target_shared_with_a_statement_that_is_skipped() -> None:
    """The statement that cannot be corrected keeps the programmed value, the other one gets its own."""
    text = module(
        f"CONST robtarget p1:={A};",
        f"MoveJ p1,v200,fine,tT;\nMoveL {B},v50,fine,tT;",
        "  PROC never()\n    MoveL p1,v50,fine,tT;\n  ENDPROC\n",
    )
    found = convert(text, entry="main")
    assert [o.status for o in found.outcomes] == ["compensated", "compensated", "skipped"]
    assert f"CONST robtarget p1:={A};" in lines_of(written(found))
    assert "MoveL p1,v50,fine,tT;" in lines_of(written(found))
    accurate(text, found)


def test_a_name_of_32_characters() -> None:
    name = "p" + "abcdefghij" * 3 + "x"
    assert len(name) == 32
    text = module(
        f"CONST robtarget {name}:={A};",
        f"MoveJ {name},v200,fine,tT;\nMoveL {B},v50,fine,tT;\nMoveJ {name},v200,fine,tLong;\nMoveL {B},v50,fine,tLong;",
    )
    out = written(convert(text))
    assert max(len(word) for word in re.findall(r"\b[a-zA-Z]\w*", out.split("PROC main()")[1])) <= 32
    accurate(text, convert(text))


def test_runs_that_arrive_differently_share_the_middle_of_what_they_ask_for() -> None:
    """A fly-by target of a routine is reached at two speeds: its inertial corrections differ by micrometres."""
    data = f"CONST robtarget a:={A};\nCONST robtarget b:={B};\nCONST robtarget c:={C};"
    visit = "  PROC visit()\n    MoveL b,v300,z20,tT;\n    MoveL c,v300,fine,tT;\n  ENDPROC\n"
    text = module(data, "MoveJ a,v100,fine,tT;\nvisit;\nMoveL a,v1000,z50,tT;\nvisit;", visit)
    found = convert(text, inertia=True)
    assert found.output is not None, codes(found)
    assert {o.status for o in found.outcomes} == {"compensated"}
    passed = [o for o in found.outcomes if o.statement.routine == "visit"]
    assert all(o.shift_mm is not None and o.shift_mm > 1.0 for o in passed)
    assert passed[0].residual_mm is not None
    assert 1e-4 < passed[0].residual_mm < 0.05


def test_runs_that_ask_for_quite_different_corrections_are_left_alone() -> None:
    data = f"CONST robtarget a:={A};\nCONST robtarget b:={B};"
    visit = "  PROC visit(PERS tooldata t)\n    MoveL b,v300,fine,t;\n  ENDPROC\n"
    other = "PERS tooldata tOther:=[TRUE,[[0,0,350],[1,0,0,0]],[60,[0,300,420],[1,0,0,0],0,0,0]];"
    light = "PERS tooldata tLight:=[TRUE,[[0,0,350],[1,0,0,0]],[0.001,[0,0,1],[1,0,0,0],0,0,0]];"
    body = "MoveJ a,v100,fine,tLight;\nvisit tLight;\nMoveL a,v100,fine,tOther;\nvisit tOther;"
    found = convert(module(data + "\n" + other + "\n" + light, body, visit), force=(0.0, 0.0, 0.0))
    left = next(o for o in found.outcomes if o.statement.routine == "visit")
    assert left.status == "skipped" and "several times" in (left.reason or "")
    assert "CMP005" in codes(found)
    assert re.search(r"^  ! 1 motion statement left as written$", written(found), re.MULTILINE)


LAYERS = """FOR i FROM 0 TO 3 DO
MoveL Offs(a,0,0,2.5*i),v300,fine,tT;
MoveL Offs(b,0,0,2.5*i),v20,fine,tT;
MoveL Offs(b,0,0,60+2.5*i),v300,z5,tT;
MoveL Offs(a,0,0,60+2.5*i),v300,z5,tT;
ENDFOR"""


def test_layers_share_the_correction_of_what_is_displaced() -> None:
    data = f"CONST robtarget a:={A};\nCONST robtarget b:={target(1350, -430)};"
    text = module(data, f"MoveJ Offs(a,0,0,100),v500,fine,tT;\n{LAYERS}")
    found = convert(text)
    assert {o.status for o in found.outcomes} == {"compensated"}
    amounts = re.compile(r"MoveL Offs\([ab],-?[\d.]+,-?[\d.]+,(60\+)?2\.5\*i([+-][\d.]+)?\),")
    lines = [line for line in lines_of(written(found)) if "2.5*i" in line]
    assert len(lines) == 4 and all(amounts.match(line) for line in lines), lines
    again = independent(text, found)
    assert again.violations == []
    assert again.before > 0.5 and again.goal_after <= 0.005 and again.after <= 0.01


def test_displacements_of_different_targets_share_an_offset() -> None:
    data = f"CONST robtarget row{{2}}:=[{A},{C}];\nVAR robtarget p;"
    loop = "FOR i FROM 1 TO 2 DO\np:=row{i};\nMoveL Offs(p,0,0,10*i),v50,fine,tT;\nENDFOR"
    text = module(data, f"MoveJ {B},v500,fine,tT;\n{loop}")
    found = convert(text)
    assert [o.edited for o in found.outcomes] == ["aggregate", "argument"]
    assert re.search(
        r"^MoveL Offs\(p(,[-\d.]+[-+][\d.]+\*i){2},10\*i[-+][\d.]+[-+][\d.]+\*i\),v50", body_of(written(found))[3]
    )
    again = independent(text, found)
    assert again.violations == []
    assert again.before > 1.0 and again.goal_after < 0.001
    assert again.after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


def test_confdata_stays_as_it_is_written_while_it_selects_the_posture() -> None:
    """Axis 1 stands at -0.04 deg; the correction of 1.5 mm turns it to the other side of zero, one quadrant on."""
    near, beyond = target(1350, -70), target(1350, 50)
    text = module("", f"MoveJ {near},v200,fine,tT;\nMoveL {beyond},v50,fine,tT;")
    found = convert(text)
    assert found.output is not None, codes(found)
    goals = [e.target for e in events(written(found))]
    assert goals[0].robconf == goals[-1].robconf == (-1, 0, -1, 0)
    assert [s["conf_changed"] for s in found.report["statements"]] == [False, False]
    assert "confdata" not in rendered(found)
    accurate(text, found)


def test_confdata_changes_where_the_correction_carries_a_joint_two_quadrants_from_it() -> None:
    """As above, taught with axis 1 in the quadrant before: the correction would be 90.03 deg beyond that."""
    near, beyond = target(1350, -70), target(1350, 50, conf=(-2, 0, -1, 0))
    text = module("", f"MoveJ {near},v200,fine,tT;\nMoveL {beyond},v50,fine,tT;")
    found = convert(text)
    assert found.output is not None, codes(found)
    goals = [e.target for e in events(written(found))]
    assert [goals[0].robconf, goals[-1].robconf] == [(-1, 0, -1, 0), (0, 0, -1, 0)]
    assert [s["conf_changed"] for s in found.report["statements"]] == [False, True]
    line = found.outcomes[1].statement.line
    assert f"confdata of 1 statement changed, it would select another posture (line {line})" in rendered(found)
    accurate(text, found)


def test_a_displaced_target_that_is_carried_over_a_quadrant_keeps_its_confdata() -> None:
    """One taught point serves both sides: at p axis 1 is carried over zero, beside it axis 1 stays where it is."""
    rows = "FOR i FROM 0 TO 2 DO\nMoveL Offs(p,10*i,-100,0),v50,fine,tT;\nMoveL Offs(p,-10*i,0,0),v50,fine,tT;\nENDFOR"
    text = module(f"CONST robtarget p:={target(1350, 50)};", f"MoveJ Offs(p,0,-100,0),v200,fine,tT;\n{rows}")
    found = convert(text)
    assert [o.status for o in found.outcomes] == ["compensated"] * 3
    text_after = written(found)
    assert {e.target.robconf for e in events(text_after)} == {(-1, 0, -1, 0)}
    assert "p.trans" not in text_after and len(re.findall(r"MoveL Offs\(p,-?10\*i", text_after)) == 2
    accurate(text, found)


def test_without_the_function_of_the_controller_all_but_the_position_stays_the_programmers() -> None:
    """The program's own `Offs` hides that function: the position is written as a sum, beside it names."""
    own = "  FUNC num Offs(num x)\n    RETURN x;\n  ENDFUNC\n"
    data = f"CONST robtarget a:={target(1350, 50)};\nVAR robtarget q;"
    found = convert(module(data, f"MoveJ {target(1350, -50)},v200,fine,tT;\nq:=a;\nMoveL q,v50,fine,tT;", own))
    assert re.search(r"MoveL \[\[q\.trans\.x[-+].*\],q\.rot,q\.robconf,q\.extax\],v50", written(found))


def test_a_zone_of_the_users_own_is_not_taken_for_the_predefined_one() -> None:
    """Where the program declares another `z1`, added targets get a zone that is small for certain."""
    text = module(
        f"CONST zonedata z1:=[FALSE,150,225,225,23,225,35];\nCONST robtarget far:={target(1350, -20)};",
        f"MoveJ {A},v200,fine,tT;\nMoveL far,v50,fine,tT;",
    )
    found = convert(text)
    added = [e for e in events(written(found))[1:-1]]
    assert added
    for event in added:
        assert not event.zone.finep and event.zone.pzone_tcp <= 1.0
    accurate(text, found)


def test_work_object_targets_are_written_in_the_work_object() -> None:
    a, b = ([f"{v:g}" for v in place] for place in ((350, -200, 200), (350, -80, 200)))
    rest = ",".join(A.split("],")[1:2]) + "],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    text = module(
        f"CONST robtarget p1:=[[{','.join(a)}],{rest};\nCONST robtarget p2:=[[{','.join(b)}],{rest};",
        "MoveJ p1,v200,fine,tT\\WObj:=wT;\nMoveL p2,v50,fine,tT\\WObj:=wT;",
    )
    found = convert(text)
    shift = np.subtract(places(written(found)), places(text))
    assert 0.5 < np.linalg.norm(shift, axis=1).max() < 5
    accurate(text, found)


GO = "  PROC go(robtarget p)\n    MoveL p,v50,fine,tT;\n  ENDPROC\n"
THREE = f"CONST robtarget p1:={A};\nCONST robtarget p2:={B};"


def routine_of(text: str, name: str) -> list[str]:
    lines = lines_of(text)
    first = next(i for i, line in enumerate(lines) if line.startswith(f"PROC {name}("))
    return lines[first : lines.index("ENDPROC", first)]


def test_targets_handed_to_a_routine_are_edited_where_they_are_declared() -> None:
    text = module(THREE, f"MoveJ {C},v200,fine,tT;\ngo p1;\ngo p2;", GO)
    found = convert(text)
    assert [(o.status, o.edited) for o in found.outcomes] == [
        ("compensated", "aggregate"),
        ("compensated", "declaration"),
    ]
    assert body_of(written(found))[1:] == ["go p1;", "go p2;"]
    assert routine_of(written(found), "go") == routine_of(text, "go")
    accurate(text, found)


def test_targets_that_stand_in_the_call_are_edited_there() -> None:
    text = module("", f"MoveJ {C},v200,fine,tT;\ngo {A};\ngo {B};", GO)
    found = convert(text)
    assert outcome(found, 1).edited == "call" and found.report["statements"][1]["edited"] == "call"
    assert routine_of(written(found), "go") == routine_of(text, "go")
    assert [NUMBERS.sub("#", x) for x in body_of(written(found))] == [NUMBERS.sub("#", x) for x in body_of(text)]
    assert follows_the_path(text, found)


def test_a_call_displaces_a_target_that_others_need_otherwise() -> None:
    text = module(THREE, f"MoveJ p1,v200,fine,tLong;\nMoveJ {C},v200,fine,tT;\ngo p1;\ngo Offs(p1,0,0,30);\ngo p2;", GO)
    found = convert(text)
    assert f"CONST robtarget p1:={A};" in lines_of(written(found))
    calls = body_of(written(found))[2:]
    number = r"-?\d\.\d+"
    assert re.fullmatch(rf"go Offs\(p1,{number},{number},{number}\);", calls[0])
    assert re.fullmatch(rf"go Offs\(p1,{number},{number},30\.\d+\);", calls[1]) and calls[2] == "go p2;"
    assert routine_of(written(found), "go") == routine_of(text, "go")
    assert follows_the_path(text, found)


def follows_the_path(text: str, found: Conversion) -> bool:
    """As ``accurate``; the arguments of calls may change too."""
    report = independent(text, found)
    others = [
        v for v in report.violations if not re.search(r"(line \d+: not in the output any more|moves nor): 'go", v)
    ]
    assert [v for v in others if "neither a move nor a target: 'go" not in v] == []
    return report.after <= 0.01 and report.goal_after <= 0.003


def test_what_a_routine_derives_from_its_parameter_follows_it() -> None:
    more = (
        "  PROC go(robtarget p)\n    MoveL Offs(p,0,0,60),v200,z5,tT;\n    MoveL p,v50,fine,tT;\n"
        "    MoveL RelTool(p,0,0,-60),v200,z5,tT;\n  ENDPROC\n"
    )
    text = module(THREE, f"MoveJ {C},v200,fine,tT;\ngo p1;\ngo p2;", more)
    found = convert(text)
    above, at, behind = (line.split(",v")[0] for line in routine_of(written(found), "go")[1:])
    assert at == "MoveL p"
    number = r"-?\d+\.\d+"
    assert re.fullmatch(rf"MoveL Offs\(p,{number},{number},60\.0\d+\)", above), above
    assert re.fullmatch(rf"MoveL RelTool\(p,{number},{number},-(59\.9|60\.0)\d+\)", behind), behind
    assert [o.edited for o in found.outcomes[1:]] == ["argument", "declaration", "argument"]
    report = independent(text, found)
    assert report.violations == []
    assert [s.goal_after <= 0.003 for s in report.segments if s.line == outcome(found, 2).statement.line] == [
        True,
        True,
    ]
    assert report.goal_after < 0.01 < report.before


def test_a_target_handed_on_and_on() -> None:
    more = "  PROC outer(robtarget a)\n    MoveJ Offs(a,0,0,50),v200,z5,tT;\n    go a;\n  ENDPROC\n" + GO
    text = module(THREE, f"MoveJ {C},v200,fine,tT;\nouter p1;\nouter {B};", more)
    found = convert(text)
    assert [o.edited for o in found.outcomes] == ["aggregate", "argument", "declaration"]
    assert routine_of(written(found), "go") == routine_of(text, "go")
    assert re.fullmatch(r"MoveJ Offs\(a(,-?\d\.\d+){2},50\.0\d+\),v200,z5,tT;", routine_of(written(found), "outer")[1])
    assert routine_of(written(found), "outer")[2:] == ["go a;"]
    assert body_of(written(found))[1] == "outer p1;"
    assert body_of(written(found))[2] != f"outer {B};"


@pytest.mark.parametrize("mode", ["VAR ", "INOUT ", "\\"])
def test_other_kinds_of_parameters(mode: str) -> None:
    """By reference and optional ones too lead to the declarations."""
    lead = "\\p:=" if mode == "\\" else ""
    data = THREE.replace("CONST", "VAR")
    text = module(
        data, f"MoveJ {C},v200,fine,tT;\ngo {lead}p1;\ngo {lead}p2;", GO.replace("robtarget p", f"{mode}robtarget p")
    )
    found = convert(text)
    assert [o.edited for o in found.outcomes] == ["aggregate", "declaration"]
    assert body_of(written(found))[1:] == [f"go {lead}p1;", f"go {lead}p2;"]


@pytest.mark.parametrize(
    "inside",
    [
        "MoveL p,v50,fine,tT;\n    height:=p.trans.z;",
        "MoveL p,v50,fine,tT;\n    p.trans.z:=p.trans.z+50;\n    MoveL p,v50,fine,tT;",
        'MoveL p,v50,fine,tT;\n    %"other"% p;',
    ],
)
def test_a_parameter_that_serves_for_more_is_displaced_where_it_is_used(inside: str) -> None:
    """One statement runs with two targets handed over, which the routine does not use for moves alone."""
    text = module(
        THREE + "\nVAR num height;", f"MoveJ {C},v200,fine,tT;\ngo p1;\ngo p2;",
        f"  PROC go(robtarget p)\n    {inside}\n  ENDPROC\n",
    )  # fmt: skip
    found = convert(text)
    assert outcome(found, 1).edited == "argument"
    lines, plain = lines_of(written(found))[-8:], lines_of(text)[-8:]
    changed = [(new, old) for new, old in zip(lines, plain, strict=True) if new != old]
    assert changed and all(new.startswith("MoveL Offs(p,") and old.startswith("MoveL p,") for new, old in changed)
    assert found.report["max_error_before_mm"] > 1.0 and found.report["max_error_after_mm"] < 0.3


def test_a_routine_that_others_call_with_other_targets_keeps_its_parameter() -> None:
    """Nobody calls `service`: what it hands to `go` counts where all that runs is followed; `go` keeps its parameter."""
    more = GO.replace("MoveL p,", "height:=p.trans.z;\n    MoveL p,") + f"  PROC service()\n    go {C};\n  ENDPROC\n"
    text = module(THREE + "\nVAR num height;", f"MoveJ {C},v200,fine,tT;\ngo p1;", more)
    chosen = convert(text, entry="main")
    assert routine_of(written(chosen), "go") == routine_of(text, "go")
    assert routine_of(written(chosen), "service") == routine_of(text, "service")
    assert "not followed" in (outcome(chosen, 1).reason or "")
    both = convert(text)
    assert outcome(both, 1).status == "compensated" and "MoveL Offs(p," in written(both)
    assert both.report["max_error_before_mm"] > 1.0 and both.report["max_error_after_mm"] < 0.2
    alone = module(
        THREE + "\nVAR num height;", f"MoveJ {C},v200,fine,tT;\ngo p1;", more[: more.index("  PROC service")]
    )
    assert outcome(convert(alone), 1).edited == "argument"


@pytest.mark.parametrize("condition", ["IF on", "IF on ! if it is", "IF (on)", "IF on AND TRUE"])
def test_an_if_whose_statement_stands_on_the_next_line(condition: str) -> None:
    """A target between the condition and its statement would take the statement's place."""
    text = module(
        f"VAR bool on:=TRUE;\nCONST robtarget far:={target(1350, -20)};",
        f"MoveJ {A},v200,fine,tT;\n{condition}\nMoveL far,v50,fine,tT;",
    )
    found = convert(text)
    assert body_of(written(found))[-2:] == [condition, "MoveL far,v50,fine,tT;"]
    assert found.report["added_targets"] == 0


def test_blanks_between_a_sign_and_its_digits() -> None:
    there = target(1300, -500).replace("-500", "- 500").replace("1300", "--1300").replace("-0.015738", "-\n  0.015738")
    found = convert(module("", f"MoveJ {there},v200,fine,tT;\nMoveL {target(1350, -300)},v50,fine,tT;"))
    plain = convert(module("", f"MoveJ {target(1300, -500)},v200,fine,tT;\nMoveL {target(1350, -300)},v50,fine,tT;"))
    assert places(written(found)) == places(written(plain))


TUNED = f"""  CONST robtarget first:={target(1250, -600)};
  CONST robtarget last:={target(1250, -20)};
  PERS num side:=2;
  PERS pos by:=[0,1,0.5];
  PERS num turned:=1;
"""


@pytest.mark.parametrize(
    ("displaced", "name"),
    [
        ("Offs(last,0,side,0)", "side"),
        ("Offs(last,by.x,by.y,by.z+1)", "by"),
        ("Offs(RelTool(last,0,0,-3\\Rz:=2),0,side,0)", "side"),
        ("RelTool(Offs(last,0,side,0),0,0,-3)", "side"),
        ("RelTool(last,0,turned,-3\\Rx:=2)", "turned"),
    ],
)
def test_what_an_operator_sets_goes_on_to_displace(displaced: str, name: str) -> None:
    """Numbers in its place would take the PERS data's effect away; targets that are added move along."""
    moves = f"MoveJ {C},v200,fine,tT;\nMoveL {displaced.replace('last', 'first')},v50,fine,tT;\nMoveL {displaced},v50,fine,tT;"
    found = convert(module(TUNED, moves))
    text = written(found)
    assert independent(module(TUNED, moves), found).violations == []
    assert found.report["added_targets"] > 0

    def reset(of: str) -> str:
        return (
            of.replace("side:=2;", "side:=9;")
            .replace("by:=[0,1,0.5];", "by:=[3,-4,5];")
            .replace("turned:=1;", "turned:=4;")
        )

    before, after = (events(of)[1:] for of in (text, reset(text)))
    plain = [events(of)[-1].target for of in (module(TUNED, moves), reset(module(TUNED, moves)))]
    wanted = np.subtract(plain[1].trans, plain[0].trans)
    moved = np.array([np.subtract(b.target.trans, a.target.trans) for a, b in zip(before, after, strict=True)])
    shares = moved @ wanted / (wanted @ wanted)  # on the way to the first target the displacement grows
    assert moved == pytest.approx(np.outer(shares, wanted), abs=0.01)
    begun = 1 + next(i for i, share in enumerate(shares) if share > 0.999)
    assert (np.diff(shares[:begun]) > 0.1).all() and shares[begun:] == pytest.approx(1.0, abs=0.002)
