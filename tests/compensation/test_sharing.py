"""One text for several: a routine on displaced work, targets inside records."""

from __future__ import annotations

import re

import numpy as np
import pytest

from postproc.compensation.text.insertions import ELSEWHERE
from postproc.compensation.text.laws import fit_affine
from tests.compensation.build import convert, events, independent, lines_of, module, target, written

A, B, C, D = target(1300, -500), target(1330, -470), target(1350, -430), target(1350, -330)
SEAM = """  PROC seam()
    MoveJ Offs(a,0,0,60),v300,z5,tT;
    ArcLStart a,v100,sm,wd,fine,tT;
    ArcC b,c,v100,sm,wd,z1,tT;
    ArcLEnd d,v100,sm,wd,fine,tT;
  ENDPROC
"""


@pytest.mark.parametrize("shift", ["[[-30,40,10],[1,0,0,0]]", "[[-40,20,10],[0.9986295,0,0,0.0523360]]"])
def test_a_routine_on_displaced_work_shares_what_goes_with_the_displacement(shift: str) -> None:
    data = "".join(f"CONST robtarget {n}:={p};\n" for n, p in zip("abcd", (A, B, C, D), strict=True))
    text = module(data, f"ConfL\\Off;\nseam;\nPDispSet {shift};\nseam;\nPDispOff;", SEAM)
    found = convert(text)
    assert {o.status for o in found.outcomes} == {"compensated"}
    assert {o.reason for o in found.outcomes} == {None}
    assert found.report["max_error_before_mm"] > 1.0
    # The middle of two corrections alone would stay a tenth of a millimetre off.
    assert found.report["max_error_after_mm"] <= 0.01
    assert "*C_PROGDISP.pdisp.trans." in written(found)
    again = independent(text, found)
    assert again.violations == []
    assert again.before == pytest.approx(found.report["max_error_before_mm"], abs=0.002)
    assert again.after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


LAYERS = """MoveJ Offs(a,0,0,60),v300,fine,tT;
FOR i FROM 1 TO 3 DO
  MoveL Offs(a,0,0,i*4),v100,fine,tT;
  MoveC Offs(b,0,0,i*4),Offs(c,0,0,i*4),v100,fine,tT;
  MoveL Offs(c,0,0,60),v100,fine,tT;
  MoveL Offs(a,0,0,60),v100,fine,tT;
ENDFOR"""
RINGS = """  PROC ring(robtarget m,num r)
    MoveL Offs(m,r,0,30),v100,fine,tT;
    MoveL Offs(m,r,0,0),v100,fine,tT;
    MoveC Offs(m,r*0.7071068,r*0.7071068,0),Offs(m,0,r,0),v100,fine,tT;
    MoveL Offs(m,0,r,30),v100,fine,tT;
  ENDPROC
"""


@pytest.mark.parametrize(
    ("body", "most"),
    [(LAYERS, 0.05), (f"MoveJ {A},v300,fine,tT;\nring {B},25;\nring {target(1290, -420, 690)},18;", 0.1)],
)
def test_arcs_at_another_place_in_each_run_are_displaced_whole(body: str, most: float) -> None:
    """Goal and circle point of every run move together: layers of an arc, a ring at other places and of other sizes."""
    data = "".join(f"CONST robtarget {n}:={p};\n" for n, p in zip("abc", (A, B, C), strict=True))
    text = module(data, body, RINGS if "ring" in body else "")
    found = convert(text)
    assert {o.status for o in found.outcomes} == {"compensated"}
    assert found.report["max_error_before_mm"] > 1.0
    assert found.report["max_error_after_mm"] < most
    again = independent(text, found)
    assert again.violations == []
    assert again.before == pytest.approx(found.report["max_error_before_mm"], abs=0.002)
    assert again.after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


SPOTS = f"""RECORD spot
robtarget at;
num force;
ENDRECORD
CONST spot row{{3}}:=[[{A},12],[{C},14],[{D},16]];
CONST spot last:=[{target(1300, -330)},9];"""
RUN = "FOR i FROM 1 TO 3 DO\nMoveL row{i}.at,v100,fine,tT;\nSetAO aoForce,row{i}.force;\nENDFOR\nvisit last;"
VISIT = "  PROC visit(spot s)\n    MoveL s.at,v100,fine,tT;\n    SetAO aoForce,s.force;\n  ENDPROC\n"


