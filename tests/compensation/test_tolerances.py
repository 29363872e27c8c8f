"""Two tolerances and the scope: what welds keeps the strict one, ways in the air add nothing below theirs."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from postproc.compensation.correction.fewest_targets import Division, error_with_targets
from postproc.compensation.options import TOLERANCE_M
from postproc.model.file import default_model
from tests.build import arm, convert, independent, module, target, written


def seam(half: float) -> str:
    """One weld of that half length [mm] across the front of the arm, between names."""
    data = "".join(f"CONST robtarget {n}:={target(1350, y)};\n" for n, y in (("p", -half), ("q", half)))
    return module(data, "MoveJ p,v500,fine,tT;\nArcLStart p,v100,sm,wd,fine,tT;\nArcLEnd q,v100,sm,wd,fine,tT;")


HALF_CIRCLE = module(
    "",
    f"""
    MoveJ {target(1150, -480)},v200,fine,tT;
    ArcLStart {target(1150, -480)},v100,sm,wd,fine,tT;
    ArcC {target(1350, -280)},{target(1150, -80)},v100,sm,wd,fine,tT;
    ArcLEnd {target(1050, -80)},v100,sm,wd,fine,tT;
    """,
)
HARD = {"force": (600.0, -600.0, -600.0), "air_tolerance_m": 2e-4}


def test_no_target_is_added_for_a_quarter_of_what_is_expected_to_remain_and_the_finding_says_what_it_would_gain() -> (
    None
):
    """An arm of estimated stiffness: 12 to 85 % of 5.2 mm remain, 1.9 mm in the middle; the chord is 0.19 mm off."""
    model = default_model("irb2600_12_185")
    found, strict = (convert(seam(200), model, tolerance_m=near, **HARD) for near in (TOLERANCE_M, 9e-5))
    low, high = found.report["expected_remaining_fraction"]
    expected = math.sqrt(low * high) * found.report["max_arc_error_before_mm"]
    off = found.report["max_arc_error_after_mm"]
    assert found.report["added_targets"] == 0 and 0.1 < off < 0.25 * expected
    (finding,) = (d for d in found.diagnostics if d.code == "CMP006")
    said = re.fullmatch(
        r"an added target would leave ([\d.]+) mm, and ([\d.]+) mm are expected to remain on the arm anyway; a"
        r" `--tolerance` below 0.1 mm adds it all the same",
        finding.help,
    )
    assert said is not None and f"{off:.3f} mm off, tolerance 0.1 mm" in finding.message
    assert float(said[2]) == pytest.approx(expected, rel=0.02)
    assert strict.report["added_targets"] == 1 and "ppLinePoint" in written(strict)
    assert strict.report["max_arc_error_after_mm"] == pytest.approx(float(said[1]), abs=0.006)
    assert [d for d in strict.diagnostics if d.code == "CMP006"] == []


def test_of_a_fitted_model_the_error_that_its_fit_knows_counts() -> None:
    """Joint 2 is known to 3 % or to 100 %: the same line gets two targets or one."""
    added = []
    for share in (0.03, 1.0):
        sigma = share * arm().robot.joint_compliance[1]  # type: ignore[index]
        table = {"parameters": ["joint_compliance.compliance_rad_per_Nm[1]"], "covariance": [[sigma**2]]}
        found = convert(seam(450), replace(arm(), fit=table), tolerance_m=TOLERANCE_M, **HARD)
        assert found.plan is not None
        known = found.report["expected_accuracy"]["within_95_percent_mm"]
        assert 1e3 * found.plan.expected_m == pytest.approx(known, rel=1e-3)
        over = [d.help for d in found.diagnostics if d.code == "CMP006"]
        added.append((found.report["added_targets"], known > 0.4, len(over)))
    assert added == [(2, False, 0), (1, True, 1)]


@pytest.mark.parametrize("tolerance_m", [3e-6, 1e-5])
def test_what_targets_would_leave_is_what_they_leave(tolerance_m: float) -> None:
    """On a line and on half a circle, against the program that has them, driven by the independent arm."""
    for text, kind in ((seam(250), "L"), (HALF_CIRCLE, "C")):
        plan = convert(text, tolerance_m=TOLERANCE_M).plan
        assert plan is not None
        division = Division.of(plan.motion.samples, np.full(len(plan.motion.moves), tolerance_m), plan.motion.steady())
        i = next(i for i, m in enumerate(plan.motion.moves) if m.event.statement.instruction in ("ArcLEnd", "ArcC"))
        count, remaining = error_with_targets(division, i, plan.curve)
        close = convert(text, tolerance_m=tolerance_m)
        assert count > 0 and remaining <= 0.8 * tolerance_m
        key = plan.motion.moves[i].event.statement.key
        assert close.plan is not None and count == sum(a.statement.key == key for a in close.plan.insertions)
        off = max(s.after for s in independent(text, close).segments if s.kind == kind and s.welding)
        assert off == pytest.approx(1e3 * remaining, abs=0.002)
