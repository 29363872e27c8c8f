"""Whole diagnoses of a name and a law that nobody knows: which of the two is told, and when both."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.identification.diagnose import diagnose
from tests.identification.cells import base_fit, cell
from tests.independent import library_effects as kinds


def test_a_gap_that_closes_with_another_joint_is_not_called_lost_motion() -> None:
    """Lost motion of joint 3 that falls with the cube of joint 2: what the patterns miss of it looks like `backlash`."""
    data, _ = cell(seed=71, noise=0.02, poses=90)
    q2, side = data.state.q[:, 1], data.state.approach[:, 2]
    law = 3e-4 * side * (1 - ((q2 - q2.min()) / np.ptp(q2)) ** 3)
    turned = base_fit(data).problem.sensitivity.matrix[:, :3, 2]
    moved = replace(data, position=data.position + turned * law[:, None])
    found = diagnose(base_fit(moved).model, moved)
    assert (found.verdict, found.missing) == ("unknown", ())
    first = found.suspects[0]
    assert (first.where, {*first.channels}) == ("joint 3", {"dir3", "q2"})
    assert first.share > 0.9


def test_a_name_beside_a_step_of_the_instrument_is_told_with_it() -> None:
    data, _ = cell(kinds.backlash, seed=71, noise=0.03, poses=70)
    step = 0.25e-3 * (data.state.q[:, 3] > 0.2)
    moved = replace(data, position=data.position + step[:, None] * [1.0, -0.5, 0.3])
    found = diagnose(base_fit(moved).model, moved)
    assert found.verdict == "unknown"
    assert [m.key for m in found.missing] == ["backlash"]
    first = found.suspects[0]
    assert (first.where, first.channel) == ("instrument", "q4") and first.pattern.startswith("step near")