def test_targets_in_records_are_corrected_where_they_stand() -> None:
    text = module(SPOTS, f"MoveJ {B},v300,fine,tT;\n{RUN}", VISIT)
    found = convert(text)
    assert {o.status for o in found.outcomes} == {"compensated"}
    assert {o.edited for o in found.outcomes[1:]} == {"element"}
    assert "MoveL row{i}.at,v100,fine,tT;" in lines_of(written(found))
    assert found.report["max_error_before_mm"] > 1.0 and found.report["max_error_after_mm"] <= 0.01
    plain = [e.target for e in events(text)]
    corrected = [e.target for e in events(written(found)) if not e.zone.pzone_tcp]
    assert len(plain) == len(corrected) == 5 and all(a != b for a, b in zip(plain, corrected, strict=True))


@pytest.mark.parametrize(
    "statement", ["pHere:=row{2}.at;", "TPWrite NumToStr(row{2}.at.trans.x,1);", "copy row{2};", "all:=row;"]
)
def test_targets_in_records_that_serve_otherwise_too_keep_their_numbers(statement: str) -> None:
    data = SPOTS + "\nVAR robtarget pHere;\nVAR spot all{3};\nVAR spot one;"
    copy = "  PROC copy(spot s)\n    one:=s;\n  ENDPROC\n"
    text = module(data, f"{statement}\nMoveJ {B},v300,fine,tT;\nMoveL row{{2}}.at,v100,fine,tT;", copy)
    found = convert(text)
    assert [o.edited for o in found.outcomes] == ["aggregate", "argument"]
    assert SPOTS.splitlines()[4] in lines_of(written(found))


def test_what_is_derived_follows_in_all_of_its_runs_or_in_none() -> None:
    """`Offs(q,..)` of a routine: in one run q is a declaration that serves elsewhere too, in the other a derived place."""
    more = "  PROC over(robtarget q)\n    MoveL Offs(q,0,-20,30),v100,fine,tT;\n  ENDPROC\n"
    text = module(
        f"CONST robtarget a:={A};",
        f"MoveJ a,v300,fine,tT;\nover a;\nover Offs({B},0,0,10);\nMoveL a,v100,fine,tT;",
        more,
    )
    found = convert(text)
    assert {o.status for o in found.outcomes} == {"compensated"}
    assert found.report["max_error_before_mm"] > 1.0
    assert found.report["max_error_after_mm"] <= 0.01
    assert re.search(
        r"MoveL Offs\(q,.*\*q\.trans\.y,-19\.\d+\+.*\*q\.trans\.y,29\.\d+-.*\*q\.trans\.y\),", written(found)
    )
    assert independent(text, found).after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


@pytest.mark.parametrize(
    ("body", "expected", "most"),
    [
        ("FOR nStep FROM 0 TO 8 DO\nMoveL Offs(a,0,nStep*25,0),v50,z1,tT;\nENDFOR", r"\*nStep", 0.01),
        ("FOR i FROM 0 TO 3 DO\nFOR j FROM 0 TO 2 DO\nMoveL RelTool(a,i*30,j*40,-i),v50,fine,tT;\nENDFOR\nENDFOR", r"\*i[-+].*\*j", 0.02),
        ("n:=0;\nWHILE n<120 DO\nMoveL Offs(a,0,n,0),v50,fine,tT;\nn:=n+40;\nENDWHILE", r"\*n", 0.01),
        ("n:=3;\nFOR i FROM 1 TO 2 DO\nMoveL Offs(a,0,n*i,0),v50,fine,tT;\nENDFOR", r"^MoveL Offs\(a,0,n\*i,0\),", 0.01),
    ],
)  # fmt: skip
def test_displacements_go_straight_with_the_numbers_that_a_statement_names(
    body: str, expected: str, most: float
) -> None:
    """Over 200 mm the correction changes by tenths of a millimetre: its middle alone would not do."""
    text = module(f"VAR num n;\nCONST robtarget a:={A};\nCONST robtarget b:={B};", f"MoveJ b,v300,fine,tT;\n{body}")
    found = convert(text)
    (line,) = [line for line in lines_of(written(found)) if re.match(r"MoveL (Offs|RelTool)", line)]
    assert re.search(expected, line), line
    assert found.report["max_error_before_mm"] > 1.0 and found.report["max_error_after_mm"] < most
    again = independent(text, found)
    assert again.violations == []
    assert again.after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


