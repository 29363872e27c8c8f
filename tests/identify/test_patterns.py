"""Free patterns: what no library has is called unknown, at the right place, and no named effect stands in for it."""

import numpy as np
import pytest

from postproc.effects.contract import State
from postproc.identify.diagnose import diagnose
from postproc.identify.patterns import patterns
from postproc.identify.shapes import sharper
from tests.identify.cells import base_fit, cell
from tests.independent import unknown_effects as kinds


@pytest.mark.parametrize(
    ("kind", "channels", "where"),
    [
        (kinds.refraction, {"x", "y"}, "instrument"),
        (kinds.floor_sway, {"time"}, "instrument"),
        (kinds.elbow_wave, {"q2", "q3"}, "joint 2"),
    ],
)
def test_what_no_library_has_is_unknown_with_its_channel_and_place(kind, channels, where):
    data, _ = cell(kind, seed=311, noise=0.02, poses=70)
    found = diagnose(base_fit(data).model, data)
    assert found.verdict == "unknown" and not found.missing
    assert found.suspects[0].channel in channels and found.suspects[0].where == where


def state(q):
    T = np.tile(np.eye(4), (len(q), 7, 1, 1))
    return State(q=q, T_flange_tcp=np.eye(4), T_base_body=T)


def test_no_step_where_nothing_was_measured():
    side = np.where(np.arange(200) % 2, 1.0, -1.0)
    q5 = side * np.linspace(0.3, 1.8, 200)
    steps = [
        p for p in patterns({"q5": q5}, state(np.zeros((200, 6))), np.zeros((200, 3))) if p.text.startswith("step")
    ]
    assert len(steps) > 10
    for step in [*steps, *sharper(steps[0])]:
        split = (q5[step.values > 0].min(), q5[step.values == 0].max())
        assert split[0] - split[1] < 0.2


def test_a_sway_is_found_at_its_own_period_and_phase():
    time = np.linspace(0.0, 7200.0, 150)
    truth = np.sin(2 * np.pi * time / 1630.0 + 0.9)
    coarse = [
        p
        for p in patterns({"time": time}, state(np.zeros((150, 6))), np.zeros((150, 3)))
        if p.text.startswith("swaying")
    ]

    def best(some):
        return max(some, key=lambda p: abs(np.corrcoef(p.values, truth)[0, 1]))

    fine = best(sharper(best(coarse)))
    assert abs(np.corrcoef(fine.values, truth)[0, 1]) > 0.9
    assert 1500 < float(fine.text.split()[-2]) < 1760


def test_lost_motion_in_a_worn_sector_is_told_by_its_ends():
    g = np.random.default_rng(8)
    q5, dir5 = g.uniform(-1.6, 1.7, 160), g.choice([-1.0, 1.0], 160)
    truth = dir5 * ((q5 > -0.3) & (q5 < 0.9))

    def best(some):
        return max(some, key=lambda p: abs(np.corrcoef(p.values, truth)[0, 1]) if np.ptp(p.values) else 0.0)

    coarse = patterns({"q5": q5, "dir5": dir5}, state(np.zeros((160, 6))), np.zeros((160, 3)))
    fine = best(sharper(best(coarse)))
    assert (
        fine.text.startswith("dir5 only where q5 is between -1") and abs(np.corrcoef(fine.values, truth)[0, 1]) > 0.95
    )
