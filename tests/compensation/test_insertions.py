"""Targets that are added: how many, where, and with which data."""

from __future__ import annotations

import math
import re
from itertools import pairwise

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.text.insertions import added_instruction
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import RobTarget
from tests.compensation.build import (
    AXES,
    body_of,
    codes,
    convert,
    events,
    independent,
    module,
    outcome,
    target,
    written,
)

SEAM = "v100,sm,wd\\Weave:=wv,{zone},tT\\Track:=tr"


@pytest.fixture(scope="module")
def seam() -> tuple[str, Conversion]:
    """A straight seam of 440 mm after an approach of 500 mm that is not welded."""
    text = module(
        "",
        f"MoveJ {target(1150, -500, 960)},v200,fine,tT;\n"
        f"ArcLStart {target(1350, -480)},{SEAM.format(zone='fine')};\n"
        f"ArcL {target(1350, -250)},{SEAM.format(zone='z1')};\n"
        f"ArcLEnd {target(1350, -40)},{SEAM.format(zone='fine')};\n"
        f"MoveL {target(1050, -40, 900)},v200,fine,tT;",
    )
    return text, convert(text, tolerance_m=4e-6)


def goal(event: MotionEvent) -> np.ndarray:
    assert isinstance(event.target, RobTarget)
    return np.array(event.target.trans)


def added(text: str, conversion: Conversion) -> list[tuple[int, MotionEvent]]:
    """Added executions with the index of the original one they stand before, by the nearest goals in order."""
    original, out = events(text), events(written(conversion))
    found, k = [], 0
    for event in out:
        if k < len(original) and math.dist(goal(event), goal(original[k])) < 6.0:
            k += 1
        else:
            found.append((k, event))
    assert k == len(original)
    return found


def test_added_statements_of_a_seam_keep_its_data(seam: tuple[str, Conversion]) -> None:
    text, found = seam
    extra = added(text, found)
    assert len(extra) == found.report["added_targets"]
    names = {k: {e.statement.instruction for i, e in extra if i == k} for k, _ in extra}
    assert names.pop(1) == {"MoveL"}  # the arc is lit at the seam's first target only
    assert names.pop(4) == {"MoveL"}
    assert names and set().union(*names.values()) == {"ArcL"}
    for _, event in extra:
        texts = {a.role: a.text for a in event.statement.arguments}
        if event.statement.instruction == "ArcL":
            assert (texts["speed"], texts["seam"], texts["weld"]) == ("v100", "sm", "wd")
            assert (texts["\\weave"], texts["\\track"], texts["tool"]) == ("wv", "tr", "tT")
        else:
            assert not {"seam", "weld", "\\weave", "\\track"} & texts.keys()
            assert texts["tool"] == "tT"


def test_added_targets_never_stop(seam: tuple[str, Conversion]) -> None:
    for _, event in added(*seam):
        assert not event.zone.finep
        assert event.zone.pzone_tcp <= 1.0


def test_the_seam_is_within_tolerance_with_few_targets(seam: tuple[str, Conversion]) -> None:
    text, found = seam
    report = independent(text, found)
    assert report.violations == []
    assert report.after <= 0.004
    assert report.worst_seam_per_metre <= 15
    assert found.report["max_error_after_mm"] == pytest.approx(report.after, abs=3e-4)


@pytest.mark.parametrize("tolerance", [2e-6, 1e-5, 1e-4])
def test_a_finer_tolerance_needs_more_targets_in_proportion_to_its_root(tolerance: float) -> None:
    """Deviation from a chord goes with its length squared (h = kappa l^2 / 8): twice as near, 1.4 times as many."""
    text = module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {target(1350, -20)},v50,fine,tT;")
    found = convert(text, tolerance_m=tolerance)
    chords = 1 + found.report["added_targets"]
    # 41 micrometres is the deviation of this seam's correction from a single chord.
    assert chords == pytest.approx(math.sqrt(41e-6 / (0.8 * tolerance)), abs=1.01)
    assert independent(text, found).after <= 1e3 * tolerance


def test_joint_moves_get_no_targets() -> None:
    text = module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveJ {target(1350, -20)},v200,fine,tT;")
    found = convert(text)
    assert found.report["added_targets"] == 0
    assert [outcome(found, i).status for i in (0, 1)] == ["compensated"] * 2
    assert independent(text, found).goal_after < 0.002