def test_a_straight_displacement_is_the_plane_through_what_the_runs_ask_for() -> None:
    numbers = [{"i": i, "j": j, "same": 7.0, "idle": i * j} for i in (1.0, 2.0, 4.0) for j in (0.0, 10.0)]
    asked = np.array([(0.1 + 0.5 * n["i"], -0.02 * n["j"], 3.0 + 0.001 * n["i"]) for n in numbers])
    way = fit_affine(numbers, asked, 0.01)
    assert [name for name, _ in way.coefficients] == ["i", "j"]
    assert [way.at(n) for n in numbers] == [pytest.approx(row, abs=1e-9) for row in asked]
    assert fit_affine(numbers[:2], asked[:2], 1.0).coefficients == ()


def test_a_coordinate_that_is_a_rounded_multiple_of_an_index_is_not_told_from_it() -> None:
    """It goes with the index but for its rounding; weighed against each other they would tell chance, hugely."""
    numbers = [{"k": k, "p.trans.y": y} for k, y in ((1.0, -73.17), (2.0, -12.2), (3.0, 48.78))]
    asked = np.array([(0.1, -0.2, 0.0), (0.4, -0.1, 0.1), (0.2, 0.0, 0.1)])
    way = fit_affine(numbers, asked, 0.001)
    touched_up = [{**n, "p.trans.y": n["p.trans.y"] + 1.0} for n in numbers]
    moved = [np.subtract(way.at(b), way.at(a)) for a, b in zip(numbers, touched_up, strict=True)]
    assert np.abs(moved).max() < 0.01
    assert fit_affine(numbers[:2], asked[:2], 1.0).constant == pytest.approx(asked[:2].mean(axis=0))


def test_numbers_that_go_nearly_together_are_not_set_against_each_other() -> None:
    """By both of them every run would get what it asks for, and a hair beside them far more."""
    jitter = np.array([1.0, -1.0, 0.0, 0.0, -1.0, 1.0])
    numbers = [{"i": float(i), "j": float(i + 0.2 * d)} for i, d in enumerate(jitter)]
    asked = np.outer(0.1 * np.arange(6.0) + 0.05 * jitter, [1.0, 0.0, 0.0])
    ((name, slope),) = fit_affine(numbers, asked, 0.001).coefficients
    assert name == "j" and slope == pytest.approx((0.1, 0.0, 0.0), abs=0.01)


HOP = """  PROC hop(robtarget m,num up)
    MoveL RelTool(Offs(m,0,0,up),0,5,0),v100,fine,tT;
    MoveL m,v100,fine,tT;
    MoveL Offs(m,0,0,up),v100,fine,tT;
  ENDPROC
"""
WELD = """  PROC weld(robtarget m)
    q:=m;
    q.trans:=0.5*m.trans;
    MoveL m,v100,fine,tT;
  ENDPROC
"""
JIG = """  PROC part()
    MoveL Offs(a,0,0,40),v100,fine,tT\\WObj:=wJ;
    MoveL a,v100,fine,tT\\WObj:=wJ;
  ENDPROC
"""


@pytest.mark.parametrize(
    ("body", "more", "expected", "least"),
    [
        # Copies of a target: their own coordinates tell where they are.
        (
            "FOR i FROM 0 TO 2 DO\nFOR j FROM 0 TO 2 DO\nq:=a;\nq.trans.y:=a.trans.y+i*70;\nq.trans.z:=a.trans.z-j*50;\n"
            "there;\nENDFOR\nENDFOR",
            "  PROC there()\n    MoveL q,v100,fine,tT;\n  ENDPROC\n", r"MoveL Offs\(q,.*\*q\.trans\.[xyz]", 0.1,
        ),
        # Approaches that follow a parameter, from heights of their own.
        ("hop a,60;\nhop c,120;\nhop d,30;\nhop e,90;", HOP, r"MoveL m,v100[^O]*MoveL Offs\(m,[-\d.]+[-+][\d.]+\*up,[-\d.]+[-+][\d.]+\*up,up[-+][\d.]+\*up\)", 0.03),
        # A parameter as it is, where what it was handed is read elsewhere, too, and stays.
        ("weld a;\nweld c;\nweld d;\nweld e;", WELD, r"MoveL Offs\(m,.*\*m\.trans\.[xyz]", 0.1),
        # One routine in a work object that the program moves.
        (
            "FOR k FROM 0 TO 2 DO\nwJ.oframe.trans.y:=k*80;\npart;\nENDFOR",
            JIG, r"MoveL Offs\(a,.*\*wJ\.oframe\.trans\.y", 0.1,
        ),
    ],
)  # fmt: skip
def test_runs_at_several_places_share_what_goes_with_the_place(
    body: str, more: str, expected: str, least: float
) -> None:
    """Over 100 mm corrections change by more than ``least`` [mm], which any one displacement would leave."""
    data = 'VAR robtarget q;\nPERS wobjdata wJ:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
    data += "".join(f"CONST robtarget {n}:={p};\n" for n, p in zip("acde", (A, C, D, target(1330, -400)), strict=True))
    text = module(data, f"ConfL\\Off;\nMoveJ {B},v300,fine,tT;\n{body}", more)
    found = convert(text)
    assert re.search(expected, written(found)), written(found)
    assert {o.status for o in found.outcomes} == {"compensated"}
    assert found.report["max_error_before_mm"] > 1.0
    assert found.report["max_error_after_mm"] < min(0.02, least / 4)
    again = independent(text, found)
    assert again.violations == []
    assert again.after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


