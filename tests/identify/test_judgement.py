"""What is named, and what else could stand behind the name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.effects.gravity_compensator import GravityCompensator
from postproc.effects.thermal_joint_drift import ThermalJointDrift
from postproc.effects.transmission_error import TransmissionError
from postproc.identify.candidate import Screen
from postproc.identify.diagnose import diagnose
from postproc.identify.fit import fit_model
from postproc.identify.judgement import confusable
from postproc.identify.selection import compose
from tests.identify.cells import base_fit, cell
from tests.independent.cells import Hidden, column


def _waves(g, arm):
    """Once a turn of joint 2, as a balancer would turn it through the spring of joint 2, and nine times of joint 3."""
    return Hidden("waves", "transmission_error", joint=lambda s, tau: _once(s) + _nine_times(s))


def _short_wave(g, arm):
    return Hidden("wave", "transmission_error", joint=lambda s, tau: _nine_times(s))


def _once(s):
    return column(1, 8e-4 * np.sin(s.q[:, 1] + 0.4))


def _nine_times(s):
    return column(2, 1e-4 * np.sin(9 * s.q[:, 2]))


def test_a_balancer_that_hides_behind_one_of_several_waves_is_said_to_do_so():
    data, _ = cell(_waves, seed=640120, poses=80)
    (missing,) = diagnose(base_fit(data).model, data).missing
    assert missing.candidate.key == "transmission_error" and "gravity_compensator" in missing.not_separable
    data, _ = cell(_short_wave, seed=640120, poses=80)
    (missing,) = diagnose(base_fit(data).model, data).missing
    assert missing.candidate.key == "transmission_error" and "gravity_compensator" not in missing.not_separable


def test_what_hides_is_told_from_fits_that_use_other_rows():
    data, _ = cell(_waves, seed=640120, poses=80)
    before = base_fit(data)
    after = base_fit(data.rows(np.arange(len(data)) % 9 > 0), more=("transmission_error",))
    wave = TransmissionError(joint=[2, 3], order=[1, 9])
    after = fit_model(after.model.with_effects(*after.model.effects[:-1], wave), after.data)
    screen = Screen(before.problem, {c.key: c for c in (GravityCompensator, ThermalJointDrift)})
    ranking = [compose(screen, before.linear, key) for key in screen.classes]
    ranking = [replace(c, evidence=1.0) for c in ranking]
    chosen = replace(ranking[0], key="transmission_error", evidence=1e9, fall=before.linear.square)
    assert confusable(ranking, chosen, before, after) == ("gravity_compensator",)
