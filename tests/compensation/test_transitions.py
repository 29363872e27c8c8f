"""Where the correction jumps: finished before the arc, jerk-limited; where it does not, it passes unchanged."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.correction.curve import BEFORE_TARGET, FROM_START, commanded_curve
from postproc.rapid.data.pose import quat_mult
from tests.build import arm, codes, convert, events, independent, module, target, written

SEAM = "v100,sm,wd,{zone},tT"
TEXT = module(
    "",
    f"MoveJ {target(1350, -500, 860)},v200,fine,tT;\n"
    f"MoveL {target(1350, -480, 800)},v200,{{zone}},tT;\n"
    f"ArcLStart {target(1350, -480)},{SEAM.format(zone='fine')};\n"
    f"ArcL {target(1350, -350)},{SEAM.format(zone='z1')};\n"
    f"ArcLEnd {target(1350, -200)},{SEAM.format(zone='fine')};\n"
    f"MoveL {target(1350, -200, 860)},v200,fine,tT;",
)


@pytest.fixture(scope="module")
def switched() -> Conversion:
    return convert(TEXT.replace("{zone}", "z10"), force_on="arc")


def times(conversion: Conversion) -> np.ndarray:
    """Time at every sample of the programmed curves [s]."""
    plan = conversion.plan
    assert plan is not None
    timeline, s = plan.motion.timeline, plan.motion.samples
    return np.interp(s.move + s.u, timeline.place, timeline.t)


def test_the_correction_is_complete_when_the_arc_is_lit(switched: Conversion) -> None:
    """Along the whole seam, its first millimetre included, the correction is the exact one."""
    plan = switched.plan
    assert plan is not None
    samples = plan.motion.samples
    curve, transitions = commanded_curve(arm(), samples, plan.exact, plan.exact, times(switched))
    welding = np.array([m.welding for m in samples.moves])[samples.move]
    assert welding.any()
    assert np.abs(curve[welding] - plan.exact.T_work_tcp[welding]).max() < 1e-9
    assert not any(samples.moves[t.move].welding for t in transitions)
    assert {(t.move, t.where) for t in transitions} == {(2, BEFORE_TARGET), (5, FROM_START)}


def test_the_transition_lies_beside_the_seam_and_is_reported(switched: Conversion) -> None:
    assert codes(switched).count("CMP007") == 2 and "CMP008" not in codes(switched)
    assert switched.report["max_error_after_mm"] <= 0.01
    assert switched.report["max_transition_mm"] > 0.1


def test_an_arm_that_is_loaded_on_the_arc_alone_follows_the_seam(switched: Conversion) -> None:
    """The independent arm under the force: right along the seam, off beside it by what the force would have bent."""
    report = independent(TEXT.replace("{zone}", "z10"), switched)
    seam = [s for s in report.segments if s.welding]
    assert len(seam) == 2
    assert max(s.after for s in seam) <= 0.01
    assert max(s.goal_after for s in report.segments if s.name.startswith("arcl")) <= 0.002
    free = independent(TEXT.replace("{zone}", "z10"), switched, force=(0, 0, 0))
    assert free.segments[1].goal_after <= 0.002 and free.segments[-1].goal_after <= 0.002
    assert max(s.after for s in free.segments if s.welding) > 0.3


def test_the_transition_is_smooth_in_time(switched: Conversion) -> None:
    """No step, in position or in speed, anywhere between the approach and the arc."""
    plan = switched.plan
    assert plan is not None
    samples, t = plan.motion.samples, times(switched)
    curve, transitions = commanded_curve(arm(), samples, plan.exact, plan.exact, t)
    for transition in transitions:
        rows = np.arange(samples.start[transition.move], samples.goal[transition.move] + 1)
        added = (curve - plan.exact.T_work_tcp)[rows, :3, 3]
        size = np.linalg.norm(added, axis=1)
        end = (-1, 0) if transition.where == BEFORE_TARGET else (0, -1)
        assert size[end[0]] == pytest.approx(transition.size_m, rel=1e-9)
        assert size[end[1]] < 1e-12
        assert (np.diff(size) <= 1e-12).all() or (np.diff(size) >= -1e-12).all()
        slope = np.linalg.norm(np.diff(added, axis=0), axis=1) / np.diff(t[rows])
        assert slope.max() <= 2.5 * transition.size_m / transition.duration
        assert transition.duration >= 0.1


def test_a_correction_without_steps_passes_unchanged() -> None:
    found = convert(TEXT.replace("{zone}", "z10"))
    plan = found.plan
    assert plan is not None and plan.transitions == ()
    curve, transitions = commanded_curve(arm(), plan.motion.samples, plan.exact, plan.exact, times(found))
    assert transitions == []
    assert np.abs(curve - plan.exact.T_work_tcp).max() <= 1e-9


@pytest.mark.parametrize("force", [(0.0, 0.0, 0.0), (300.0, 0.0, -100.0)])
def test_the_force_acts_on_the_arc_alone(force: tuple[float, float, float]) -> None:
    """Targets beside the arc are those of a conversion without any force, targets of the seam those with it."""
    text = TEXT.replace("{zone}", "fine")
    on_arc, everywhere, nowhere = (
        [e.target for e in events(written(c)) if e.zone.finep]
        for c in (
            convert(text, force=force, force_on="arc"),
            convert(text, force=force),
            convert(text, force=(0.0, 0.0, 0.0)),
        )
    )

    def apart(a: Any, b: Any) -> float:
        return float(np.linalg.norm(np.subtract(a.trans, b.trans)))

    for number, source in ((0, nowhere), (1, nowhere), (2, everywhere), (3, everywhere), (4, nowhere)):
        assert apart(on_arc[number], source[number]) <= 0.0015


@pytest.mark.parametrize("length", [0.4, 3.0, 60.0])
def test_a_short_way_to_the_arc(length: float) -> None:
    """However short the move before the arc is, the seam is right; what could not be smooth is said."""
    z = 700 + length
    text = module(
        "",
        f"MoveJ {target(1350, -480, z)},v200,fine,tT;\nArcLStart {target(1350, -480)},{SEAM.format(zone='fine')};\n"
        f"ArcLEnd {target(1350, -200)},{SEAM.format(zone='fine')};",
    )
    found = convert(text, force_on="arc")
    report = independent(text, found)
    assert report.segments[-1].after <= 0.01
    assert max(s.goal_after for s in report.segments[1:]) <= 0.002
    assert found.plan is not None
    (transition,) = found.plan.transitions
    assert transition.duration <= times(found)[found.plan.motion.samples.goal[1]] + 1e-9


def test_two_seams_that_follow_each_other() -> None:
    """Between ArcLEnd and the next ArcLStart the arc is out: both ends of that move pass over."""
    text = module(
        "",
        f"MoveJ {target(1350, -500, 760)},v200,fine,tT;\nArcLStart {target(1350, -480)},{SEAM.format(zone='fine')};\n"
        f"ArcLEnd {target(1350, -400)},{SEAM.format(zone='fine')};\nArcLStart {target(1350, -300)},{SEAM.format(zone='fine')};\n"
        f"ArcLEnd {target(1350, -200)},{SEAM.format(zone='fine')};",
    )
    found = convert(text, force_on="arc")
    assert found.plan is not None
    assert [t.where for t in found.plan.transitions if t.move == 3] == [FROM_START, BEFORE_TARGET]
    report = independent(text, found)
    assert [s.after <= 0.01 for s in report.segments if s.welding] == [True, True]


def test_a_corner_that_ends_the_seam_without_a_stop() -> None:
    """The arc goes out in a corner zone: the seam keeps its correction, the move after it passes over."""
    text = TEXT.replace("{zone}", "z10").replace(
        f"ArcLEnd {target(1350, -200)},{SEAM.format(zone='fine')}",
        f"ArcLEnd {target(1350, -200)},{SEAM.format(zone='z5')}",
    )
    found = convert(text, force_on="arc")
    assert max(s.after for s in independent(text, found).segments if s.welding) <= 0.01


def test_a_turn_in_place_is_corrected_for_the_weights_alone() -> None:
    """The wrist turns as fast as it can; the torch must not be sent aside and back for the tenths of a second it takes."""
    there = target(1350, -300)
    half = np.radians(12.5)
    turned = quat_mult((0.300294, -0.015738, 0.95241, 0.049914), (np.cos(half), np.sin(half), 0.0, 0.0))
    again = re.sub(r"\],\[[^]]*\]", f"],[{','.join(f'{x:.6f}' for x in turned)}]", there, count=1)
    text = module(
        "", f"ConfL\\Off;\nMoveJ {there},v100,fine,tT;\nMoveL {again},v20,fine,tT;\nMoveL {there},v20,fine,tT;"
    )
    added = {on: convert(text, inertia=on, force=(0.0, 0.0, 0.0)).report["added_targets"] for on in (False, True)}
    assert added[True] == added[False] <= 2
