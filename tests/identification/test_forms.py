"""Forms of an effect that are screened together, against each by itself through its columns."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.effects.library.joints.nonlinear_compliance import NonlinearCompliance
from postproc.effects.library.joints.transmission_error import TransmissionError
from postproc.identification.screen.forms import forms_nearby, forms_of, ordinary
from postproc.identification.screen.gain import gain, gains
from tests.identification.cells import base_fit, cell
from tests.independent import library_effects as kinds


@pytest.fixture(scope="module")
def fit():
    return base_fit(cell(kinds.backlash, seed=11, poses=40)[0])


def two_lines():
    return TransmissionError(joint=(3, 2), order=(2.0, 1.5))


@pytest.mark.parametrize("nearby", [False, True])
def test_lines_of_a_gear_gain_together_what_they_gain_by_their_columns(fit, nearby):
    # A line after one of another joint turns two joints at once.
    forms = forms_nearby(fit.problem, two_lines(), 2) if nearby else forms_of(fit.problem, TransmissionError)
    found = gains(fit.linear, forms)
    for i in range(0, len(forms), 1 if nearby else 97):
        columns = fit.problem.columns(forms[i].effect, forms[i].screened) * 1e-4
        np.testing.assert_allclose(forms[i].columns, columns, rtol=1e-9, atol=1e-12)
        alone = gain(fit.linear, columns)
        assert found.of(i).count == alone.count == columns.shape[1]
        assert (found.of(i).fall, found.of(i).evidence) == pytest.approx(
            (alone.fall, alone.evidence), rel=1e-9, abs=1e-9
        )


def test_a_form_keeps_its_columns_beside_others_of_its_width(fit):
    for form in forms_of(fit.problem, NonlinearCompliance)[::23]:
        size = ordinary(fit.model, form.effect, form.screened)
        expected = fit.problem.columns(form.effect, form.screened) * size
        np.testing.assert_allclose(form.columns, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
