"""What is named, and what else could stand behind the name."""

from __future__ import annotations

import numpy as np

from postproc.identify.diagnose import diagnose
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
