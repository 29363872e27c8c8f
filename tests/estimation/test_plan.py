"""Poses that are to be measured: where they may be, and what the data so far tells apart."""

from __future__ import annotations

import numpy as np
import pytest

import postproc
from postproc.effects.registry import effect_library
from postproc.estimation.least_squares import fit_model
from postproc.estimation.solving.settle import settled
from postproc.identification.add import add_effects, grown
from postproc.identification.compare import compare
from postproc.identification.diagnose import diagnose
from postproc.identification.planning import promise
from postproc.identification.planning.design import Room
from postproc.identification.planning.plan import plan_poses
from postproc.identification.planning.promise import BETWEEN_ROWS, Promise, drawn, simulated
from postproc.model.equilibrium import predict
from postproc.results.improve.plan import plan_sentence
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


def test_diagnose_and_plan_tell_apart_by_one_criterion(monkeypatch):
    monkeypatch.setattr(promise, "TABLES", 6)
    data, _ = cell(kinds.payload_error, seed=965, poses=60)
    base = base_fit(data)
    (missing,) = diagnose(base.model, data).missing
    rival = missing.not_separable[0]
    assert not effect_library()[rival].null().missing(base.problem.sensitivity.state)
    plan = plan_poses(base.model, data, 5, (rival, missing.key))
    assert not plan.resolved and "apart already" not in plan_sentence(plan)


def test_what_linear_springs_cannot_tell_is_not_promised_and_nothing_is_advised_for_it(monkeypatch):
    """A balancer turns joint 2 through a linear spring: as a gear line of order 1 does, whatever the payload."""
    monkeypatch.setattr(promise, "TABLES", 4)
    monkeypatch.setattr(promise, "FEWER", 2)
    data, _ = cell(kinds.gravity_compensator, seed=966, poses=40)
    plan = plan_poses(base_fit(data).model, data, 6, ("gravity_compensator", "transmission_error"))
    assert plan.promise == Promise(2, 0) and not plan.resolved
    assert plan.alternatives and not any(other.promise.enough for other in plan.alternatives)
    assert plan_sentence(plan).endswith("nothing that was simulated tells them apart.")


def test_a_simulated_table_keeps_the_rows_and_has_the_planned_poses_of_a_drawn_arm():
    data = cell(kinds.payload_error, seed=965, poses=60)[0].in_order
    fit = settled(grown(base_fit(data), effect_library()["payload_error"]))
    planned = data.rows(np.arange(30)).state.with_(wrench=np.tile([0.0, 300.0, 0.0, 0.0, 0.0, 0.0], (30, 1)))
    table = simulated(fit, planned, np.random.default_rng(0))
    n = len(data)
    np.testing.assert_array_equal(table.position[:n], data.position)
    assert len(table) == n + 30 and not table.state.wrench[:n].any() and (table.state.wrench[n:, 1] == 300.0).all()
    assert (np.diff(table.state.time[n - 1 :]) == BETWEEN_ROWS).all() and len(set(table.repeats[n:])) == 30
    pulled = predict(fit.model, table.rows(np.arange(n, n + 30)).state)[:, :3, 3]
    off = table.position[n:] - pulled
    assert 0.5 * fit.parts.level < off.std() < 3 * fit.parts.level
    many = np.array([drawn(fit, np.random.default_rng(k)).effect("payload_error").vector() for k in range(200)])
    moved = [i for key, i in fit.posterior.names if key == "payload_error"]
    sigma = np.array([fit.sigma["payload_error", i] for i in moved])
    np.testing.assert_allclose(many.std(axis=0)[moved], sigma, rtol=0.3)


def test_one_bound_for_one_table():
    data, _ = cell(kinds.backlash, seed=962)
    data = data.rows(np.unique(data.repeats, return_index=True)[1]).in_order
    model = base_fit(data).model
    documents = map(
        postproc.document, (compare(model, data), diagnose(model, data), add_effects(model, data, ["backlash"]))
    )
    bounds = [one[key] for one, key in zip(documents, ("bound_mm", "bound_mm", "floor_mm"), strict=True)]
    assert bounds == pytest.approx([bounds[0]] * 3, rel=0.01)