def test_an_arc_stays_an_arc_and_is_split_within_the_limits_of_movec() -> None:
    """Half a circle of 200 mm radius, tolerance 2 micrometres: the corrected curve is no circle any more."""
    text = module(
        "",
        f"MoveJ {target(1150, -500)},v200,fine,tT;\n"
        f"ArcLStart {target(1150, -480)},{SEAM.format(zone='fine')};\n"
        f"ArcC {target(1350, -280)},{target(1150, -80)},{SEAM.format(zone='z1')};\n"
        f"ArcLEnd {target(1050, -80)},{SEAM.format(zone='fine')};",
    )
    found = convert(text, tolerance_m=2e-6)
    arcs = [e for e in events(written(found)) if e.statement.instruction == "ArcC"]
    assert len(arcs) > 1
    here = next(goal(e) for e in events(written(found)) if e.statement.instruction == "ArcLStart")
    for event in arcs:
        assert event.via is not None
        u, v = np.subtract(event.via.trans, here), goal(event) - here
        assert min(np.linalg.norm(u), np.linalg.norm(v)) > 0.1
        assert math.degrees(math.acos(u @ v / np.linalg.norm(u) / np.linalg.norm(v))) > 1.0
        assert {a.role: a.text for a in event.statement.arguments}["\\weave"] == "wv"
        here = goal(event)
    report = independent(text, found)
    assert report.violations == []
    assert report.after <= 0.002 + 0.0006  # three decimals of a millimetre in the text


def test_an_arc_that_needs_no_split_keeps_its_statement() -> None:
    text = module(
        "",
        f"MoveJ {target(1150, -300)},v200,fine,tT;\nMoveC {target(1160, -290)},{target(1150, -280)},v50,fine,tT;",
    )
    found = convert(text, tolerance_m=5e-5)
    assert found.report["added_targets"] == 0
    assert len(body_of(written(found))) == 2
    report = independent(text, found)
    assert report.violations == [] and report.after <= 0.05


def test_a_circle_of_two_halves() -> None:
    text = module(
        "",
        f"MoveJ {target(1150, -400)},v200,fine,tT;\nMoveC {target(1250, -300)},{target(1150, -200)},v50,z1,tT;\n"
        f"MoveC {target(1050, -300)},{target(1150, -400)},v50,fine,tT;",
    )
    found = convert(text)
    report = independent(text, found)
    assert report.violations == [] and report.after <= 0.01 and report.goal_after <= 0.002


def test_before_a_line_with_something_in_front_of_the_statement() -> None:
    """A label or THEN on the same line: what is added goes between it and the statement."""
    text = module(
        "VAR bool go:=TRUE;",
        f"MoveJ {target(1350, -500)},v200,fine,tT;\nIF go THEN MoveL {target(1350, -20)},v50,fine,tT; ENDIF",
    )
    found = convert(text)
    assert found.report["added_targets"] > 0
    assert independent(text, found).violations == []
    steps = body_of(written(found))
    assert steps[1].startswith("IF go THEN MoveL [[") and steps[-1].endswith("ENDIF")


def test_indentation_follows_the_statement() -> None:
    text = module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {target(1350, -20)},v50,fine,tT;")
    text = text.replace("    MoveL", "\t  MoveL")
    moves = [line for line in written(convert(text)).splitlines() if "MoveL" in line]
    assert len(moves) > 1
    assert all(line.startswith("\t  MoveL") for line in moves)


def test_names_of_added_instructions() -> None:
    names = {
        "MoveL": "MoveL",
        "MoveC": "MoveC",
        "MoveLDO": "MoveL",
        "MoveLSync": "MoveL",
        "TriggL": None,
        "TriggC": None,
        "ArcLStart": "MoveL",
        "ArcL": "ArcL",
        "ArcLEnd": "ArcL",
        "ArcC": "ArcC",
        "ArcCEnd": "ArcC",
        "ArcCStart": "MoveC",
        "ArcL2End": "ArcL2",
        "MoveJ": None,
        "SearchL": None,
        "MoveAbsJ": None,
    }
    assert {name: added_instruction(name) for name in names} == names


