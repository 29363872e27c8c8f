"""What was found is asked for levels that no fit has seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import postproc
from postproc.diagnostics import PostprocError
from postproc.identification.diagnose import diagnose
from postproc.identification.interventions import hold_out_levels
from tests.identification.cells import base_fit, cell, hidden_found
from tests.independent import library_effects as kinds


@pytest.mark.parametrize("channel", ["payload", "temperature", "approach", "region"])
def test_what_is_true_carries_over_to_what_was_changed(channel):
    found = hidden_found(kinds.backlash, seed=211, poses=80)
    asked = hold_out_levels(found, channel)
    assert [m.key for m in found.missing] == ["backlash"] and len(asked.levels) > 1
    if channel != "approach":  # without one side of a joint its gap cannot be told from an offset
        assert all(level.after < 1.3 * 3e-5 for level in asked.levels) and asked.fails("backlash") == []
    shown = replace(found, hold_out=asked)
    document = postproc.document(shown)["hold_out"]
    assert document["channel"] == channel and "does_not_carry_over" in document["levels"][0]
    assert f"\nHeld out by {channel}, mm on rows" in postproc.text(shown)


def test_a_name_that_is_no_cause_does_not_carry_over():
    """What the hot rows alone have is told as something else, which predicts no other temperature."""
    data, _ = cell(seed=963)
    level = np.arange(len(data)) % 3
    state = data.state.with_(temperature=np.array([20.0, 25.0, 40.0])[level], time=None)
    true = data.position - data.position.mean(axis=0)
    shifted = replace(data, state=state, position=data.position + np.where(level == 2, 2e-4, 0.0)[:, None] * true)
    found = diagnose(base_fit(data).model, shifted)
    asked = hold_out_levels(found, "temperature")
    assert {level.name for level in asked.levels} == {"20 degC", "25 degC", "40 degC"}
    (name,) = {m.key for m in found.missing} & {"thermal_growth", "thermal_joint_drift"}
    assert "40 degC" in asked.fails(name)
    assert f"`{name}` does not carry over to" in postproc.text(replace(found, hold_out=asked))


def test_one_level_cannot_be_held_out():
    found = hidden_found(kinds.backlash, seed=211, poses=80)
    with pytest.raises(PostprocError, match="--hold-out session"):
        hold_out_levels(found, "session")
