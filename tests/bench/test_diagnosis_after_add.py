"""Sets of the scorecard that are judged after `add`: what they hide, where their rows lie, and how they are judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import ks_2samp

from postproc.estimation.recorded import recorded_model
from tests.bench.diagnosis import addition, card
from tests.bench.diagnosis.judge import base_fit
from tests.bench.diagnosis.regions import COUNT, recipe_of, region_of, region_set


def test_regions_are_all_asked_with_and_without_a_law_outside_the_library() -> None:
    every = [(str(region_of(i)), recipe_of(i)) for i in range(COUNT)]
    assert len({region for region, _ in every}) == 24 and len(set(every)) == COUNT
    halves = [{region_set("regions", i).truth.outside for i in (k, k + 24)} for k in range(3)]  # type: ignore[union-attr]
    assert halves == [{True, False}] * 3


@pytest.mark.parametrize("index", [0, 4, 11, 17])
def test_a_region_is_not_measured(index: int) -> None:
    """No row that is fitted, and none beside them, lies in the box of the 150 poses of the region."""
    one = region_set("regions", index)
    away, near = one.true.rows(one.asked["region"]).state.q, one.true.rows(one.asked["near"]).state.q
    joints = list(region_of(index))
    low, high = away[:, joints].min(axis=0), away[:, joints].max(axis=0)
    for q in (one.data.state.q, near):
        assert not ((q[:, joints] >= low) & (q[:, joints] <= high)).all(axis=1).any()
        for j in np.setdiff1d(range(6), joints):  # the other joints are drawn alike on both sides
            assert ks_2samp(q[:, j], away[:, j]).pvalue > 1e-4
    repeated = len(one.data) - len(np.unique(one.data.repeats))
    assert len(away) == len(near) == 150 and repeated == (0 if index == 11 else 24)


@pytest.mark.parametrize(("index", "low", "high"), [(0, 0.8, 1.2), (3, 1.5, 30.0), (8, 1.5, 30.0)])
def test_a_set_hides_what_it_says(index: int, low: float, high: float) -> None:
    """The base fits a table without a law to its noise, and others not; what is asked has no noise."""
    one = region_set("regions", index)
    fit = base_fit(one)
    assert one.noise is not None and low < fit.rms / one.noise < high
    assert bool(one.truth and (one.truth.accept or one.truth.outside)) == (index != 0)
    assert index or addition.error(fit.model, one) < 0.5 * one.noise


def test_where_nothing_is_named_the_first_model_stays() -> None:
    one = region_set("regions", 0)
    found = addition.run(one, true_error=1.0)
    assert found["added"] == "right" and found["word"] == "right" and not found["named"]
    for x in found["asked"].values():
        assert x["improved"] == x["first"] < 0.5 * found["noise"] and x["inside"] > 0.9


def test_an_error_is_told_where_it_is_and_by_what_the_model_states() -> None:
    """Places of the region moved by 1 mm: the error there alone grows, and none of its coordinates lies inside."""
    one = region_set("regions", 0)
    position = one.true.position + 1e-3 * one.asked["region"][:, None]
    moved = replace(one, true=replace(one.true, position=position))
    model = recorded_model(base_fit(one))
    away, near = (addition.compared(model, model, moved, one.asked[where]) for where in ("region", "near"))
    assert away["improved"] == pytest.approx(1e-3, rel=0.02) and away["inside"] == 0.0
    assert near["improved"] < 1e-5 and near["inside"] > 0.9
    assert addition.error(model, moved) == pytest.approx(1e-3 / np.sqrt(2), rel=0.02)


def test_the_table_counts_models_that_became_worse_and_effects_that_were_not_noticed() -> None:
    good = {"rows": 150, "first": 1e-4, "improved": 5e-5, "inside": 0.95, "inside_first": 0.9, "stated": 5e-5, "stated_first": 1e-4}  # fmt: skip
    bad = {**good, "improved": 2e-4, "inside": 0.55}
    common = {"kind": "regions", "half": "outside", "structure": 3.0}
    lines = [
        {**common, "said": "unknown", "asked": {"region": bad, "near": good}},
        {**common, "said": "complete", "asked": {"region": good, "near": good}},
    ]
    text = card.after_add(lines)
    assert "| regions | outside | region | 2 | 1.25 | 2.00 | 1 | 0.75 | 0.55 | 0.90 | 0.62 | 1.00 | 1 of 2 |" in text
    assert "| regions | outside | near | 2 | 0.50 | 0.50 | 0 | 0.95 | 0.95 | 0.90 | 1.00 | 1.00 | 1 of 2 |" in text