BETWEEN = """  FUNC robtarget between(robtarget a,robtarget b,num share)
    a.trans:=a.trans+share*(b.trans-a.trans);
    RETURN a;
  ENDFUNC
"""


def test_targets_that_a_function_makes_of_two_are_displaced_not_expected_to_follow_one_of_them() -> None:
    data = f"CONST robtarget a:={A};\nCONST robtarget d:={D};"
    loop = "MoveJ a,v300,fine,tT;\nFOR i FROM 1 TO 3 DO\nMoveL between(a,d,i/4),v100,fine,tT;\nENDFOR\nMoveL d,v100,fine,tT;"
    found = convert(module(data, loop, BETWEEN))
    assert "MoveL Offs(between(a,d,i/4)," in written(found)
    assert found.report["max_error_before_mm"] > 1.0 and found.report["max_error_after_mm"] < 0.01


LIFTED = """  FUNC robtarget lifted(robtarget p)
    VAR robtarget found;
    found:=p;
    found.trans.z:=found.trans.z+60;
    RETURN found;
  ENDFUNC
"""
VISITS = "  PROC visit(spot s)\n    MoveJ lifted(s.at),v300,z5,tT;\n    MoveL s.at,v100,fine,tT;\n    MoveL lifted(s.at),v100,fine,tT;\n  ENDPROC\n"


@pytest.mark.parametrize("call", ["lifted(s.at)", "RelTool(lifted(s.at),0,0,-5)"])
def test_what_a_function_displaces_follows_its_target(call: str) -> None:
    """As `Offs` does: the target in the record is corrected where it stands, whoever derives another from it."""
    text = module(SPOTS, "visit last;\nvisit row{1};\nvisit row{3};", VISITS.replace("lifted(s.at)", call) + LIFTED)
    found = convert(text)
    # One text changes: that of the plain target beside two that a function makes, the amounts of `RelTool` beside it.
    plain = "MoveL Offs(s.at,0" if call == "lifted(s.at)" else "MoveL s.at,v100"
    assert plain in written(found)
    for move in "MoveJ", "MoveL":
        assert (f"{move} {call}," in written(found)) is (call == "lifted(s.at)")
    assert found.report["max_error_before_mm"] > 1.0 and found.report["max_error_after_mm"] < 0.015


def test_what_a_function_mirrors_does_not_follow() -> None:
    mirrored = LIFTED.replace("found.trans.z:=found.trans.z+60", "found.trans.y:=-700-found.trans.y")
    text = module(SPOTS, "visit row{1};\nvisit row{3};", VISITS + mirrored)
    found = convert(text)
    assert "MoveL s.at,v100,fine,tT;" not in lines_of(written(found))


def test_a_statement_that_followed_and_then_has_a_text_of_its_own_is_written_once() -> None:
    data = f"""CONST robtarget a:={A};\nCONST robtarget d:={D};
PERS loaddata part:=[8,[5,0,60],[1,0,0,0],0,0,0];
CONST jointtarget jH:=[[0,-20,20,0,60,0],[9E9,9E9,9E9,9E9,9E9,9E9]];"""
    fetch = """  PROC fetch()
    MoveJ Offs(a,0,0,80),v500,z20,tT;
    MoveL a,v100,fine,tT;
    GripLoad part;
    MoveL Offs(a,0,0,80),v200,z20,tT;
    MoveL Offs(d,0,0,80),v200,z20,tT;
    MoveL d,v100,fine,tT;
    GripLoad load0;
    MoveL Offs(d,0,0,80),v500,z20,tT;
  ENDPROC
"""
    text = module(data, "MoveAbsJ jH,v500,fine,tT;\nfetch;\nfetch;\nMoveAbsJ jH,v500,fine,tT;", fetch)
    found = convert(text, inertia=True)
    assert found.report["max_error_before_mm"] > 1.0 and found.report["max_error_after_mm"] < 0.02


