"""Targets that are added: how many, where, with which data, and what two tolerances leave out."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from postproc.compensation.correction.fewest_targets import Division, error_with_targets
from postproc.compensation.options import TOLERANCE_M
from postproc.compensation.text.insertions import added_instruction
from postproc.compensation.tolerances import goal_tolerances
from postproc.model.file import default_model
from tests.build import arm, body_of, convert, independent, places, written
from tests.compensation.build import PROCESS, brief, findings, small

CHORD = small("MoveJ @{1350,-500},v200,fine,tT; MoveL @{1350,-20},v50,fine,tT;")
HALF_CIRCLE = small(
    f"MoveJ @{{1150,-500}},v200,fine,tT; ArcLStart @{{1150,-480}},{PROCESS},fine,tT;"
    f"ArcC @{{1350,-280}},@{{1150,-80}},{PROCESS}\\Weave:=wv,z1,tT\\Track:=tr; ArcLEnd @{{1050,-80}},{PROCESS},fine,tT;"
)
HARD = {"force": (600.0, -600.0, -600.0), "air_tolerance_m": 2e-4}


def seam(half: float) -> str:
    """One weld of that half length [mm] across the front of the arm, between names."""
    body = f"MoveJ p,v500,fine,tT; ArcLStart p,{PROCESS},fine,tT; ArcLEnd q,{PROCESS},fine,tT;"
    return small(body, f"p 1350 {-half}, q 1350 {half}")


@pytest.mark.parametrize("tolerance", [2e-6, 1e-5, 1e-4])
def test_a_finer_tolerance_needs_more_targets_in_proportion_to_its_root(tolerance: float) -> None:
    """Deviation from a chord goes with its length squared (h = kappa l^2 / 8): twice as near, 1.4 times as many."""
    conversion = convert(CHORD, tolerance_m=tolerance)
    chords = 1 + conversion.report["added_targets"]
    # 41 micrometres is the deviation of this seam's correction from a single chord.
    assert chords == pytest.approx(math.sqrt(41e-6 / (0.8 * tolerance)), abs=1.01)
    assert independent(CHORD, conversion).after <= 1e3 * tolerance


@pytest.mark.parametrize(("start", "expected"), [("@{1350,-450}", [2e-4, 1e-5, 1e-5]), ("p", [2e-4, 1e-5])])
def test_a_goal_has_the_tolerance_of_both_moves_that_meet_there(start: str, expected: list[float]) -> None:
    """A weld that begins nobody knows where meets no move."""
    body = f"MoveJ @{{1350,-500}},v200,fine,tT; ArcLStart {start},{PROCESS},fine,tT; ArcLEnd @{{1350,-400}},{PROCESS},fine,tT;"
    plan = convert(small(body, data="VAR robtarget p;"), air_tolerance_m=2e-4, allow_partial=True).plan
    assert plan is not None
    assert goal_tolerances(plan.motion.moves, plan.motion.options).tolist() == expected


def test_indentation_follows_the_statement() -> None:
    indented = convert(CHORD.replace("    MoveL", "\t  MoveL"))
    moves = [line for line in written(indented).splitlines() if "MoveL" in line]
    assert len(moves) > 1
    assert all(line.startswith("\t  MoveL") for line in moves)


def test_names_of_added_instructions() -> None:
    names = (
        "MoveL MoveC MoveLDO:MoveL MoveLSync:MoveL TriggL: TriggC: MoveJ: SearchL: MoveAbsJ:"
        " ArcLStart:MoveL ArcL ArcLEnd:ArcL ArcC ArcCEnd:ArcC ArcCStart:MoveC ArcL2End:ArcL2"
    )
    for name, colon, added in (pair.partition(":") for pair in names.split()):
        assert added_instruction(name) == ((added or None) if colon else name)


@pytest.mark.parametrize("zone", ["z1", "z20", "z50", "z80", "z150"])
def test_added_targets_leave_the_zones_of_their_neighbours_alone(zone: str) -> None:
    """The controller halves a zone to the nearest target: one that is added too near would move the whole corner."""
    text = small(
        f"MoveJ @{{1350,-500}},v200,fine,tT; MoveL @{{1350,-20}},v50,{zone},tT; MoveL @{{1100,-20}},v50,fine,tT;"
    )
    conversion = convert(text, tolerance_m=5e-6)
    assert len(places(written(conversion))) > 3
    report = independent(text, conversion, blend=True)
    assert report.violations == []
    assert report.cut_after <= 0.05
    assert body_of(written(conversion))[-1].endswith("v50,fine,tT;")


def test_no_target_is_added_for_a_quarter_of_what_is_expected_to_remain() -> None:
    """An arm of estimated stiffness: 12 to 85 % of 5.2 mm remain, 1.9 mm in the middle; the chord is 0.19 mm off."""
    model = default_model("irb2600_12_185")
    loose, strict = (convert(seam(200), model, tolerance_m=near, **HARD) for near in (TOLERANCE_M, 9e-5))
    low, high = loose.report["expected_remaining_fraction"]
    expected = math.sqrt(low * high) * loose.report["max_arc_error_before_mm"]
    off = loose.report["max_arc_error_after_mm"]
    assert loose.report["added_targets"] == 0 and 0.1 < off < 0.25 * expected
    (finding,) = findings(loose, "CMP006")
    advice = re.fullmatch(
        r"an added target would leave ([\d.]+) mm, and ([\d.]+) mm are expected to remain on the arm anyway; a"
        r" `--tolerance` below 0.1 mm adds it all the same",
        finding.help,
    )
    assert advice is not None and f"{off:.3f} mm off, tolerance 0.1 mm" in finding.message
    assert float(advice[2]) == pytest.approx(expected, rel=0.02)
    assert strict.report["added_targets"] == 1 and "ppLinePoint" in written(strict)
    assert strict.report["max_arc_error_after_mm"] == pytest.approx(float(advice[1]), abs=0.006)
    assert findings(strict, "CMP006") == []


@pytest.mark.parametrize(("share", "added", "over"), [(0.03, 2, 0), (1.0, 1, 1)])
def test_of_a_fitted_model_the_error_that_its_fit_knows_counts(share: float, added: int, over: int) -> None:
    """Joint 2 is known to 3 % or to 100 %: the same line gets two targets or one."""
    sigma = share * arm().robot.joint_compliance[1]  # type: ignore[index]
    table = {"parameters": ["joint_compliance.compliance_rad_per_Nm[1]"], "covariance": [[sigma**2]]}
    conversion = convert(seam(450), replace(arm(), fit=table), tolerance_m=TOLERANCE_M, **HARD)
    known = conversion.report["expected_accuracy"]["within_95_percent_mm"]
    assert conversion.plan is not None
    assert 1e3 * conversion.plan.expected_m == pytest.approx(known, rel=1e-3)
    assert (conversion.report["added_targets"], len(findings(conversion, "CMP006"))) == (added, over)


@pytest.mark.parametrize("tolerance_m", [3e-6, 1e-5])
@pytest.mark.parametrize(("text", "name"), [(seam(250), "ArcLEnd"), (HALF_CIRCLE, "ArcC")], ids=brief)
def test_what_targets_would_leave_is_what_they_leave(text: str, name: str, tolerance_m: float) -> None:
    """On a line and on half a circle, against the program that has them, driven by the independent arm."""
    plan = convert(text, tolerance_m=TOLERANCE_M).plan
    assert plan is not None
    moves = plan.motion.moves
    division = Division.of(plan.motion.samples, np.full(len(moves), tolerance_m), plan.motion.steady())
    i = next(i for i, m in enumerate(moves) if m.event.statement.instruction == name)
    count, remaining = error_with_targets(division, i, plan.curve)
    close = convert(text, tolerance_m=tolerance_m)
    assert count > 0 and remaining <= 0.8 * tolerance_m
    key = moves[i].event.statement.key
    assert close.plan is not None and count == sum(a.statement.key == key for a in close.plan.insertions)
    kind = "C" if name == "ArcC" else "L"
    off = max(s.after for s in independent(text, close).segments if s.kind == kind and s.welding)
    assert off == pytest.approx(1e3 * remaining, abs=0.002)