def test_longer_seams_need_proportionally_many() -> None:
    """The added targets of half of a line are about half of those of the whole: no constant waste."""
    counts = []
    for y in (-260, -20):
        text = module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {target(1350, y)},v50,fine,tT;")
        counts.append(1 + convert(text, tolerance_m=2e-6).report["added_targets"])
    for a, b in pairwise(counts):
        assert b == pytest.approx(2 * a, abs=2)


@pytest.mark.parametrize(
    ("statement", "option"),
    [
        ("MoveL {far},v50\\T:=12,fine,tT;", "`\\T`"),
        ("MoveL\\Conc,{far},v50,fine,tT;", "`\\Conc`"),
        ("MoveL {far}\\ID:=3,v50,fine,tT;", "`\\ID`"),
        ("MoveL {far},v50,fine,tT\\Corr;", "`\\Corr`"),
        ("ArcL {far},v50,sm,wd,fine,tT\\T1:=gun\\T2:=gun;", "`\\T1`"),
        ("ArcLStart {far},v50,sm,wd,fine,tT\\T7:=gun;", "`\\T7`"),
        ("ArcLEnd {far},v50,sm,wd,fine,tT\\FeedForward;", "`\\FeedForward`"),
        ("MoveL {far},v50\\V:=40,fine\\Inpos:=inpos50,tT\\WObj:=wobj0\\TLoad:=load0;", ""),
        ("ArcL {far},v50,sm,wd\\Weave:=wv,fine,tT\\Track:=tr;", ""),
        ('ArcLStart {far},v50,sm,wd\\Weave:=wv,fine,tT\\SeamName:="a";', ""),
    ],
)
def test_a_line_is_divided_where_its_options_mean_the_same_on_each_part(statement: str, option: str) -> None:
    """Triggers fire on each of its parts, a time would hold for each of them."""
    body = f"MoveJ {target(1350, -500)},v200,fine,tT;\n{statement.format(far=target(1350, -20))}"
    found = convert(module("VAR triggdata gun;", body), tolerance_m=5e-6)
    assert (found.report["added_targets"] > 0) == (option == "")
    reasons = "".join(d.help for d in found.diagnostics if d.code == "CMP006")
    assert option in reasons and ("would act on each" in reasons) == (option != "")


def test_the_parts_of_a_line_carry_what_means_the_same_on_each() -> None:
    option = "\\V:=40,z50\\Inpos:=inpos50,tT\\WObj:=wobj0\\TLoad:=load0"
    text = module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {target(1350, -20)},v50{option};")
    first = body_of(written(convert(text, tolerance_m=5e-6)))[1]
    assert first.endswith("v50\\V:=40,z1,tT\\WObj:=wobj0\\TLoad:=load0;")


TRYNEXT = "ERROR\nTRYNEXT;"
STEP = f"  PROC step(){{0}}\nMoveJ {target(1250, -480)},v200,fine,tT;\nMoveL {target(1250, -100)},v100,fine,tT;\n{{1}}  ENDPROC\n"


@pytest.mark.parametrize(
    ("handler", "other", "added"),
    [
        ("", "", True),
        (TRYNEXT, "", True),  # an error without a handler leaves its routine: the caller goes on behind the call
        (TRYNEXT, "ERROR\nRETRY;\n", True),
        (TRYNEXT, "ERROR\nRAISE;\n", True),
        ("", "ERROR\nTRYNEXT;\n", False),
        ("ERROR\nRETRY;", "", True),
    ],
)
def test_nothing_is_divided_where_an_error_may_go_on_behind_a_part(handler: str, other: str, added: bool) -> None:
    """`TRYNEXT` would go on in the middle of the line."""
    begin = f"MoveJ {target(1250, -500)},v200,fine,tT;\n"
    text = module("", f"{begin}step;\n{handler}", STEP.format("", other))
    found = convert(text)
    assert (found.report["added_targets"] > 0) == added