PATHS = f"CONST robtarget left{{3}}:=[{A},{B},{D}];\nCONST robtarget right{{3}}:=[{target(1250, -500)},{target(1260, -420)},{target(1250, -330)}];"
ALONG = """  PROC along(robtarget pts{*},speeddata v,num by)
    VAR num at;
    at:=2-by;
    WHILE at>0 AND at<4 DO
      MoveL pts{at},v,z1,tT;
      at:=at+by;
    ENDWHILE
  ENDPROC
"""


def test_the_targets_of_an_array_that_a_routine_gets_are_edited_where_they_stand() -> None:
    """It runs at two speeds and both ways: every target gets the middle of what its runs ask for."""
    body = f"MoveJ {target(1300, -540)},v300,fine,tT;\nalong left,v50,1;\nalong right,v400,1;\nalong right,v60,-1;"
    found = convert(module(PATHS, body, ALONG), inertia=True)
    assert [o.edited for o in found.outcomes] == ["aggregate", "element"]
    assert "MoveL pts{at},v,z1,tT;" in lines_of(written(found))
    assert found.report["max_error_before_mm"] > 1.0 and found.report["max_error_after_mm"] < 0.03


def test_targets_that_some_runs_of_a_statement_displace_are_not_edited_too() -> None:
    """`right` serves otherwise and keeps its numbers, so the routine's statement displaces: `left` as it is then."""
    body = f"MoveJ {target(1300, -540)},v300,fine,tT;\nalong left,v50,1;\nalong right,v60,-1;"
    found = convert(module(PATHS, body + "\nTPWrite NumToStr(right{2}.trans.x,1);", ALONG))
    assert set(PATHS.splitlines()) <= {line.strip() for line in lines_of(written(found))}
    assert "MoveL Offs(pts{at}," in written(found)
    assert found.report["max_error_before_mm"] > 1.0 and found.report["max_error_after_mm"] <= 0.01


def test_a_target_that_serves_with_and_without_the_arc_ends_the_search_for_what_its_runs_share() -> None:
    """Runs of one statement part together: one at a time, each gave the others a reason to try once more."""
    record = "RECORD seamrec\nrobtarget pStart;\nrobtarget pEnd;\nENDRECORD"
    data = f"PERS seamrec r1:=[{A},{C}];\nPERS seamrec r2:=[{target(1300, -390)},{target(1380, -385)}];"
    part = """  PROC part(seamrec r)
    MoveJ Offs(r.pStart,0,0,60),v400,z10,tT;
    FOR i FROM 1 TO 1 DO
      ArcLStart r.pStart,v100,sm,wd,fine,tT;
      ArcLEnd r.pEnd,v100,sm,wd,fine,tT;
      MoveL Offs(r.pStart,0,0,60),v200,z5,tT;
    ENDFOR
  ENDPROC
"""
    text = module(data, "part r1;\npart r2;\nMoveL r1.pEnd,v20,fine,tT;", part)
    found = convert(text.replace("MODULE M\n", f"MODULE M\n{record}\n"), force_on="arc")
    assert found.exit_code == 0
    assert found.report["max_error_after_mm"] < found.report["max_error_before_mm"]


SEAM_AND_BOW = """  PROC long()
    MoveJ Offs(p,0,0,60),v500,fine,tT\\WObj:=wT;
    ArcLStart p,v100,sm,wd,fine,tT\\WObj:=wT;
    ArcL q,v100,sm,wd,fine,tT\\WObj:=wT;
    ArcCEnd r,s,v100,sm,wd,fine,tT\\WObj:=wT;
  ENDPROC
"""


