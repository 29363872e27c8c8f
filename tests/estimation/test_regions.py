"""What a fit is worth in parts of the joint space that were left out, against plain least squares and known functions."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from postproc import text as text_of
from postproc.effects.registry import effect_library
from postproc.estimation.held_out import OPEN, without_block
from postproc.estimation.least_squares import fit_model
from postproc.estimation.recorded import recorded_model
from postproc.estimation.solving.settle import settled
from postproc.estimation.validation.lacking import RestrictedLikelihood, lacking_field
from postproc.estimation.validation.regions import HeldOutRegion, judged_by_regions, parts_of_range
from postproc.identification.add import add_effects
from postproc.identification.regions import with_regions
from postproc.measure.errors import rms
from postproc.measure.measurements import Measurements
from postproc.model.uncertainty.field import Field
from postproc.model.uncertainty.prediction import predict_sigma
from postproc.results.improve.diagnosis import diagnosis_values
from tests.identification.cells import base_fit, cell, hidden_found
from tests.independent import library_effects as kinds
from tests.independent import unknown_effects as strange

NOISE = 3e-5
G = np.random.default_rng(5)


def test_errors_of_a_part_left_out_and_their_covariance_are_those_of_a_fit_to_the_rest():
    A, y, at = G.normal(size=(40, 5)), G.normal(size=40), np.arange(40) < 12
    e, known = without_block(y, np.linalg.qr(A)[0], at)
    x = np.linalg.lstsq(A[~at], y[~at], rcond=None)[0]
    np.testing.assert_allclose(e, y[at] - A[at] @ x, atol=1e-10)
    np.testing.assert_allclose(known @ known.T, A[at] @ np.linalg.inv(A[~at].T @ A[~at]) @ A[at].T, atol=1e-9)


def test_what_the_rest_does_not_determine_is_open():
    A, at = np.vstack([np.eye(3), np.eye(3)[:2]]), np.array([False, False, True, False, False])
    _, known = without_block(np.ones(5), np.linalg.qr(A)[0], at)
    assert float(np.sum(known**2)) == pytest.approx(OPEN, rel=1e-6)


def test_the_derivative_of_the_restricted_likelihood_is_that_of_central_differences():
    x, y, columns = G.normal(size=(25, 4)), G.normal(size=75), G.normal(size=(75, 6))
    likelihood, t, step = (
        RestrictedLikelihood.of(y, np.column_stack([columns, columns[:, 0]]), x),
        G.normal(size=5),
        1e-5,
    )
    assert likelihood.freedom == 69
    numeric = [(likelihood.cost(t + e)[0] - likelihood.cost(t - e)[0]) / (2 * step) for e in step * np.eye(5)]
    np.testing.assert_allclose(likelihood.cost(t)[1], numeric, rtol=1e-5, atol=1e-6)


def test_the_restricted_likelihood_is_that_of_contrasts():
    """Of numbers in which no parameter shows, by a plain normal density, up to a constant."""
    x, y, columns = G.normal(size=(15, 3)), G.normal(size=30), G.normal(size=(30, 4))
    likelihood = RestrictedLikelihood.of(y, columns, x)
    contrasts = np.linalg.svd(columns)[0][:, 4:]
    z = contrasts.T @ y

    def plain(t):
        a, lengths = np.exp(t[0]), np.exp(t[1:])
        V = np.eye(15) + a * np.exp(-0.5 * np.sum(((x[:, None] - x) / lengths) ** 2, axis=2))
        C = contrasts.T @ np.kron(V, np.eye(2)) @ contrasts
        square = z @ np.linalg.solve(C, z)
        prior = -0.5 * t[1:] @ t[1:] + t[0] - 2 * np.log1p(a)
        return 0.5 * len(z) * np.log(square) + 0.5 * np.linalg.slogdet(C)[1] - prior, square / len(z)

    first, second = G.normal(size=(2, 4))
    difference = likelihood.cost(first)[0] - likelihood.cost(second)[0]
    assert difference == pytest.approx(plain(first)[0] - plain(second)[0], abs=1e-8)
    assert likelihood.noise(first) == pytest.approx(plain(first)[1])


def following(data: Measurements, size: float, lengths: np.ndarray, seed: int) -> Measurements:
    """Positions moved along each axis by a draw of a Gaussian process of the joint angles."""
    x = data.state.q / lengths
    covariance = np.exp(-0.5 * np.sum((x[:, None] - x) ** 2, axis=2))
    lower = np.linalg.cholesky(covariance + 1e-9 * np.eye(len(x)))
    return replace(data, position=data.position + size * lower @ np.random.default_rng(seed).normal(size=(len(x), 3)))


def test_a_smooth_function_that_is_lacking_is_found_with_its_size_and_its_lengths():
    lengths = np.array([0.8, 0.6, 9.0, 9.0, 9.0, 9.0])
    found = [lacking_field(base_fit(following(cell(seed=s, poses=150)[0], 2e-4, lengths, s))) for s in (31, 32, 33)]
    assert all(one is not None for one in found)
    sizes, told = [s for _, s in found], np.array([field.lengths[:6] for field, _ in found])
    assert np.median(sizes) == pytest.approx(2e-4, rel=0.35)
    typical = np.median(told, axis=0)
    assert set(np.argsort(typical)[:2].tolist()) == {0, 1} and typical[:2] == pytest.approx([0.8, 0.6], rel=0.5)


def test_nothing_is_said_of_few_rows():
    assert lacking_field(base_fit(cell(seed=31, poses=25)[0].rows(np.arange(25)))) is None


def test_the_parts_are_the_quarters_at_both_ends_of_the_joints_that_matter():
    state = cell(seed=31)[0].state
    field = Field(tuple(f"q{j + 1}" for j in range(6)), np.array([9.0, 0.1, 9.0, 9.0, 9.0, 9.0]), state.q, 0.1)
    low, high = parts_of_range(field, state, 2)
    q = state.q[:, 1]
    assert q[low].max() < np.quantile(q, 0.26) and q[high].min() > np.quantile(q, 0.74)
    assert low.sum() == pytest.approx(len(q) / 4, abs=2) and not (low & high).any()


def judged(before: float, after: float) -> tuple[float, float, bool]:
    """Deviations [m] lacking before and beyond, and the verdict, of errors so large where a quarter was left out."""
    fit = base_fit(cell(seed=31, poses=120)[0])
    field, _ = lacking_field(fit)
    masks, n = parts_of_range(field, fit.data.state, 4), len(fit.data)
    x = fit.data.state.q / 0.7
    smooth = np.linalg.cholesky(np.exp(-0.5 * np.sum((x[:, None] - x) ** 2, axis=2)) + 1e-6 * np.eye(n))
    waves = smooth @ np.random.default_rng(3).normal(size=(n, 3))
    noise = np.random.default_rng(4).normal(0, fit.rms, (n, 3))
    errors = (before * waves + noise, after * waves + noise)
    parts = [HeldOutRegion(mask, *errors, np.flatnonzero(mask), np.zeros((mask.sum(), 3, 0))) for mask in masks]
    found = judged_by_regions(fit, (replace(field, lengths=np.full(len(field.lengths), 0.7)), before), parts)
    assert rms(found.after) == pytest.approx(np.hypot(after, fit.rms), rel=0.4)
    return found.lacking, found.beyond, found.helps


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_what_still_lacks_where_nobody_measured_is_told_by_the_parts_left_out(share):
    lacking, beyond, helps = judged(3e-4, share * 3e-4)
    assert beyond == pytest.approx(share * lacking, rel=0.3, abs=0.1 * lacking) and beyond <= lacking
    assert helps is (share < 1.0)


def test_a_law_that_is_true_is_sure_everywhere():
    data, true = cell(kinds.backlash, seed=211, poses=120)
    added = add_effects(base_fit(data).model, data, ["backlash"])
    regions = added.fit.regions
    assert regions is not None and regions.helps and regions.surest is None
    assert regions.lacking > 3 * NOISE and regions.beyond < 0.3 * NOISE
    assert np.median(predict_sigma(added.model, true.state)) < 0.5 * NOISE
    assert "local" not in added.model.fit


def test_a_law_outside_the_library_is_unknown_with_its_channel_and_its_error():
    found = hidden_found(strange.angle_step, seed=401, poses=80)
    first = found.remaining[0]
    assert found.verdict == "unknown" and first.where == f"joint {first.channel[1]}"
    assert found.regions is not None and not found.misleading
    before, after = (rms(error) for error in (found.regions.before, found.regions.after))
    assert 0.8 * found.floor < after < 2 * found.floor < 0.7 * before
    values = diagnosis_values(found)
    assert 1e3 * after == pytest.approx(values["rms_mm_unnamed"], abs=1e-5)
    assert 1e3 * before == pytest.approx(values["rms_mm_unnamed_before"], abs=1e-5)
    table = text_of(found).split("The error on rows that the fit has not seen")[1].splitlines()
    assert re.match(rf" *\+ what was found, without a name +{1e3 * after:.3f}", table[2])
    assert "in parts of the joint space left out, searched anew; without it" in table[2]


def test_a_curve_is_searched_anew_without_each_part(monkeypatch):
    """The error of a curve is that of parts that its choice has not seen, not that of all rows."""
    fit = hidden_found(strange.angle_step, seed=401, poses=80).model
    data, base = fit.data, base_fit(cell(strange.angle_step, seed=401, poses=80)[0])
    assert fit.regions is not None and fit.unseen_rms == rms(fit.regions.after) < 0.5 * rms(fit.regions.before)
    assert 0.8 * NOISE < fit.unseen_rms < 1.5 * NOISE
    seen = []
    monkeypatch.setattr(
        "postproc.identification.regions.with_curves_anew", lambda state, most: seen.append(state) or state
    )
    blind = with_regions(fit, base, searched=1).regions
    assert blind is not None and len(seen) == 4 and {len(s.fit.data) for s in seen} < set(range(len(data)))
    # A search that finds nothing leaves the model before, and the curve holds near the rows alone.
    assert not blind.helps and rms(blind.after) == rms(blind.before) and blind.surest is not None
    model = recorded_model(replace(fit, regions=blind))
    assert model.fit["local"] == ["curve"] and model.surest is blind.surest
    assert model.fit["surest"].keys() == {e.key for e in settled(base).model.effects}


def test_an_effect_of_fixed_form_is_not_searched_anew(monkeypatch):
    data, _ = cell(kinds.backlash, seed=211, poses=120)
    base = base_fit(data)
    fit = fit_model(base.model, data, [effect_library()["backlash"].null()])
    monkeypatch.setattr("postproc.identification.regions.with_curves_anew", lambda state, most: pytest.fail("searched"))
    regions = with_regions(fit, base).regions
    assert regions is not None and regions.helps and rms(regions.after) < 1.3 * NOISE
