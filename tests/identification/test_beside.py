"""Effects of the library beside a large law that nobody has a name for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.effects.library.joints.nonlinear_compliance import NonlinearCompliance
from postproc.effects.library.loads.arm_load import ArmLoad
from postproc.estimation.least_squares import fit_model
from postproc.identification.screen.suspects import Suspect
from postproc.identification.search import accepted
from postproc.identification.state import SearchState
from postproc.model.derivatives.places import INSTRUMENT
from tests.identification.cells import base_fit, cell, law
from tests.identification.test_whole import two_rates
from tests.independent import library_effects as kinds


def swaying(data, size=1e-3):
    """The instrument goes to and fro from row to row [m]; and the pattern of that."""
    wave = size * np.sin(np.arange(len(data)) / 3.0)
    moved = replace(data, position=data.position + wave[:, None] * [1.0, -0.5, 0.3])
    base = base_fit(moved)
    place = base.problem.sensitivity.matrix[:, :, INSTRUMENT : INSTRUMENT + 3]
    one = Suspect("instrument", place, law("row", wave / size), 0.0, 99.0, 0.0, "row")
    return base, one


@pytest.mark.parametrize("seed", [71, 72])
def test_a_small_load_is_taken_beside_a_large_law(seed):
    data, _ = cell(kinds.arm_load, seed=seed, noise=0.02)
    base, law = swaying(data)
    search = SearchState(base, base, {ArmLoad.key: ArmLoad}, None)
    assert not any(c.evidence > 0 for c in search.ranked)
    beside = search.beside((law,))
    ranked = beside.ranked
    assert ranked[0].evidence > 0
    taken = accepted(beside, ranked[0])
    assert taken is not None and taken.missing[0].evidence > 10.0
    # As it is told where there is no law at all.
    alone = fit_model(base_fit(data).model, base_fit(data).data, [taken.fit.model.effect("arm_load")])
    quiet, found = alone.model.effect("arm_load").vector(), taken.fit.model.effect("arm_load").vector()
    sigma = [taken.fit.sigma.get(("arm_load", i), np.inf) for i in range(len(found))]
    assert np.abs(found - quiet).max() > 0 and (np.abs(found - quiet) < 4 * np.array(sigma)).all()


def test_what_forms_an_effect_stays_where_the_patterns_beside_it_are_taken_away():
    data, _ = cell(two_rates, seed=7, noise=0.02)
    base, law = swaying(data)
    beside = SearchState(base, base, {NonlinearCompliance.key: NonlinearCompliance}, None).beside((law,))
    ranked = beside.ranked
    beside = accepted(beside, ranked[0])
    assert beside is not None
    alone = beside.beside(())
    told, bare = (s.fit.model.effect(NonlinearCompliance.key) for s in (beside, alone))
    forms = ~told.amplitudes() & beside.fit.free[NonlinearCompliance.key]
    assert forms.any() and (told.vector()[forms] == bare.vector()[forms]).all()
    assert alone.fit.problem.beside is None and alone.outside == () and alone.fit.rms > 5 * beside.fit.rms
    assert alone.beside(()) is alone and beside.beside((law,)) is beside


def test_patterns_are_taken_away_again_as_they_were_put_there():
    """Nothing was named meanwhile: what the fit left before it leaves again, and is not looked for anew."""
    base, one = swaying(cell(seed=74, noise=0.02, poses=60)[0])
    search = SearchState(base, base, {}, None)
    again = replace(one, form=law("row", one.values**2))
    both = search.beside((one,)).beside((one, again))
    assert both.beside(()).fit is base and both.beside(()).outside == ()