def test_layers_share_the_targets_that_are_added() -> None:
    places = {"p": (50, -900, 500), "q": (50, 200, 500), "r": (150, 100, 500), "s": (120, 0, 500)}
    data = "".join(f"CONST robtarget {name}:={target(*place)};\n" for name, place in places.items())
    layer = SEAM_AND_BOW.split("ENDPROC")[0].split("\n", 1)[1]
    for name in "pqrs":
        layer = re.sub(rf"\b{name},", f"Offs({name},0,0,i*4),", layer)
    text = module(data, f"FOR i FROM 0 TO 3 DO\n{layer}ENDFOR")
    found = convert(text)
    assert found.report["max_error_before_mm"] > 0.9
    assert found.report["max_error_after_mm"] <= 0.01  # 0.28 mm where nothing can be added
    again = independent(text, found)
    assert again.violations == []
    assert again.after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


def test_runs_on_displaced_work_share_the_targets_that_are_added() -> None:
    places = {"p": (50, -900, 500), "q": (50, 200, 500), "r": (150, 100, 500), "s": (120, 0, 500)}
    data = "".join(f"CONST robtarget {name}:={target(*place)};\n" for name, place in places.items())
    runs = "".join(f"PDispSet [[{x},0,{-x / 3:g}],[1,0,0,0]];\nlong;\n" for x in (0, 60, 90))
    text = module(data, f"{runs}PDispOff;", SEAM_AND_BOW)
    found = convert(text, tolerance_m=1e-4, air_tolerance_m=1e-4)
    assert found.report["added_targets"] == 1
    assert found.report["max_error_after_mm"] < 0.1 < 1.0 < found.report["max_error_before_mm"]  # else 0.28 mm
    again = independent(text, found)
    assert again.violations == []
    assert again.after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


SEAMS = [((50, -900, 500), (90, 200, 500)), ((150, -800, 520), (150, 150, 500)), ((20, -500, 500), (80, 100, 510))]


@pytest.mark.parametrize("body", ["FOR i FROM 1 TO 3 DO\nweld pS{i},pE{i};\nENDFOR", "loop;"])
def test_seams_of_unlike_lengths_share_targets(body: str) -> None:
    """What a line lacks grows with the square of its length, and so does the displacement of an added target."""
    starts, ends = (",".join(target(*seam[k]) for seam in SEAMS) for k in (0, 1))
    data = f"CONST robtarget pS{{3}}:=[{starts}];\nCONST robtarget pE{{3}}:=[{ends}];"
    weld = """    MoveJ Offs(@S,0,0,60),v500,fine,tT\\WObj:=wT;
    ArcLStart @S,v100,sm,wd,fine,tT\\WObj:=wT;
    ArcLEnd @E,v100,sm,wd,fine,tT\\WObj:=wT; ! the whole seam
"""
    of_array = weld.replace("@S", "pS{i}").replace("@E", "pE{i}")
    loop = f"  PROC loop()\nFOR i FROM 1 TO 3 DO\n{of_array}ENDFOR\n  ENDPROC\n"
    handed = f"  PROC weld(robtarget S,robtarget E)\n{weld.replace('@', '')}  ENDPROC\n"
    text = module(data, body, loop if body == "loop;" else handed)
    found = convert(text)
    after = found.report["max_error_after_mm"]
    assert found.report["max_error_before_mm"] > 0.7
    assert found.report["added_targets"] > 0 and re.search(r"ArcL ppLinePoint\(.*\\length:=\d+\)", written(found))
    assert after == pytest.approx(0.008, abs=0.002)  # 0.29 without added targets
    again = independent(text, found)
    assert again.violations == []
    assert again.after == pytest.approx(after, abs=0.002)


def test_runs_from_several_places_share_no_added_targets() -> None:
    """The way to the seam begins elsewhere in the first run: what divides it there is on no other way."""
    places = {"p": (50, -900, 500), "q": (50, 200, 500)}
    data = "".join(f"CONST robtarget {name}:={target(*place)};\n" for name, place in places.items())
    body = f"MoveJ {target(1300, -500, 900)},v500,fine,tT;\nlong;\nPDispSet [[60,0,-20],[1,0,0,0]];\nlong;\nPDispOff;"
    long = "  PROC long()\n    MoveL p,v500,fine,tT\\WObj:=wT;\n    MoveL q,v500,fine,tT\\WObj:=wT;\n  ENDPROC\n"
    found = convert(module(data, body, long), tolerance_m=1e-4, air_tolerance_m=1e-4)
    texts = [s for s in lines_of(written(found)) if s.startswith("MoveL")]
    assert len(texts) > 2 and "fine,tT" in texts[0]  # the way to `p` gets none, the way to `q` does
    told = [d for d in found.diagnostics if d.code == "CMP006"]
    assert [d.help for d in told] == [f"no target was added: {ELSEWHERE}"]
    again = independent(module(data, body, long), found)
    assert again.violations == []
    assert again.after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


