"""Poses that are to be measured: where they may be, and what the data so far tells apart."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from postproc import text as text_of
from postproc.diagnostics import PostprocError
from postproc.effects.registry import effect_library
from postproc.estimation.least_squares import fit_model
from postproc.identification.diagnose import diagnose
from postproc.identification.plan import plan_poses
from postproc.identification.design import Room
from postproc.results.addition import addition_values
from postproc.results.comparison import comparison_values
from postproc.results.diagnosis import diagnosis_values
from postproc.results.plan import plan_sentence
from tests.identification.cells import base_fit, cell
from tests.independent import library_effects as kinds


def test_poses_are_where_they_may_be():
    data, _ = cell(seed=500)
    model = base_fit(data).model
    region = np.array([[0.9, -0.5, 0.4], [1.6, 0.5, 1.2]])
    plan = plan_poses(model, data, 8, room=Room(region=region))
    inside = plan.T_base_tcp[:, :3, 3]
    assert (inside >= region[0]).all() and (inside <= region[1]).all()
    plan = plan_poses(model, data, 8, room=Room(measured_range=True))
    assert (plan.state.q >= data.state.q.min(axis=0)).all() and (plan.state.q <= data.state.q.max(axis=0)).all()
    listed = data.state.q[::3]
    plan = plan_poses(model, data, 8, room=Room(candidates=listed))
    assert all((np.abs(listed - q).max(axis=1) < 1e-9).any() for q in plan.state.q)
    with pytest.raises(PostprocError, match="poses are where they may be"):
        plan_poses(model, data, 8, room=Room(region=region + 5.0))


def test_the_reflector_looks_at_the_instrument():
    data, _ = cell(seed=500)
    fit = base_fit(data)
    far = fit.model.effect("instrument_frame")
    model = fit.model.with_effects(*(e for e in fit.model.effects if e.key != "instrument_frame"), far)
    half = np.radians(40.0)
    plan = plan_poses(model, data, 6, room=Room(sight=half))
    from postproc.model.equilibrium import predict

    T = predict(fit_model(model, data).model, plan.state)
    toward = -T[:, :3, 3] / np.linalg.norm(T[:, :3, 3], axis=1)[:, None]
    assert (np.sum(toward * T[:, :3, 2], axis=1) >= np.cos(half) - 1e-6).all()


def test_diagnose_and_plan_tell_apart_by_one_criterion():
    data, _ = cell(kinds.payload_error, seed=965, poses=60)
    base = base_fit(data)
    (missing,) = diagnose(base.model, data).missing
    other = missing.not_separable[0]
    assert not effect_library()[other].null().missing(base.problem.sensitivity.state)
    for pair in permutations((missing.key, other)):
        plan = plan_poses(base.model, data, 5, pair)
        assert "tells them apart already" not in plan_sentence(plan)
        assert not plan.resolved_orders


def test_a_map_is_called_a_smooth_correction():
    data, _ = cell(kinds.joint_error_map, seed=967, poses=120)
    found = diagnose(base_fit(data).model, data)
    (smooth,) = (m for m in found.missing if m.key == "joint_error_map")
    numbers = len(found.final.model.effect("joint_error_map").vector())
    document = diagnosis_values(found)["missing"][found.missing.index(smooth)]
    assert document["is"] == "smooth correction" and 2 < document["effective_parameters"] < numbers
    assert "a smooth correction with" in text_of(found) and "not a cause" in text_of(found)


def test_one_bound_for_one_table():
    from postproc.identification.add import add_effects
    from postproc.identification.compare import compare

    data, _ = cell(kinds.backlash, seed=962)
    data = data.rows(np.unique(data.repeats, return_index=True)[1]).in_order
    model = base_fit(data).model
    bounds = [
        comparison_values(compare(model, data))["bound_mm"],
        diagnosis_values(diagnose(model, data))["bound_mm"],
        addition_values(add_effects(model, data, ["backlash"]))["floor_mm"],
    ]
    assert bounds == pytest.approx([bounds[0]] * 3, rel=0.01)
