"""Forms of an effect that are screened together, against each by itself through its columns."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.effects.library.joints.nonlinear_compliance import NonlinearCompliance
from postproc.effects.library.joints.transmission_error import TransmissionError
from postproc.identify.candidates.forms import Turned, forms_nearby, forms_of, ordinary
from postproc.identify.evidence import gain, gains
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
    forms = forms_nearby(fit.problem, two_lines(), 2) if nearby else forms_of(fit.problem, TransmissionError)
    assert all(isinstance(form.seen, Turned) for form in forms)
    found = gains(fit.linear, forms.times(np.full(len(fit.linear.residual), ratio)))
    for i in range(0, len(forms), 1 if nearby else 97):
        columns = fit.problem.columns(forms[i].effect, forms[i].screened) * ratio * 1e-4
        alone = gain(fit.linear, columns)
        assert found[i].count == alone.count == columns.shape[1]
        assert (found[i].fall, found[i].evidence) == pytest.approx((alone.fall, alone.evidence), rel=1e-9, abs=1e-9)


def test_forms_of_one_law_share_columns_that_are_worked_out_once(fit, monkeypatch):
    forms = forms_of(fit.problem, NonlinearCompliance)
    for form in forms[::23]:
        size = ordinary(fit.model, form.effect, form.screened)
        expected = fit.problem.columns(form.effect, form.screened) * size
        np.testing.assert_allclose(form.columns, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
    asked = []
    columns = type(fit.problem).columns
    monkeypatch.setattr(
        type(fit.problem), "columns", lambda self, e, mask: (asked.append(mask.sum()), columns(self, e, mask))[1]
    )
    forms_of(fit.problem, NonlinearCompliance)
    assert sum(asked) < 0.6 * sum(form.width for form in forms)