def test_a_circle_point_leaves_the_array_that_it_names_to_the_others() -> None:
    """An arc wants its circle point elsewhere than the lines want the same element as a target."""
    places = [(1250, -450), (1330, -380, 720), (1300, -200)]
    data = f"CONST robtarget pa{{3}}:=[{','.join(target(*place) for place in places)}];"
    loop = "FOR i FROM 1 TO 3 DO\nMoveL pa{i},v100,fine,tT;\nENDFOR\n"
    text = module(data, loop + "MoveL pa{3},v100,fine,tT;\nMoveC pa{2},pa{1},v100,fine,tT;")
    found = convert(text)
    assert [o.edited for o in found.outcomes] == ["element", "element", "element"]
    assert found.report["max_error_after_mm"] <= 0.01
    assert re.search(
        r"MoveC ppArcPoint\(pa\{3\},pa\{2\},pa\{1\},0\.\d+(,[-\d.]+){3}\),pa\{1\},", "".join(lines_of(written(found)))
    )
    assert independent(text, found).after <= 0.01


def test_numbers_that_cancel_each_other_are_not_used() -> None:
    """Four runs and four numbers: a plane through all of them, by which a target taught 10 mm higher went 1.5 mm off."""
    places = np.array([(20.0, 10, 0), (240, 40, 0), (320, 180, 10), (60, 220, 5)])
    numbers = [{"i": k + 1.0, "p.trans.x": x, "p.trans.y": y, "p.trans.z": z} for k, (x, y, z) in enumerate(places)]
    noise = [(0.004, -0.003, 0), (-0.003, 0.006, 0.002), (0, -0.004, 0.003), (0.002, 0, -0.004)]
    gradient = np.array([(0.0004, 0.0018, 0.001), (0, 0, 0), (0, 0.003, -0.0005)])
    way = fit_affine(numbers, (0.27, 0.65, 0.5) + places @ gradient + noise, 0.005)
    for axis in "xyz":
        taught = [{**n, f"p.trans.{axis}": n[f"p.trans.{axis}"] + 10.0} for n in numbers]
        moved = [np.subtract(way.at(b), way.at(a)) for a, b in zip(numbers, taught, strict=True)]
        assert np.abs(moved).max() < 0.05


SEAT = target(1150, -300)


def test_equal_numbers_of_different_elements_are_different_targets() -> None:
    """Every fixture has the same nominal point in a frame of its own: what is derived from it follows its element."""
    frames = ",".join(
        f'[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[{40 * k},{150 * k},{10 * k}],[1,0,0,0]]]' for k in range(3)
    )
    ends = [target(1150, -240 + 5 * k) for k in range(3)]
    data = (
        f"PERS wobjdata wq{{3}}:=[{frames}];\nCONST robtarget ps{{3,2}}:=[{','.join(f'[{SEAT},{e}]' for e in ends)}];"
    )
    body = (
        "FOR i FROM 1 TO 3 DO\nMoveJ Offs(ps{i,1},0,0,50),v500,fine,tT\\WObj:=wq{i};\n"
        "MoveL ps{i,1},v100,fine,tT\\WObj:=wq{i};\nMoveL ps{i,2},v100,fine,tT\\WObj:=wq{i};\nENDFOR"
    )
    found = convert(module(data, body))
    assert [o.edited for o in found.outcomes[1:]] == ["element", "element"]
    assert re.search(r"MoveJ Offs\(ps\{i,1\},[-\d.]+([-+][\d.]+\*i)?,", written(found))
    assert "MoveL ps{i,1},v100,fine,tT\\WObj:=wq{i};" in lines_of(written(found))
    assert found.report["max_error_after_mm"] <= 0.01


def test_elements_of_which_some_serve_plainly_are_edited_all_where_a_loop_displaces_all_of_them() -> None:
    """The loop could not follow those that are edited and be right for those that are not."""
    places = [(1150, -400), (1330, -370), (1390, -230, 710), (1190, -190, 705), (1290, -330, 720)]
    data = f"CONST robtarget pa{{5}}:=[{','.join(target(*place) for place in places)}];"
    body = "FOR i FROM 1 TO 5 DO\nMoveL RelTool(pa{i},0,0,-50),v100,fine,tT;\nENDFOR\nMoveL pa{1},v100,fine,tT;\nMoveL pa{2},v100,fine,tT;"
    text = module(data, body)
    found = convert(text)
    assert not any(target(*place) in written(found) for place in places)
    assert "MoveL pa{1},v100,fine,tT;" in lines_of(written(found))
    goals = [o.residual_mm for o in found.outcomes]
    assert max(goals) < 0.005, goals
    assert independent(text, found).after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


