"""The judge of loads itself: its arms, its tables and its intervals, against closed forms and what the product predicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc import read_model
from postproc.effects.registry import effect_library
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from tests.bench.loads import walk
from tests.bench.loads.arms import arm_type
from tests.bench.loads.judge import asked_state, faults, figures, had, inside, judge_small, rms
from tests.bench.loads.sets import ARMS, FORCES, HIDDEN, Recipe, Set, draw
from tests.independent import arm as A
from tests.independent.cells import measure


def true_model(one: Set) -> Model:
    """The true arm in the product's terms, where nothing is hidden."""
    library, c = effect_library(), one.cell
    turn = c.instrument[:3, :3]
    cosine = (np.trace(turn) - 1) / 2
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    vector = axis / np.linalg.norm(axis) * np.arccos(cosine)
    values = {
        "instrument_frame": np.concatenate([c.instrument[:3, 3], vector]),
        "tool_frame": np.concatenate([c.tool[:3, 3] - one.tool[:3, 3], np.zeros(3)]),
        "joint_offset": c.offset,
        "joint_compliance": c.compliance,
    }
    effects = tuple(library[key].null().with_vector(x) for key, x in values.items())
    return replace(read_model(one.type.name), T_flange_tcp=one.tool, effects=effects)


def test_the_arm_of_a_file_is_the_arm_that_was_written_by_hand() -> None:
    q = np.random.default_rng(1).uniform(-1, 1, (20, 6))
    one, other = arm_type("irb4600_60_205").arm, A.irb4600()
    load, springs = (
        A.Load(30.0, np.array([0.03, 0.02, 0.12]), np.array([200.0, -200, -200])),
        A.joint_springs(A.TABLE_2),
    )
    at = [A.equilibrium(arm, q, A.shift(0.02, -0.01, 0.35), load, springs).frames.tcp for arm in (one, other)]
    assert at[0] == pytest.approx(at[1], abs=1e-12)


@pytest.mark.parametrize("index", range(3))
def test_the_product_with_the_true_numbers_moves_as_the_true_arm(index: int) -> None:
    """Frames, signs, loads and payloads mean the same on both sides: on arms of three sizes to a micrometre."""
    one = draw(index)
    assert one.type.name == ARMS[index] and not one.key
    model = true_model(one)
    at, places = predict(model, asked_state(model, one))[:, :3, 3], measure(one.cell, one.every)
    assert rms(at - places) < 1e-3
    assert rms(one.changes(at) - one.changes(places)) < 1e-3 < 0.01 < rms(one.true_change())


def test_a_change_is_the_compliance_times_the_load() -> None:
    """Of joint 1 alone, without weight: a force across the lever turns the TCP by c r F about the upright axis."""
    one = draw(0)
    arm = replace(one.cell.arm, mass=np.zeros(7))
    bare = replace(one, cell=replace(one.cell, arm=arm), asked=replace(one.asked, mass=np.zeros(len(one.asked))))
    found = bare.true_change(replace(bare.cell, compliance=np.array([1e-7, 0, 0, 0, 0, 0])))[1]
    p = arm.forward(one.asked.q, one.cell.tool, one.cell.offset).tcp[:, :3, 3]
    turn = 1e-7 * p[:, 0] * one.size
    assert found == pytest.approx(np.stack([-turn * p[:, 1], turn * p[:, 0], 0 * turn], axis=1), rel=1e-3, abs=1e-9)


def test_every_kind_of_table_meets_every_arm_and_effect() -> None:
    recipes = [Recipe.of(i) for i in range(48)]
    assert {(r.robot, r.table, bool(r.key)) for r in recipes} == {
        (a, t, h)
        for a in ARMS
        for t in ("one payload", "two payloads", "three payloads", "pulled")
        for h in (False, True)
    }
    assert {r.key for r in recipes} == {"", *HIDDEN} and {r.poses for r in recipes} == {30, 60, 150}
    assert 6 <= sum(r.rounded for r in recipes) <= 12


def test_gravity_tells_nothing_of_joint_1_and_a_pull_does() -> None:
    assert draw(0).told[0] == pytest.approx(1, abs=1e-3) and draw(0).told[1] < 0.1
    assert draw(42).table == "pulled" and draw(42).told[0] < 0.1


def test_a_perfect_fit_is_no_worse_than_the_shipped_model_and_its_intervals_hold() -> None:
    """What is asked of a fit can be had: the posterior mean of the same tables."""
    ratios, held = [], []
    for index in (0, 1, 6, 8, 13, 20):
        one = draw(index)
        true = one.true_change()
        error, share = had(one, one.best, true)
        ratios.append(error / rms(one.true_change(replace(one.cell, compliance=one.type.compliance)) - true))
        held.append(share)
    assert max(ratios) < 1.1 and 0.88 < np.mean(held) < 0.99


def test_a_model_that_is_rigid_where_nothing_told_is_found_worse() -> None:
    one = draw(0)
    model, true, places = true_model(one), one.true_change(), measure(one.cell, one.every)
    shipped = rms(one.true_change(replace(one.cell, compliance=one.type.compliance)) - true)
    seen = one.changes(places)
    springs = model.effect("joint_compliance")
    assert springs is not None
    rigid = model.with_effects(
        *(e.with_vector(e.vector() * [0, 1, 1, 1, 1, 0]) if e is springs else e for e in model.effects)
    )
    for own, worse in ((model, False), (rigid, True)):
        told = {"set": "a", "hidden": "", "told": one.told, "shipped_mm": shipped, "best_mm": 0.0, "base_mm": 0.0}
        told["fitted"] = figures(own, one, seen, places, shipped)
        assert bool(faults(told)) == worse
        assert np.isnan(told["fitted"]["said_mm"]) and inside([told]) == {"fit, nothing hidden": 0.0}
    assert len(told["fitted"]["error_each_load_mm"]) == len(FORCES)


def test_the_walk_is_that_of_the_arm_of_the_sample() -> None:
    assert walk.same_table()
    nothing = walk.deviation(A.TABLE_2 * 0, np.zeros(6), np.zeros(6), walk.FORCE)
    assert nothing["arc_mm"] < 1e-6
    cell = walk.true_cell()
    assert walk.gaps()[1] == pytest.approx(1.1e-4, rel=0.01) and cell.hidden[0].kind == "backlash"


def test_the_shipped_model_deviates_as_the_arm_of_table_2() -> None:
    """The two codes follow the seam of the README alike: what differs later is the model."""
    own = walk.deviation(A.TABLE_2, np.zeros(6), np.zeros(6), walk.FORCE)
    assert walk.said("--robot", "irb4600_60_205")["arc_mm"] == pytest.approx(own["arc_mm"], abs=1e-3)


def test_fitted_models_are_never_worse_under_loads_than_the_shipped_one() -> None:
    assert judge_small() == []


def test_the_walk_of_the_readme_under_a_force_is_right_within_what_it_says() -> None:
    assert walk.judge_walk() == []
