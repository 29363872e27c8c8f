"""Sets of the scorecard that are judged after `add`: what they hide, where their rows lie, and how they are judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import ks_2samp

from postproc.diagnostics import PostprocError
from postproc.estimation.recorded import recorded_model
from postproc.identification.predict import Prediction, predict_rows
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from tests.bench.diagnosis import addition, card, octants
from tests.bench.diagnosis.in_order import KINDS as HISTORIES
from tests.bench.diagnosis.in_order import history, ordered_set
from tests.bench.diagnosis.in_order import recipe_of as recipe_in_order
from tests.bench.diagnosis.judge import base_fit
from tests.bench.diagnosis.regions import COUNT, recipe_of, region_of, region_set
from tests.bench.diagnosis.sets import Set
from tests.independent import arm as A
from tests.independent import history as H
from tests.independent.hidden_effects import Kind

ROOT = Path(__file__).parents[2]


def test_regions_are_all_asked_with_and_without_a_law_outside_the_library() -> None:
    every = [(str(region_of(i)), recipe_of(i)) for i in range(COUNT)]
    assert len({region for region, _ in every}) == 24 and len(set(every)) == COUNT
    halves = [{region_set("regions", i).truth.outside for i in (k, k + 24)} for k in range(3)]
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


@pytest.mark.parametrize(("kind", "index"), [("memory", 0), ("memory", 3), ("slips and cycles", 4), ("slips and cycles", 18), ("directions missing", 7), ("memory", 26)])  # fmt: skip
def test_what_is_asked_lies_in_the_same_history(kind: str, index: int) -> None:
    """Visits that nobody measured lie between the rows of the table or after them; all that were measured are there."""
    one, recipe = ordered_set(kind, index), recipe_in_order(kind, index)
    asked, q = one.asked["unseen"], one.true.state.q
    table = np.flatnonzero(~asked)
    assert asked.sum() == 150 and (table.max() < 150 + len(table) - 150) == recipe.after
    assert (np.median(np.flatnonzero(asked)) > np.median(table) + 100) == recipe.after
    np.testing.assert_array_equal(one.data.state.q, q[table])
    assert 0.5 < np.std(one.data.position - one.true.position[table]) / (one.noise or 0.0) < 1.5
    assert len(one.data) - len(np.unique(one.data.pose_id)) == 24
    assert not {row.tobytes() for row in q[asked]} & {row.tobytes() for row in one.data.state.q}
    stated = one.data.state.approach is not None and not one.data.sides_from
    assert stated == (kind != "directions missing")
    assert (one.data.state.time is None) == ("time_s" in recipe.without)
    assert ("cycle" in one.data.state.channels) == recipe.cycle


@pytest.mark.parametrize(("kind", "laws"), [("memory", 8), ("slips and cycles", 5), ("directions missing", 4)])
def test_every_law_of_a_history_comes_with_repeats_of_one_visit_and_of_others(kind: str, laws: int) -> None:
    every = [recipe_in_order(kind, i) for i in range(HISTORIES[kind])]
    every, clean = every[:24], every[24:]
    assert [r.law for r in clean] == [None] * 4 and len({r.law for r in every}) == laws
    assert len({(r.law, r.later) for r in every}) == 2 * laws


def test_lost_motion_is_on_the_side_that_the_row_before_tells() -> None:
    """By their own joint angles alone the rows of a table tell where a hidden gap stands."""
    g, arm = np.random.default_rng(5), A.irb4600()
    s = history(g, np.array([0, 1, 1, 2, 3, 0, 4]), arm, 0.0, 3)
    for before, row in zip(range(6), range(1, 7), strict=True):
        moved = s.q[row] != s.q[before]
        expected = np.where(moved, np.sign(s.q[row] - s.q[before]), s.approach[before])
        np.testing.assert_array_equal(s.approach[row], expected)
    hidden = H.lost_motion_of_two(g, arm).joint
    assert hidden is not None
    gap = hidden(s, np.zeros((7, 6)))
    assert (np.abs(gap) > 0).any(axis=0).sum() == 2 and np.array_equal(np.sign(gap[2]), np.sign(gap[1]))


def test_a_lag_follows_a_swing_as_the_formula_says() -> None:
    """x = sin(w t) is followed by (sin(w t) - w T cos(w t) + w T exp(-t / T)) / (1 + (w T)^2)."""
    t, w, T = np.linspace(0, 20_000, 400), 2 * np.pi / 9000, 1500.0
    formula = (np.sin(w * t) - w * T * np.cos(w * t) + w * T * np.exp(-t / T)) / (1 + (w * T) ** 2)
    assert np.abs(H.lagged(np.sin(w * t), t, T) - formula).max() < 1e-3


@pytest.mark.parametrize("law", [H.play, H.preisach])
def test_a_hysteresis_closes_and_stands_where_it_turns(law: Kind) -> None:
    """The same angle reached from below and from above differs, a loop that is run again is the same."""
    g, arm = np.random.default_rng(3), A.irb4600()
    up = np.linspace(-1.6, 1.6, 81)
    q = np.tile(np.concatenate([up, up[-2:0:-1]]), 2)
    s = history(g, np.arange(len(q)), arm, 0.0, 1)
    joint = law(g, arm).joint
    assert joint is not None
    off = joint(replace(s, q=np.tile(q[:, None], 6)), np.zeros((len(q), 6))).sum(axis=1)
    first, again = np.split(off, 2)
    # Play tells how far a joint is ahead of what it drags along, relays how many of them are up.
    assert off.max() > 1e-4 and (again[40] - again[120]) * (1 if law is H.play else -1) > 1e-5
    np.testing.assert_allclose(first[80:], again[80:], atol=1e-12)


def test_creep_comes_with_the_time_that_a_load_stays() -> None:
    g, arm = np.random.default_rng(4), A.irb4600()
    s = history(g, np.arange(200), arm, 0.0, 1)
    joint = H.creep(g, arm).joint
    assert joint is not None
    off = joint(s, np.ones((200, 6))).sum(axis=1)
    time, share = s.time[1:11] - s.time[0], off[1:11] / off[-1]
    assert off[0] == 0.0
    np.testing.assert_allclose(-time / np.log1p(-share), -time[0] / np.log1p(-share[0]), rtol=1e-3)


def test_where_nothing_is_named_the_first_model_stays() -> None:
    one = region_set("regions", 0)
    found = addition.run(one, true_error=1.0)
    assert found["added"] == "right" and found["word"] == "right" and not found["named"]
    for x in found["asked"].values():
        assert x["improved"] == x["first"] < 0.5 * found["noise"] and x["inside"] > 0.9


def test_where_predict_refuses_the_improved_model_the_first_one_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    def refusing(model: Model, data: Measurements) -> Prediction:
        if model.effect("backlash") is not None and "DAT034" not in data.accepted:
            raise PostprocError.of("DAT034", "of another session", data.source)
        return predict_rows(model, data)

    monkeypatch.setattr(addition, "predict_rows", refusing)
    found = addition.run(region_set("regions", 2), true_error=1.0)
    assert found["named"] == ["backlash"] and found["added"] == "declined DAT034"
    for where, x in found["asked"].items():
        assert x["improved"] == x["first"] > 5 * found["accepted"][where]["improved"]


@pytest.mark.parametrize(("factor", "word"), [(1.05, "right"), (1.15, "worse outside")])
def test_a_model_that_is_a_tenth_worse_is_called_so(factor: float, word: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Here in the region alone, beside which the error is the same."""
    one = region_set("regions", 0)

    def figures(first: Model, improved: Model, asked: Set, rows: np.ndarray) -> dict[str, float]:
        return {"first": 1e-4, "improved": 1e-4 * (factor if rows is one.asked["region"] else 1.0)}

    monkeypatch.setattr(addition, "compared", figures)
    assert addition.run(one, true_error=1.0)["added"] == word


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


