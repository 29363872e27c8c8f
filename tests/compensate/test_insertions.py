"""Targets that are added: how many, where, and with which data."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from postproc.compensate.insertions import added_instruction
from postproc.convert import Conversion
from postproc.rapid.events import MotionEvent
from postproc.rapid.records import RobTarget
from tests.compensate.build import body_of, convert, events, independent, module, outcome, target, written

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
        "TriggL": "MoveL",
        "TriggC": "MoveC",
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
