"""Forms of an effect that are screened together, against each by itself through its columns."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.effects.transmission_error import TransmissionError
from postproc.identify.forms import Turned, forms_nearby, forms_of
from postproc.identify.gains import gain, gains
from tests.identify.cells import base_fit, cell
from tests.independent import library_effects as kinds


@pytest.fixture(scope="module")
def fit():
    return base_fit(cell(kinds.backlash, seed=11, poses=40)[0])


def two_lines():
    return TransmissionError(joint=(3, 2), order=(2.0, 1.5))


@pytest.mark.parametrize("ratio", [1.0, 3.0])
@pytest.mark.parametrize("nearby", [False, True])
def test_lines_of_a_gear_gain_joint_by_joint_what_they_gain_by_their_columns(fit, nearby, ratio):
    # A line after one of another joint turns two joints at once.
    forms = forms_nearby(fit.problem, two_lines()) if nearby else forms_of(fit.problem, TransmissionError)
    assert all(isinstance(form.seen, Turned) for form in forms)
    found = gains(fit.linear, forms.times(np.full(len(fit.linear.residual), ratio)))
    for i in range(0, len(forms), 1 if nearby else 97):
        columns = fit.problem.columns(forms[i].effect, forms[i].screened) * ratio * 1e-4
        alone = gain(fit.linear, columns)
        assert found[i].count == alone.count == columns.shape[1]
        assert (found[i].fall, found[i].evidence) == pytest.approx((alone.fall, alone.evidence), rel=1e-9, abs=1e-9)