CORNERS = [(50, -900, 500), (450, -880, 500), (430, -200, 510), (60, -180, 500)]


@pytest.mark.parametrize(("loop", "at"), [("FROM 2 TO 4", "-1"), ("FROM 3 TO 1", "+1")])
def test_lines_along_an_array_in_unlike_directions_share_no_targets(loop: str, at: str) -> None:
    """The correction bends differently in each of them; what that leaves is told."""
    data = f"CONST robtarget pth{{4}}:=[{','.join(target(*place) for place in CORNERS)}];"
    first = "pth{1}" if at == "-1" else "pth{4}"
    body = f"MoveJ {first},v300,fine,tT\\WObj:=wT;\nFOR i {loop} DO\nMoveL pth{{i}},v100,z1,tT\\WObj:=wT;\nENDFOR"
    found = convert(module(data, body))
    assert found.report["max_error_before_mm"] > 1.0
    after = found.report["max_error_after_mm"]
    assert after == pytest.approx(0.111, abs=0.005) and found.report["added_targets"] == 0
    again = independent(module(data, body), found)
    assert again.violations == []
    assert again.after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


def test_elements_that_calls_choose_by_another_array_are_edited_where_they_stand() -> None:
    data = f"CONST robtarget pT{{3}}:=[{A},{B},{C}];\nCONST num seq{{3}}:=[3,1,2];"
    body = "FOR k FROM 1 TO 3 DO\ntack pT{seq{k}};\nENDFOR\nFOR k FROM 1 TO 3 DO\nMoveL pT{k},v100,fine,tT;\nENDFOR"
    tack = "  PROC tack(robtarget p)\n    MoveJ p,v100,fine,tT;\n    MoveL RelTool(p,10,0,0),v100,fine,tT;\n  ENDPROC\n"
    found = convert(module(data, body, tack))
    assert found.outcomes[0].edited == "element"
    assert "MoveL pT{k},v100" in written(found) and "tack pT{seq{k}};" in written(found)
    assert found.report["max_error_after_mm"] <= 0.01


def test_elements_that_serve_otherwise_too_are_displaced_from_run_to_run() -> None:
    """What the program measures between them is as it was; the middle of the runs alone stays 0.1 mm off."""
    data = f"CONST robtarget pT{{3}}:=[{A},{B},{C}];\nVAR num d;"
    body = "d:=Distance(pT{1}.trans,pT{3}.trans);\nFOR k FROM 1 TO 3 DO\nMoveL pT{k},v100,fine,tT;\nENDFOR"
    text = module(data, body)
    found = convert(text)
    assert A in written(found)
    assert re.search(r"MoveL Offs\(pT\{k\},.*\*", written(found))
    assert found.report["max_error_after_mm"] <= 0.01
    assert independent(text, found).after == pytest.approx(found.report["max_error_after_mm"], abs=0.002)


def test_seams_between_variables_back_and_forth_share_no_targets() -> None:
    """Back and forth between places that a loop computes: one offset cannot serve both ways."""
    data = f"CONST robtarget a:={target(50, -900, 500)};\nCONST robtarget b:={target(90, 100, 500)};\nVAR robtarget s;\nVAR robtarget e;"
    body = """FOR i FROM 1 TO 4 DO
    IF i MOD 2=1 THEN s:=Offs(a,0,0,8*i); e:=Offs(b,0,0,8*i); ELSE e:=Offs(a,0,0,8*i); s:=Offs(b,0,0,8*i); ENDIF
    MoveJ Offs(s,0,0,60),v500,fine,tT\\WObj:=wT;
    ArcLStart s,v100,sm,wd,fine,tT\\WObj:=wT;
    ArcLEnd e,v100,sm,wd,fine,tT\\WObj:=wT;
    MoveL Offs(e,0,0,60),v500,fine,tT\\WObj:=wT;
    ENDFOR"""
    text = module(data, body)
    found = convert(text)
    after = found.report["max_error_after_mm"]
    assert after == pytest.approx(0.243, abs=0.01)
    again = independent(text, found)
    assert again.violations == []
    assert again.after == pytest.approx(after, abs=0.002)
