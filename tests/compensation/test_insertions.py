"""Targets that are added: how many, where, and with which data."""

from __future__ import annotations

import math

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.text.insertions import added_instruction
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import RobTarget
from tests.build import (
    body_of,
    convert,
    events,
    independent,
    module,
    target,
    written,
)

SEAM = "v100,sm,wd\\Weave:=wv,{zone},tT\\Track:=tr"


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


@pytest.mark.parametrize("tolerance", [2e-6, 1e-5, 1e-4])
def test_a_finer_tolerance_needs_more_targets_in_proportion_to_its_root(tolerance: float) -> None:
    """Deviation from a chord goes with its length squared (h = kappa l^2 / 8): twice as near, 1.4 times as many."""
    text = module("", f"MoveJ {target(1350, -500)},v200,fine,tT;\nMoveL {target(1350, -20)},v50,fine,tT;")
    found = convert(text, tolerance_m=tolerance)
    chords = 1 + found.report["added_targets"]
    # 41 micrometres is the deviation of this seam's correction from a single chord.
    assert chords == pytest.approx(math.sqrt(41e-6 / (0.8 * tolerance)), abs=1.01)
    assert independent(text, found).after <= 1e3 * tolerance


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
