"""How the measured pose answers to the parameters of a model's effects."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.effects.registry import effect_library
from postproc.model.derivatives import sensitivity as module
from postproc.model.derivatives.sensitivity import sensitivity
from postproc.model.equilibrium import equilibrium
from tests.identification.cells import base_fit, cell
from tests.independent import library_effects as kinds

BENDING = ("bearing_tilt", "link_compliance", "base_compliance", "nonlinear_compliance", "arm_load", "dress_pack")


@pytest.mark.parametrize("half", [0, 1])
@pytest.mark.parametrize("key", BENDING)
def test_loads_where_they_are_read_tell_the_same_slopes(monkeypatch, key, half):
    # What is null at a body reads no load there, and has a slope all the same.
    data, _ = cell(kinds.arm_load, seed=222, poses=30)
    base = base_fit(data)
    null = effect_library()[key].null()
    x = null.vector() + np.where(np.arange(len(null.vector())) % 2 == half, 0.5 * null.scale(), 0.0)
    model = base.model.with_effects(*base.model.effects, null.with_vector(np.clip(x, *null.bounds())))
    rest = equilibrium(model, base.problem.equilibrium.state)
    effect, every = model.effects[-1], np.ones(len(x), dtype=bool)
    known = sensitivity(model, rest).by_parameter(effect, every)
    monkeypatch.setattr(module, "MANY_POSES", 1)
    at = sensitivity(model, rest)
    assert at.loaded.own is rest.state or key == "bearing_tilt"
    np.testing.assert_allclose(at.by_parameter(effect, every), known, atol=1e-7 * np.abs(known).max())
