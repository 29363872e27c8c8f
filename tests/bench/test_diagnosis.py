"""Sets of the scorecard that must be answered rightly, and what counts them."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from postproc.channels.state import State
from postproc.identification.planning.plan import MeasuringPlan
from tests.bench.diagnosis import card, plans, rules
from tests.bench.diagnosis.judge import base_fit, judge, run
from tests.bench.diagnosis.real import held_out
from tests.bench.diagnosis.sets import KINDS, Recipe, Truth, cell_set, drawn, seed_of

BACKLASH = Truth((("backlash",),))
SEEN = {"x", "y", "z", "distance", "elevation", "azimuth"}
PAIR = Truth((("backlash",), ("arm_load", "payload_error")))
LAW = Truth((), True, frozenset({"q2"}), frozenset({"joint_error_map"}))


@pytest.mark.parametrize(("kind", "index"), [("few", 12), ("arms", 3)])
def test_sets_are_answered_as_they_should_be(kind: str, index: int) -> None:
    """An effect of few poses, which a level of 1 in 1000 misses, and one of another arm."""
    found = run(drawn(kind, index, KINDS[kind][1](index), seed_of(kind, index)), true_error=0.0)
    assert found["word"] == "right", found


def test_nothing_is_named_beside_a_track_and_a_table_that_are_right() -> None:
    one = cell_set("clean cell", 13)
    found = run(one, true_error=0.0)
    assert found["word"] == "right" and not found["named"], found
    assert one.noise is not None and found["after"] < 0.7 * one.noise


def test_the_scale_of_a_tracker_is_none_of_the_track() -> None:
    """Distances of 4 m and more along a track, 60 parts in a million too long: the points say so, not the axis."""
    one = cell_set("clean cell", 7)
    found = run(replace(one, data=replace(one.data, position=one.data.position * (1 + 6e-5))), true_error=0.0)
    assert found["said"] == "unknown" and not found["named"] and set(found["suspects"][:3]) <= SEEN


@pytest.mark.parametrize(
    ("truth", "said", "named", "alike", "suspects", "word"),
    [
        (BACKLASH, "missing", ["backlash"], [[]], [], "right"),
        (BACKLASH, "missing", ["servo_lag"], [["backlash"]], [], "inseparable"),
        (BACKLASH, "missing", ["servo_lag"], [[]], [], "wrong"),
        (BACKLASH, "missing", ["backlash", "servo_lag"], [[], []], [], "needless"),
        (BACKLASH, "complete", [], [], [], "missed"),
        (BACKLASH, "unknown", [], [], ["q2"], "abstained"),
        (PAIR, "missing", ["payload_error"], [[]], [], "part"),
        (PAIR, "missing", ["payload_error", "backlash"], [[], []], [], "right"),
        (LAW, "unknown", [], [], ["q1", "q2"], "right"),
        (LAW, "unknown", [], [], ["q1", "q3"], "wrong channel"),
        (LAW, "missing", ["joint_error_map"], [[]], [], "right"),
        (LAW, "complete", [], [], [], "missed"),
        (LAW, "unknown", ["backlash"], [[]], ["q2"], "needless"),
        (Truth(), "complete", [], [], [], "right"),
        (Truth(), "unknown", [], [], ["q1"], "false alarm"),
        (Truth(), "missing", ["backlash"], [[]], [], "false alarm"),
    ],
)
def test_what_an_answer_is_worth(truth, said, named, alike, suspects, word) -> None:
    assert judge(truth, said, named, alike, suspects)["word"] == word


def test_of_equal_lines_the_last_counts_and_every_part_of_the_page_is_filled(tmp_path) -> None:
    common = {"kind": "library", "index": 0, "method": "postproc", "without": "", "label": "a", "set": "library: backlash #0"}  # fmt: skip
    first = {**common, "word": "wrong", "diagnose_s": 1.0, "named": ["servo_lag"], "hits": [False], "evidence": [9.2]}
    last = {**first, "word": "right", "named": ["backlash"], "hits": [True], "after": 1e-5, "noise": 2e-5}
    path = tmp_path / "results.jsonl"
    path.write_text("\n".join(json.dumps(x) for x in (first, last, {**first, "label": "b"})))
    every = card.read(path)
    assert [x["word"] for x in every] == ["right", "wrong"]
    text = card.page(every, "a")
    assert "{" not in text and "| library | 1 | 1 |" in text and "| 10:1 to 100:1 | 1 | 0.990 | 1.000 |" in text
    assert "| `b` | 1 | 1 | 0 | 1 | 0 | 1.00 |" in card.compared(every, "a", "b")
    assert "library: backlash #0" in card.misses([first]) and "library: backlash #0" not in card.misses([last])


def test_a_rule_is_off_within_and_on_again_after() -> None:
    from postproc.identification import search

    own = search.predicts_better
    with rules.without("held_out+row"):
        assert search.predicts_better is not own and search.predicts_better(None, None, 2.0)
    assert search.predicts_better is own
    with pytest.raises(KeyError), rules.without("no such rule"):
        pass


@pytest.mark.parametrize("rule", rules.RULES)
def test_every_rule_is_one_of_the_product(rule: str) -> None:
    with rules.without(rule):
        pass


def test_rows_of_a_real_table_that_no_fit_reaches_are_told_apart() -> None:
    """A reading 3 mm off, held out, lies as far off where the model was fitted to it; one row turns joint 1 beyond all."""
    one = drawn("clean", 0, Recipe(poses=90), 4_242)
    data, held = one.data, np.arange(len(one.data)) % 5 == 0
    data.position[np.flatnonzero(held)[3]] += [0.0, 0.003, 0.0]
    q = data.state.q[~held, 0]
    beyond = held & ((data.state.q[:, 0] < q.min()) | (data.state.q[:, 0] > q.max()))
    found = held_out(base_fit(one, data.rows(~held)), data.rows(held), data)
    assert found["held"][1] == held.sum() and found["held_reached"][1] == held.sum() - 1
    assert found["held_among"][1] <= held.sum() - 1 - beyond.sum()
    assert found["held"][0] > 5 * found["held_reached"][0] and found["held_median"] < 2e-4
    lines = [{"kind": "real", "set": f"real: arm #{k}", "before": 1e-4, "named": ["backlash"], **found} for k in (0, 1)]
    assert f"({2 * held.sum() - 2})" in card.real(lines) and "`backlash` 2" in card.real(lines)


def test_promises_of_plans_are_counted_against_what_was_kept() -> None:
    def circle(told_apart: int, kept: list[bool], sigmas: float, **more: object) -> dict[str, object]:
        return {"tables": 20, "told_apart": told_apart, "kept": kept, "sigmas": sigmas, "plan_s": 9.0, **more}

    advised = {"advice_tables": 20, "advice_told_apart": 18, "advice_kept": [True, True]}
    text = plans.summary(
        [circle(20, [True, True], 3.0), circle(8, [True, False], 50.0), circle(0, [False] * 2, 0.1, **advised)]
    )
    assert "| 0.9 to 1.0 | 1 | 1.00 | 1.00 |" in text and "| all | 3 | 0.467 | 0.500 |" in text
    assert "calibration -0.033" in text and "advice: 1 circles, promised 0.900, kept 1.000" in text
    assert "distance of 5 standard deviations: 1 circles, kept 0.5; below: 2, kept 1.0" in text


def test_the_poses_of_a_plan_are_measured_on_the_cell_of_the_first_table() -> None:
    first, count = plans.first_table(30)
    assert set(first.states.mass) <= set(plans.LIGHT) and count in plans.PLANNED and first.key == "gravity_compensator"
    n = 4
    state = State(np.zeros((n, 6)), approach=np.ones((n, 6)), wrench=np.tile([0.0, 300.0, 0.0, 0.0, 0.0, 0.0], (n, 1)))
    fit = base_fit(drawn("clean", 2, Recipe(poses=40), 7))
    plan = MeasuringPlan(fit, state, np.tile(np.eye(4), (n, 1, 1)), None, 0.0, 0.0)
    lines = first.planned(plan, np.random.default_rng(0)).data.decode().splitlines()
    assert lines[0].endswith(",fx_N,fy_N,fz_N") and len(lines) == n + 1 and lines[1].endswith(",0,300,0")
    still = replace(plan, state=state.with_(wrench=None))
    places = [
        np.loadtxt(
            first.planned(p, np.random.default_rng(0)).data.decode().splitlines(),
            delimiter=",",
            skiprows=1,
            usecols=(7, 8, 9),
        )
        for p in (plan, still)
    ]
    assert 0.05 < np.linalg.norm(places[0] - places[1], axis=1).mean() < 10.0  # springs yield to 300 N
