"""Channels that follow the rows in their order: filled in for a table and along a program, and held by the model."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

from postproc.compensation.options import Options
from postproc.compensation.reading import read_motion
from postproc.effects.library.curve import ChannelCurve
from postproc.model.ordered import with_ordered_channels
from tests.build import FORCE, arm, events, module, target

PLAY = ChannelCurve(channels=("play(q2, 2 mrad)",), turn_rad=[2e-4])
CREEP = ChannelCurve(channels=("creep(load3, 1 min)",), turn_rad=[1e-5], largest=(100.0,))
PROGRAM = module(
    f"CONST robtarget p:={target(1200, -200)};\nCONST robtarget r:={target(1200, 200)};",
    "MoveJ p,v100,fine,tT;\nMoveL r,v100,fine,tT;\nMoveL p,v100,fine,tT;",
)


def slack(x: np.ndarray, reach: float) -> np.ndarray:
    """Where in its gap a slide lies that is dragged along, in -1 .. 1."""
    place, expected = x[0], []
    for at in x:
        place = min(max(place, at - reach), at + reach)
        expected.append((at - place) / reach)
    return np.array(expected)


def test_play_is_followed_along_a_program_from_sample_to_sample():
    model = arm().with_effects(*arm().effects, PLAY)
    motion, _ = read_motion(model, events(PROGRAM), Options(force=FORCE, inertia=False))
    found = motion.ordered["play(q2, 2 mrad)"]
    assert_allclose(found, slack(motion.samples.q[:, 1], 0.002), atol=1e-9)
    assert found.max() == 1.0 and found.min() < 0.0
    some = motion.at(slice(20, 40))
    assert_allclose(some.channels["play(q2, 2 mrad)"], found[20:40])


def test_a_table_has_the_channels_of_the_model_and_of_what_is_added():
    """Loads are those of the arm without deflection; what the table has is left as it is."""
    motion, _ = read_motion(arm(), events(PROGRAM), Options(force=FORCE, inertia=False))
    state = motion.at(slice(None)).with_(time=np.linspace(0, 100, len(motion.samples.q)))
    seen = with_ordered_channels(arm().with_effects(PLAY), state, [CREEP])
    assert set(seen.channels) - set(state.channels) == {"play(q2, 2 mrad)", "creep(load3, 1 min)"}
    assert seen.joint_load is None and seen.T_base_body is None
    creep = seen.channels["creep(load3, 1 min)"]
    assert creep[0] == 0.0 and np.abs(creep).max() > 50.0
    again = with_ordered_channels(arm().with_effects(PLAY), seen.with_(q=0 * seen.q))
    assert again.channels["play(q2, 2 mrad)"] is seen.channels["play(q2, 2 mrad)"]
    assert with_ordered_channels(arm(), state) is state
