"""Fits with some of what a search has found."""

from __future__ import annotations

import pytest

from postproc.estimation.least_squares import fit_model
from postproc.estimation.solving.solve import Terms
from postproc.identification import refits
from tests.identification.cells import base_fit, cell
from tests.independent import library_effects as kinds


def test_springs_settle_anew_without_what_stood_beside_a_load(monkeypatch):
    # A payload acts through springs that are fitted, too: without the balancer one step ends far from where they settle.
    data, _ = cell(kinds.payload_error, kinds.gravity_compensator, seed=222, poses=150)
    final = base_fit(data, more=("payload_error", "gravity_compensator"))
    kept = [e for e in final.model.effects if e.key != "gravity_compensator"]
    free = {e.key: final.free[e.key] for e in kept}
    settled = fit_model(final.model.with_effects(*kept), data, terms=Terms(free)).held_out_rms
    assert refits.without(final, ["gravity_compensator"]).held_out_rms == pytest.approx(settled, rel=0.03)
    monkeypatch.setattr(refits, "STEPS", 0)
    assert refits.without(final, ["gravity_compensator"]).held_out_rms < 0.8 * settled