@pytest.mark.parametrize(
    ("data", "hidden"), [("VAR num sin;", "Sin"), ("PERS num aTan2:=1;", "ATan2"), ("VAR num magnitude;", "")]
)
def test_what_the_added_function_calls_is_looked_up_where_it_stands(data: str, hidden: str) -> None:
    places = f"CONST robtarget a:={target(1350, -500)};\nCONST robtarget b:={target(1350, -20)};\n"
    found = convert(module(places + data, "MoveJ a,v200,fine,tT;\nMoveL b,v50,fine,tT;"), tolerance_m=5e-6)
    reasons = "".join(d.help for d in found.diagnostics if d.code == "CMP006")
    assert (found.report["added_targets"] > 0) == (hidden == "") and f"`{hidden}`" * (hidden != "") in reasons
    numbers = convert(module(data, f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {target(1350, -20)},v50,fine,tT;"))
    assert numbers.report["added_targets"] > 0  # these call nothing


@pytest.mark.parametrize("zone", ["z1", "z20", "z50", "z80", "z150"])
def test_added_targets_leave_the_zones_of_their_neighbours_alone(zone: str) -> None:
    """The controller halves a zone to the nearest target: one that is added too near would move the whole corner."""
    text = module(
        "",
        f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {target(1350, -20)},v50,{zone},tT;\n"
        f"MoveL {target(1100, -20)},v50,fine,tT;",
    )
    found = convert(text, tolerance_m=5e-6)
    assert added(text, found)
    report = independent(text, found, blend=True)
    assert report.violations == []
    assert report.cut_after <= 0.05
    assert body_of(written(found))[-1].endswith("v50,fine,tT;")


def test_a_move_that_is_all_zone_gets_nothing() -> None:
    text = module(
        "",
        f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {target(1350, -300)},v50,z200,tT;\n"
        f"MoveL {target(1350, -100)},v50,z200,tT;\nMoveL {target(1100, -100)},v50,fine,tT;",
    )
    found = convert(text, tolerance_m=1e-6)
    assert all(k != 2 for k, _ in added(text, found))


ELSEWHERE = {
    "IF with ELSE": "IF DOutput(do1)=1 THEN\nMoveL {b},v50,fine,tT;\nELSE\nMoveL {c},v50,fine,tT;\nENDIF\nMoveL {far},v50,fine,tT;",
    "IF": "IF DOutput(do1)=1 THEN\nMoveL {c},v50,fine,tT;\nENDIF\nMoveL {far},v50,fine,tT;",
    "IF on one line": "IF DOutput(do1)=1 MoveL {c},v50,fine,tT;\nMoveL {far},v50,fine,tT;",
    "WHILE": "WHILE DOutput(do1)=1 DO\nMoveL {c},v50,fine,tT;\nENDWHILE\nMoveL {far},v50,fine,tT;",
    "the body of WHILE": "WHILE DOutput(do1)=1 DO\nMoveL {far},v50,fine,tT;\nMoveJ {c},v50,fine,tT;\nENDWHILE",
    "TEST": "TEST GInput(g)\nCASE 1:\nMoveL {c},v50,fine,tT;\nCASE 2:\nMoveL {b},v50,fine,tT;\nENDTEST\nMoveL {far},v50,fine,tT;",
    "GOTO back": "again:\nMoveL {far},v50,fine,tT;\nMoveJ {c},v50,fine,tT;\nGOTO again;",
    "GOTO over": "IF DOutput(do1)=1 GOTO skip;\nMoveL {c},v50,fine,tT;\nskip:\nMoveL {far},v50,fine,tT;",
    "a call by name": '%"other"%;\nMoveL {far},v50,fine,tT;',
}


@pytest.mark.parametrize("way", ELSEWHERE)
def test_nothing_is_added_where_the_arm_may_come_from_elsewhere(way: str) -> None:
    """Targets on the line from one place would lead the arm astray that comes from the other."""
    b, c, far = target(1350, -380), target(1270, -380, 760), target(1350, -20)
    text = module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\n" + ELSEWHERE[way].format(b=b, c=c, far=far))
    found = convert(text)
    assert found.plan is not None
    ends = {i.statement.line for i in found.plan.insertions}
    assert not ends & {o.statement.line for o in found.outcomes if f"{far}" in o.statement.argument("to").text}  # type: ignore[union-attr]
    assert found.outcomes[-1].status == "compensated"


BETWEEN = {
    "SetDO do1,1;": True,
    'WaitTime 1;\n! a comment\nTPWrite "on";': True,
    "VelSet 50,500;\nConfL\\Off;\nGripLoad load0;": True,
    "n:=n+1;": False,
    'TPReadNum n,"how many";': False,
    "n:=Beside();": False,
    "PDispSet [[0,0,1],[1,0,0,0]];": False,
    "again:": False,
    "StorePath;\nRestoPath;": False,
    "StopMove;\nStartMove;": False,
    "rNothing;": False,
    "IF di1=1 SetDO do1,1;": False,
    "IF n=1 THEN": True,
    "TEST n\nCASE 1:": True,
    "IF Beside()=1 THEN": False,
    "WHILE n=1 DO": False,
}


@pytest.mark.parametrize("between", BETWEEN)
def test_a_line_is_divided_directly_behind_the_motion_before(between: str) -> None:
    """Between them may stand what neither moves, nor jumps, nor writes: then the arm always comes from there."""
    opened = next((w for w in ("IF", "TEST", "WHILE") if between.startswith(w) and not between.endswith(";")), None)
    end = f"\nEND{opened}" if opened else ""
    body = f"MoveJ {target(1350, -500)},v200,fine,tT;\n{between}\nMoveL {target(1350, -20)},v50,fine,tT;{end}"
    more = "  FUNC num Beside()\n    n:=n+1;\n    RETURN n;\n  ENDFUNC\n  PROC rNothing()\n    WaitTime 1;\n  ENDPROC\n"
    found = convert(module("PERS num n:=1;", body, more))
    assert (found.report["added_targets"] > 0) == BETWEEN[between], codes(found)


@pytest.mark.parametrize(
    ("trap", "added"),
    [("n:=n+1;", True), ("MoveL {c},v50,fine,tT;", False), ("rMenu;", False), ("a.trans.z:=a.trans.z+9;", False),
     ("b.trans.z:=b.trans.z+9;", True), ("PDispSet [[0,0,9],[1,0,0,0]];", False)],
)  # fmt: skip
def test_nothing_is_added_where_a_trap_may_change_where_the_line_begins(trap: str, added: bool) -> None:
    data = f"PERS num n:=1;\nVAR intnum it;\nPERS robtarget a:={target(1350, -500)};\nPERS robtarget b:={target(1350, -20)};"
    more = f"  TRAP tr\n    {trap.format(c=target(1300, -300))}\n  ENDTRAP\n"
    found = convert(module(data, "CONNECT it WITH tr;\nMoveJ a,v200,fine,tT;\nMoveL b,v50,fine,tT;", more))
    assert (found.report["added_targets"] > 0) == added, codes(found)


def test_nothing_is_added_before_a_statement_that_runs_elsewhere_too() -> None:
    """`service` runs the same line to another place: targets added on this one would stand in its way."""
    begin = f"MoveJ {target(1350, -500)},v200,fine,tT;"
    go = f"  PROC go(robtarget p)\n    {begin}\n    MoveL p,v50,fine,tT;\n  ENDPROC\n  PROC service()\n{{call}}  ENDPROC\n"
    text = module("", f"{begin}\ngo {target(1350, -20)};", go)
    assert convert(text.replace("{call}", ""), tolerance_m=4e-6).report["added_targets"] > 0
    found = convert(text.replace("{call}", f"    go {target(1300, -60)};\n"), tolerance_m=4e-6)
    assert found.report["added_targets"] == 0 and outcome(found, 2).edited == "call"


def test_added_targets_take_the_small_zone_alone() -> None:
    zone = "z50\\Z:=80\\Inpos:=inpos50"
    body = f"ArcLStart {target(1350, -500)},v100,sm,wd,fine,tT;\nArcL {target(1350, -20)},v100,sm,wd,{zone},tT;\n"
    text = module("", f"{body}ArcLEnd {target(1350, -20, 800)},v100,sm,wd,fine,tT;")
    steps = [s for s in body_of(written(convert(text, tolerance_m=4e-6))) if s.startswith("ArcL ")]
    *added, own = [("\\Z:=80" in step, "\\Inpos" in step) for step in steps]
    assert added and set(added) == {(False, False)} and own == (True, True)


def test_the_old_form_of_the_arc_statements() -> None:
    """`\\On` and `\\Off` light the arc and put it out at that statement's own target, not at an added one."""
    data = "v100,sm,wd,wv"
    text = module(
        "",
        f"MoveJ {target(1150, -500, 960)},v200,fine,tT;\nArcL\\On,{target(1350, -480)},{data},fine,tT;\n"
        f"ArcL {target(1350, -380)},{data},z1,tT;\nArcL\\Off,{target(1350, -20)},{data},fine,tT;",
    )
    found = convert(text, tolerance_m=5e-6)
    steps = body_of(written(found))
    lit, out = (next(i for i, s in enumerate(steps) if s.startswith(f"ArcL\\{word}")) for word in ("On", "Off"))
    assert found.report["added_targets"] >= 3
    assert {s.split()[0] for s in steps[1:lit]} == {"MoveL"}
    assert {s.split()[0] for s in steps[lit + 1 : out]} == {"ArcL"}
    assert out == len(steps) - 1


def test_added_targets_have_the_external_axes_of_their_place_on_the_way() -> None:
    """A table that carries nothing of this turns from 10 to 130 degrees during the seam, evenly along it."""
    first, last = (
        target(1350, y).replace(AXES, f"[{axis},9E9,9E9,9E9,9E9,9E9]") for y, axis in ((-700, "10"), (-20, "130"))
    )
    text = module("", f"MoveJ {first},v200,fine,tT;\nMoveL {last},v20,fine,tT;")
    assert "MOT008" in codes(convert(text))
    found = convert(text, free_axes="a")
    assert found.report["max_error_after_mm"] <= 0.01 and found.report["added_targets"] >= 2
    lines = re.findall(r"MoveL \[\[[-\d.]+,([-\d.]+),.*?\],\[([-\d.]+),9E9", written(found))
    y, axis = np.array(lines, dtype=float).T
    np.testing.assert_allclose(axis, 10 + 120 * (y - y[-1] + 680) / 680, atol=0.3)  # corrected places: 2 mm in 680
    assert axis[-1] == 130


HOME = f"""  PROC home()
    MoveL {target(1250, -500)},v100,fine,tT;
    MoveL {target(1250, -100)},v100,fine,tT;
  ENDPROC
"""
AGAIN = f"  PROC home()\n    MoveL {target(1250, -100)},v100,fine,tT;\n  ENDPROC\n"
BEGINS = {
    "payload": ("", f"IF di1=1 GripLoad part;\nMoveL {target(1400, -400)},v100,fine,tT;\nhome;", ""),
    "handler": ("", "ERROR\nhome;\nRAISE;", ""),
    "trap": ("", "", "  TRAP tr\n    home;\n  ENDTRAP\n"),
    "service": ("", "", f"  PROC serve()\n    MoveL {target(1400, -400)},v100,fine,tT;\n    home;\n  ENDPROC\n"),
    "chosen": ("VAR string s;", f"s:=ask();\nMoveL {target(1400, -400)},v100,fine,tT;\n%s%;", ""),
}


@pytest.mark.parametrize("case", BEGINS)
def test_nothing_is_added_to_the_way_of_a_statement_that_also_begins_elsewhere(case: str) -> None:
    """The targets of one way would send the arm, on the other, to that first: hundreds of millimetres off its line."""
    data, body, more = BEGINS[case]
    load = "PERS loaddata part:=[9,[0,0,120],[1,0,0,0],0,0,0];\n" + data
    start = f"MoveJ {target(1250, -500, 760)},v200,fine,tT;\nMoveL {target(1250, -500)},v100,fine,tT;\nhome;\n"
    ask = '  FUNC string ask()\n    IF di1=1 RETURN "home";\n    RETURN "";\n  ENDFUNC\n'
    found = convert(module(load, start + body, AGAIN + ask + more))
    text = written(found)
    home = text[text.index("PROC home") : text.index("ENDPROC", text.index("PROC home"))]
    assert home.count("MoveL") == 1


@pytest.mark.parametrize(("handler", "added"), [
    ("RETRY;", True), ("{move}\nRETRY;", False), ("{move}\nTRYNEXT;", False), ("StorePath;\n{move}\nRestoPath;\nRETRY;", False),
])  # fmt: skip
def test_nothing_is_added_where_a_handler_moves_and_the_routine_goes_on(handler: str, added: bool) -> None:
    away = f"MoveL {target(1400, -400)},v100,fine,tT;"
    way = f"MoveJ {target(1250, -500)},v200,fine,tT;\nWaitDI di1,1;\nMoveL {target(1250, -100)},v100,fine,tT;\n"
    found = convert(module("", f"{way}ERROR\n{handler.format(move=away)}"))
    assert (found.report["added_targets"] > 0) == added


@pytest.mark.parametrize(("frame", "added"), [("wA", True), ("wB", False)])
def test_nothing_is_added_between_work_objects_of_equal_values(frame: str, added: bool) -> None:
    """They may be calibrated apart: the line would begin where the arm does not stand."""
    frames = "".join(f'PERS wobjdata w{k}:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[9,0,0],[1,0,0,0]]];\n' for k in "AB")
    data = f"{frames}CONST robtarget a:={target(1350, -500)};\nCONST robtarget b:={target(1350, -20)};"
    text = module(data, f"MoveJ a,v200,fine,tT\\WObj:=wA;\nMoveL b,v50,fine,tT\\WObj:={frame};")
    assert (convert(text).report["added_targets"] > 0) == added


@pytest.mark.parametrize("more", ["", "  PROC serve()\n    home;\n  ENDPROC\n"])
def test_targets_are_added_where_a_routine_goes_one_way_however_it_is_started(more: str) -> None:
    """Its second line begins at the target of its first, whoever calls it."""
    found = convert(module("", f"MoveJ {target(1250, -500, 760)},v200,fine,tT;\nhome;", HOME + more))
    text = written(found)
    home = text[text.index("PROC home") : text.index("ENDPROC", text.index("PROC home"))]
    assert home.count("MoveL") > 2


@pytest.mark.parametrize(("end", "left"), [("", 2), ("SoftDeact;", 1)])
def test_what_moves_with_a_soft_servo_is_left_and_told(end: str, left: int) -> None:
    """A soft axis gives way by millimetres: a claim of micrometres would be false."""
    moves = [f"MoveL {target(1350, y)},v50,fine,tT;" for y in (-400, -300)]
    text = module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\nSoftAct 3,90;\n{moves[0]}\n{end}\n{moves[1]}")
    found = convert(text, allow_partial=True)
    reasons = [o.reason or "" for o in found.outcomes if o.status == "skipped"]
    assert len(reasons) == left and all("SoftAct" in reason for reason in reasons)


@pytest.mark.parametrize("goal", ["pts{n}", "Offs(pts{n},0,0,30)"])
@pytest.mark.parametrize("loop", ["WHILE TRUE DO", "WHILE DInput(di1)=0 DO", "FOR i FROM 1 TO GInput(gi2) DO"])
def test_equal_targets_in_two_elements_are_two_places(loop: str, goal: str) -> None:
    """Which element the controller chooses is not known; each gets its own correction, and the program is written."""
    pts = f"CONST robtarget pts{{3}}:=[{target(1300, -500)},{target(1350, -450)},{target(1300, -500)}];\nVAR num n;"
    body = f"MoveJ {target(1290, -440, 730)},v200,fine,tT;\n{loop}\nn:=GInput(gi1);\nMoveL {goal},v50,fine,tT;\n"
    body += f"MoveL pts{{n}},v50,fine,tT;\nMoveL {target(1290, -440, 730)},v50,fine,tT;\n{loop.split()[0].replace('WH', 'ENDWH').replace('FOR', 'ENDFOR')}"
    found = convert(module(pts, body))
    assert found.exit_code == 0, codes(found)
    assert [o.status for o in found.outcomes] == ["compensated"] * 4
    if goal == "pts{n}":
        first, other, last = re.findall(r"\[\[[^\]]*\]", written(found).split("pts{3}:=[")[1])[:3]
        assert first == last != other


def test_an_array_that_was_never_taught_is_left() -> None:
    """No element of it has a place: the statement has no event when the program comes to it again."""
    body = f"MoveJ {target(1290, -440, 730)},v200,fine,tT;\nrSub;\nWHILE TRUE DO\nWaitTime 1;\nENDWHILE\nrSub;"
    more = "  PROC rSub()\n    MoveL st{n},v50,fine,tT;\n  ENDPROC\n"
    found = convert(module("VAR robtarget st{3};", body, more))
    assert [o.status for o in found.outcomes] == ["compensated", "skipped"]