def test_octants_part_a_real_table_and_are_counted_in_one_row() -> None:
    """Every row is in one octant, none that is fitted lies in it; errors of all octants are weighed by their rows."""
    every = [octants.octant_set(2 * k + 1, ROOT / "samples" / "measurements") for k in range(8)]
    held = sorted(row for one in every for row in one.true.row)
    assert held == sorted(every[0].whole.row)
    for k, one in enumerate(every):
        middle = np.median(one.whole.state.q, axis=0)
        signs = [bool(k >> j & 1) for j in range(3)]
        inside = [((q[:, :3] > middle[:3]) == signs).all(axis=1) for q in (one.true.state.q, one.data.state.q)]
        assert inside[0].all() and not inside[1].any() and len(one.true) + len(one.data) == len(held)
    lines = [
        {"kind": "octants", "set": "octants: arm ---", "held": [40, 30], "first": [1e-4, 2e-4, 0.9], "improved": [5e-5, 6e-5, 1.0], "named": ["backlash"]},
        {"kind": "octants", "set": "octants: arm +--", "held": [90, 90], "first": [3e-4, 2e-4, 0.5], "improved": [5e-5, 6e-5, 0.8], "named": []},
        {"kind": "octants", "set": "octants: arm -+-", "held": [2, 0]},
    ]  # fmt: skip
    text = card.octants(lines)
    assert "| arm | --- | 30 of 40 | 0.100 | 0.200 | 0.90 | 0.050 | 0.060 | 1.00 | backlash |" in text
    assert "| arm | all | 120 of 130 | 0.265 | 0.200 | 0.60 | 0.050 | 0.060 | 0.85 |  |" in text


def test_the_table_counts_models_that_became_worse_and_effects_that_were_not_noticed() -> None:
    good = {"rows": 150, "first": 1e-4, "improved": 5e-5, "inside": 0.95, "inside_first": 0.9, "stated": 5e-5, "stated_first": 1e-4}  # fmt: skip
    bad = {**good, "improved": 2e-4, "inside": 0.55}
    common = {"kind": "regions", "half": "outside", "structure": 3.0, "added": "right"}
    lines = [
        {**common, "said": "unknown", "asked": {"region": bad, "near": good}},
        {**common, "said": "complete", "asked": {"region": good, "near": good}, "added": "declined DAT034"},
    ]
    text = card.after_add(lines)
    assert (
        "| regions | outside | region | 2 | 1 | 1.25 | 2.00 | 1 | 0.75 | 0.55 | 0.90 | 0.62 | 1.00 | 1 of 2 |" in text
    )
    assert "| regions | outside | near | 2 | 1 | 0.50 | 0.50 | 0 | 0.95 | 0.95 | 0.90 | 1.00 | 1.00 | 1 of 2 |" in text
