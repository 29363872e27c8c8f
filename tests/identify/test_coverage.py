"""95 % intervals hold the truth in about 95 of 100 cases, whether or not repeats tell the noise."""

from __future__ import annotations

import numpy as np
import pytest

from tests.bench.coverage import ARMS, compliances, predictions, single
from tests.identify.cells import base_fit, cell, true_compliance, true_error
from tests.independent import library_effects as kinds


@pytest.mark.parametrize("repeats", [True, False])
def test_intervals_hold_the_truth(repeats):
    inside, known = [], []
    for i in range(12):
        terms = {"seed": 5100 + i, "robot": ARMS[i % 3], "poses": 60, "noise": (0.012, 0.03, 0.06)[i // 3 % 3]}
        data, true = cell(**terms)
        fit = base_fit(data if repeats else single(data), terms["robot"])
        assert (fit.noise.position is not None) == repeats
        inside.append(predictions(fit, true))
        known.append(compliances(fit, true_compliance(**terms)))
    assert 0.90 < np.mean(inside) < 0.98
    assert 0.90 < np.mean(np.concatenate(known)) < 1.0


@pytest.mark.parametrize("kind", [kinds.backlash, kinds.transmission_error, kinds.thermal_joint_drift])
def test_noise_and_missing_physics_are_told_apart_without_repeats(kind):
    data, true = cell(kind, seed=5151, poses=100, noise=0.03)
    lacking = base_fit(single(data))
    assert lacking.unexplained == pytest.approx(true_error(lacking, true), rel=0.25)
    assert 0.88 < predictions(lacking, true).mean() <= 0.98


def test_pure_noise_is_taken_for_noise():
    data, _ = cell(seed=101)
    fit = base_fit(single(data))
    assert fit.leftover.noise > 0.98
    assert fit.leftover.held_out == pytest.approx(fit.held_out_rms, rel=0.1)


def test_free_functions_come_near_the_noise_where_physics_is_missing():
    data, _ = cell(kinds.backlash, seed=211)
    fit = base_fit(data)
    left = fit.leftover
    assert fit.rms > 2 * 3e-5
    assert left.held_out < 1.3 * 3e-5
    assert left.noise * fit.variance * fit.noise.position**2 == pytest.approx(9e-10, rel=0.2)
