"""Poses that are to be measured: where they may be, and what the data so far tells apart."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

import postproc
from postproc.effects.registry import effect_library
from postproc.estimation.least_squares import fit_model
from postproc.identification.add import add_effects
from postproc.identification.compare import compare
from postproc.identification.design import Room
from postproc.identification.diagnose import diagnose
from postproc.identification.plan import plan_poses
from postproc.model.equilibrium import predict
from postproc.results.plan import plan_sentence
from tests.build import refused
from tests.identification.cells import base_fit, cell
from tests.independent import library_effects as kinds

REGION = np.array([[0.9, -0.5, 0.4], [1.6, 0.5, 1.2]])


def test_poses_are_where_they_may_be_and_the_reflector_looks_at_the_instrument():
    data, _ = cell(seed=500)
    model, q = base_fit(data).model, data.state.q

    def planned(**room):
        return plan_poses(model, data, 8, room=Room(**room))

    inside = planned(region=REGION).T_base_tcp[:, :3, 3]
    ranged, listed = planned(measured_range=True).state.q, planned(candidates=q[::3]).state.q
    T = predict(fit_model(model, data).model, planned(sight=np.radians(40.0)).state)
    toward = -T[:, :3, 3] / np.linalg.norm(T[:, :3, 3], axis=1)[:, None]
    assert ((inside >= REGION[0]) & (inside <= REGION[1])).all()
    assert ((ranged >= q.min(axis=0)) & (ranged <= q.max(axis=0))).all()
    assert all((np.abs(q[::3] - one).max(axis=1) < 1e-9).any() for one in listed)
    assert (np.sum(toward * T[:, :3, 2], axis=1) >= np.cos(np.radians(40.0)) - 1e-6).all()
    (found,) = refused(lambda: planned(region=REGION + 5.0))
    assert "poses are where they may be" in found.message


def test_diagnose_and_plan_tell_apart_by_one_criterion():
    data, _ = cell(kinds.payload_error, seed=965, poses=60)
    base = base_fit(data)
    (missing,) = diagnose(base.model, data).missing
    rival = missing.not_separable[0]
    assert not effect_library()[rival].null().missing(base.problem.sensitivity.state)
    for pair in permutations((missing.key, rival)):
        plan = plan_poses(base.model, data, 5, pair)
        assert not plan.resolved and "tells them apart already" not in plan_sentence(plan)


def test_one_bound_for_one_table():
    data, _ = cell(kinds.backlash, seed=962)
    data = data.rows(np.unique(data.repeats, return_index=True)[1]).in_order
    model = base_fit(data).model
    documents = map(
        postproc.document, (compare(model, data), diagnose(model, data), add_effects(model, data, ["backlash"]))
    )
    bounds = [one[key] for one, key in zip(documents, ("bound_mm", "bound_mm", "floor_mm"), strict=True)]
    assert bounds == pytest.approx([bounds[0]] * 3, rel=0.01)
