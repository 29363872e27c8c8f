"""Where the correction jumps: at the arc, where a joint turns back, by a law of the user's; smooth and told."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.compensation.conversion import Conversion
from postproc.compensation.correction.curve import BEFORE_TARGET, FROM_START, commanded_curve
from postproc.diagnostics import Matter
from postproc.effects.base import Displacement, Effect, param
from postproc.effects.library.curve import ChannelCurve
from postproc.rapid.data.pose import quat_mult
from postproc.results.certificate import Verdict, program_certificate
from tests.build import arm, codes, convert, independent, target, written
from tests.compensation.build import NO_FORCE, PROCESS, effect, findings, model, small
from tests.independent import arm as A
from tests.independent import paths as P
from tests.independent import rapid as R

SEAM = small(
    f"MoveJ @{{1350,-500,860}},v200,fine,tT; MoveL @{{1350,-480,800}},v200,z10,tT; ArcLStart @{{1350,-480}},{PROCESS},fine,tT;"
    f"ArcL @{{1350,-350}},{PROCESS},z1,tT; ArcLEnd @{{1350,-200}},{PROCESS},fine,tT; MoveL @{{1350,-200,860}},v200,fine,tT;"
)
"""A weld of two lines between moves in the air."""


@pytest.fixture(scope="module")
def switched() -> Conversion:
    return convert(SEAM, force_on="arc")


def commanded(conversion: Conversion) -> tuple[np.ndarray, list[Any], np.ndarray]:
    """The commanded curve less the exact correction (n, 4, 4), its transitions, and the time of the samples [s]."""
    plan = conversion.plan
    assert plan is not None
    timeline, s = plan.motion.timeline, plan.motion.samples
    t = np.interp(s.move + s.u, timeline.place, timeline.t)
    curve, transitions = commanded_curve(arm(), s, plan.exact, plan.exact, t)
    return curve - plan.exact.T_work_tcp, transitions, t


def test_the_correction_is_complete_when_the_arc_is_lit(switched: Conversion) -> None:
    """Along the whole seam, its first millimetre included, the correction is the exact one; beside it it passes over."""
    added, transitions, _ = commanded(switched)
    samples = switched.plan.motion.samples  # type: ignore[union-attr]
    welding = np.array([m.welding for m in samples.moves])[samples.move]
    assert welding.any() and np.abs(added[welding]).max() < 1e-9
    assert not any(samples.moves[t.move].welding for t in transitions)
    assert {(t.move, t.where) for t in transitions} == {(2, BEFORE_TARGET), (5, FROM_START)}
    assert codes(switched).count("CMP007") == 2 and "CMP008" not in codes(switched)
    assert switched.report["max_error_after_mm"] <= 0.01 and switched.report["max_transition_mm"] > 0.1


def test_an_arm_that_is_loaded_on_the_arc_alone_follows_the_seam(switched: Conversion) -> None:
    """The independent arm under the force: right along the seam, off beside it by what the force would have bent."""
    loaded, free = (independent(SEAM, switched, force) for force in ((200.0, -200.0, -200.0), (0, 0, 0)))
    welds = [s for s in loaded.segments if s.welding]
    assert len(welds) == 2 and max(s.after for s in welds) <= 0.01
    assert max(s.goal_after for s in loaded.segments if s.name.startswith("arcl")) <= 0.002
    assert free.segments[1].goal_after <= 0.002 and free.segments[-1].goal_after <= 0.002
    assert max(s.after for s in free.segments if s.welding) > 0.3


def test_the_transition_is_smooth_in_time(switched: Conversion) -> None:
    """No step, in position or in speed, anywhere between the approach and the arc."""
    added, transitions, t = commanded(switched)
    samples = switched.plan.motion.samples  # type: ignore[union-attr]
    for transition in transitions:
        rows = np.arange(samples.start[transition.move], samples.goal[transition.move] + 1)
        size = np.linalg.norm(added[rows, :3, 3], axis=1)
        full, none = (-1, 0) if transition.where == BEFORE_TARGET else (0, -1)
        assert size[full] == pytest.approx(transition.size_m, rel=1e-9) and size[none] < 1e-12
        assert (np.diff(size) <= 1e-12).all() or (np.diff(size) >= -1e-12).all()
        slope = np.linalg.norm(np.diff(added[rows, :3, 3], axis=0), axis=1) / np.diff(t[rows])
        assert slope.max() <= 2.5 * transition.size_m / transition.duration
        assert transition.duration >= 0.1


def test_a_correction_without_steps_passes_unchanged() -> None:
    added, transitions, _ = commanded(convert(SEAM))
    assert transitions == [] and np.abs(added).max() <= 1e-9


def test_a_turn_in_place_is_corrected_for_the_weights_alone() -> None:
    """The wrist turns as fast as it can; the torch must not be sent aside and back for the tenths of a second it takes."""
    start = target(1350, -300)
    half = np.radians(12.5)
    turned = quat_mult((0.300294, -0.015738, 0.95241, 0.049914), (np.cos(half), np.sin(half), 0.0, 0.0))
    again = re.sub(r"\],\[[^]]*\]", f"],[{','.join(f'{x:.6f}' for x in turned)}]", start, count=1)
    text = small(f"ConfL\\Off; MoveJ {start},v100,fine,tT; MoveL {again},v20,fine,tT; MoveL {start},v20,fine,tT;")
    still, moving = (convert(text, inertia=on, force=NO_FORCE).report["added_targets"] for on in (False, True))
    assert moving == still <= 2


HALF_GAP = np.array([1e-4, 1.5e-4, 1.2e-4, 1e-4, 1e-4, 0.0])
TURNS_BACK = small(
    "MoveJ p1,v200,fine,tT; ArcLStart p1,v50,sm,wd,fine,tT; ArcLEnd p2,v50,sm,wd,fine,tT;",
    "p1 1350 -300, p2 1350 320 700 0 -1 0 0",
)


def off_line(text: str) -> np.ndarray:
    """Distances [mm] from the line of an arm that stops short on the side from which it came, along the seam."""
    arm = A.irb4600()
    legs = P.play(arm, R.motions(text)[0], step=0.0001)
    q = np.concatenate([leg.q for leg in legs])
    side, dq = np.zeros(6), np.zeros_like(q)
    for k, step in enumerate(np.diff(q, axis=0, prepend=q[:1])):
        side = np.where(np.abs(step) > 1e-9, np.sign(step), side)
        dq[k] = -HALF_GAP * side
    p = (arm.forward(q + dq, np.eye(4)).flange @ legs[-1].motion.tool)[:, :3, 3]
    goal = R.motions(TURNS_BACK)[0][-1].goal[:3, 3]
    assert abs(legs[-1].command[-1, 2, 3] - goal[2]) < 1e-3
    inside = (p[:, 1] > -0.295) & (p[:, 1] < 0.319)
    return np.asarray(1e3 * np.hypot(p[inside, 0] - goal[0], p[inside, 2] - goal[2]))


def test_where_a_joint_turns_back_the_arm_is_off_for_a_few_millimetres_and_it_is_said_how_far() -> None:
    gap = model(effect("backlash", f"half_gap_rad = {HALF_GAP.tolist()}"))
    conversion = convert(TURNS_BACK, gap, force=NO_FORCE)
    before, after = off_line(TURNS_BACK), off_line(written(conversion))
    assert before.min() > 0.05
    assert after.max() > 0.05  # the gap itself cannot be corrected while it is crossed
    # Two crossings in 0.6 m, two to three millimetres each: added targets are turned as the end is, to 0.1 deg.
    assert (after > 0.01).mean() < 2 * 0.0026 / 0.6
    (finding,) = findings(conversion, "CMP008")
    assert "joints 2 and 3 turn back" in finding.message
    # The claim is the whole jump; the first sample after it lies a twentieth of the crossing further.
    claim = conversion.report["max_transition_mm"]
    assert 0.94 * claim < after.max() <= claim
    assert "CMP006" not in codes(conversion) and finding.matter is Matter.OFF
    assert f"the path stays {claim:.3f} mm off there, tolerance 0.01 mm" in finding.message
    # The arc burns there: figures, seam, verdict and certificate say so.
    weld, (seam,) = conversion.report["figures"][0], conversion.report["welds"]
    assert weld["place"] == "weld" and 0.94 * claim < weld["after_mm"] == seam["after_mm"] <= claim
    assert not seam["kept"] and conversion.report["verdict"] == "not_kept"
    assert conversion.report["max_arc_error_after_mm"] == conversion.report["max_error_after_mm"] == claim
    (verdict,) = program_certificate("m.mod", conversion).figures
    assert verdict.value == Verdict.NOT_KEPT.value


@pytest.mark.parametrize(
    ("tolerance", "verdict", "beyond"), [(1e-4, "not_kept", 1), (3e-4, "not_shown", 0)], ids=["closer", "wider"]
)
@pytest.mark.parametrize("welding", [True, False], ids=["weld", "path"])
def test_a_jump_counts_as_any_deviation_where_the_arm_works(
    tolerance: float, verdict: str, beyond: int, welding: bool
) -> None:
    """Along a weld, or along the lines of a program that welds nowhere; its tolerance decides."""
    text = TURNS_BACK if welding else re.sub(r"ArcL(?:Start|End)", "MoveL", TURNS_BACK.replace("sm,wd,", ""))
    gap = model(effect("backlash", f"half_gap_rad = {HALF_GAP.tolist()}"))
    conversion = convert(text, gap, force=NO_FORCE, tolerance_m=tolerance, air_tolerance_m=1.0)
    assert conversion.report["verdict"] == verdict
    after = conversion.report["figures"][0]["after_mm"]
    assert 0.1 < after <= 0.238 and (after > 1e3 * tolerance) == beyond
    assert sum(d.matter is Matter.OFF for d in conversion.diagnostics) == beyond


class LooseBolt(Effect, key="loose_bolt_of_a_test", reads=("q",)):
    """Joint 2 gives way beyond an angle. Source: a test."""

    size_rad: float = param(unit="rad", low=-1e-2, high=1e-2, typical=1e-3)
    edge_rad: float = param(unit="rad", low=-3.0, high=3.0, typical=1.0)

    def displacement(self, state: State) -> Displacement:
        joint = np.zeros((len(state), 6))
        joint[:, 1] = self.size_rad * (state.q[:, 1] > self.edge_rad)
        return Displacement(joint=joint)


def loose_bolt(edge: float) -> Effect:
    return LooseBolt(size_rad=3e-4, edge_rad=edge)


def step_of_a_curve(edge: float) -> Effect:
    law = {"channels": ("q2",), "basis": ("step",), "numbers": (edge,), "largest": (1.0,)}
    return ChannelCurve(place=("joint 2",), **law, turn_rad=np.array([3e-4]))


@pytest.mark.parametrize("jump", [loose_bolt, step_of_a_curve])
def test_a_jump_between_two_targets_is_seen_and_corrected_on_both_sides(jump: Callable[[float], Effect]) -> None:
    """20 mm of line have no sample of their own between the ends: the jump of 0.4 mm was bridged, in no figure."""
    text = small("MoveJ @{1340,-500},v200,fine,tT; MoveL @{1360,-500},v50,fine,tT;")
    plain = convert(text)
    assert plain.plan is not None and plain.report["added_targets"] == 0
    edge = float(plain.plan.motion.samples.q[[0, -1], 1].mean())
    jumping = convert(text, arm().with_effects(*arm().effects, jump(edge)))
    assert jumping.plan is not None
    samples = jumping.plan.motion.samples
    place = samples.T_work_tcp[samples.move == 1][:, :3, 3]
    assert np.linalg.norm(np.diff(place, axis=0), axis=1).max() <= 0.0005 + 1e-9
    assert jumping.report["added_targets"] >= 2
    assert jumping.report["max_error_before_mm"] > plain.report["max_error_before_mm"] + 0.2
