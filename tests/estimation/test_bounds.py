"""Impossible values stay outside: the solver stops at a parameter's bounds, wherever the data pulls."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.effects.base import Effect, param
from postproc.estimation.least_squares import fit_model
from postproc.identification.add import add_effects
from tests.identification.cells import base_fit, cell
from tests.independent import library_effects as kinds


class LostMotion(Effect, reads=("approach",)):
    """Lost motion that cannot be negative. Source: the meaning of a gap. Typical size: 1e-4 rad."""

    gap_rad: np.ndarray = param(unit="rad", shape=(6,), low=0.0, high=0.01, typical=1e-4)

    def displacement(self, state):
        return self.gap_rad * state.approach  # the other way round than lost motion acts


@pytest.mark.parametrize("added", [True, False])
def test_a_sign_that_cannot_be_is_not_fitted(added):
    data, _ = cell(kinds.backlash, seed=962)
    base = base_fit(data)
    if added:
        fit = add_effects(base.model, data, ["lost_motion"], [LostMotion]).fit
    else:
        fit = fit_model(base.model, data, [LostMotion()])
    gap = fit.model.effect("lost_motion").vector()
    assert (gap >= 0.0).all() and fit.rms > 0.9 * base.rms


@pytest.mark.parametrize("name", ["scale", "shape", "title"])
def test_a_parameter_of_a_name_that_every_effect_has_is_told_so(name, tmp_path):
    from postproc.diagnostics import PostprocError
    from postproc.effects.loading import load_effect_file

    text = f'''
from postproc.effects.base import Effect, param


class Own(Effect, reads=("q",)):
    """Something."""

    {name}: float = param(unit="1", low=-1.0, high=1.0, typical=1e-4)

    def displacement(self, state):
        return self.{name} * state.q
'''
    path = tmp_path / "own.py"
    path.write_text(text)
    with pytest.raises(PostprocError) as error:
        load_effect_file(path)
    first = error.value.diagnostics[0]
    assert first.code == "EFF016" and f"`{name}` of `own` has a name that is taken" in first.message
