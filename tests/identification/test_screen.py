"""Places of the arm, what a curve explains there, and which of the suspects are reported."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from postproc.effects.library.curve import ChannelCurve
from postproc.effects.terms import PLACES
from postproc.estimation.linear import Linear
from postproc.identification.curves.families import CurveForms, curve_forms
from postproc.identification.curves.form import block
from postproc.identification.curves.prior import ROOMS, sort_of_place
from postproc.identification.screen.curves import CurveScreen
from postproc.identification.screen.place import Place
from postproc.identification.screen.suspects import Suspect, by_channel, places
from postproc.model.equilibrium import predict
from tests.identification.cells import base_fit, cell, law, table
from tests.independent.cells import Hidden, column


def residual(columns: np.ndarray, y: np.ndarray) -> float:
    return float(np.sum((y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]) ** 2))


@pytest.mark.parametrize("gaps", [False, True])
@pytest.mark.parametrize(("moves", "numbers"), [(1, 3), (3, 3), (3, 6)])
def test_a_curve_takes_off_what_least_squares_with_its_columns_do(moves, numbers, gaps):
    g = np.random.default_rng(moves)
    row = np.repeat(np.arange(40), numbers)
    row = row[g.uniform(size=len(row)) > 0.2] if gaps else row
    fitted, columns, y = g.normal(size=(len(row), 4)), g.normal(size=(len(row), moves)), g.normal(size=len(row))
    values = g.normal(size=(40, 5))
    expected = [
        residual(fitted, y) - residual(np.hstack([fitted, columns * values[row, k, None]]), y) for k in range(5)
    ]
    found = Place(Linear(y, np.linalg.qr(fitted)[0], row), columns).falls(values.astype(np.float32))
    assert_allclose(found, expected, rtol=1e-4)


def test_every_place_is_counted_in_its_sort():
    count = Counter(map(sort_of_place, PLACES))
    assert {None: len(PLACES), **{kind: count[kind] for kind in ROOMS if kind is not None}} == ROOMS


def with_orientations(seed: int):
    data, _ = cell(seed=seed, noise=0.02, poses=60)
    return base_fit(replace(data, rotation=predict(base_fit(data).model, data.state)[:, :3, :3]))


def test_a_place_moves_what_is_measured_as_the_model_foretells():
    """Central differences of the whole arm; weights bend its springs."""
    fit = with_orientations(311)
    model, state, site = fit.model, fit.problem.sensitivity.state, fit.problem.site
    for place, moves in places(fit.problem).items():
        null = ChannelCurve.null(place=(place,), channels=("1",), point_m=site.point, instrument_m_rad=site.instrument)
        for k in range(moves.shape[2]):
            step = np.zeros(moves.shape[2])
            step[k] = 0.1 * null.scale()[k]
            high, low = (
                predict(model.with_effects(*model.effects, null.with_vector(way * step)), state)[:, :3, 3]
                for way in (1, -1)
            )
            expected = (high - low) / (2 * step[k])
            assert_allclose(moves[:, :3, k], expected, atol=0.02 * np.abs(expected).max() + 1e-9, err_msg=place)
    assert set(places(fit.problem)) == set(PLACES)


@pytest.mark.parametrize(
    ("place", "constant"),
    [
        ("instrument, shifted and turned", False),
        ("tool, shifted and turned", False),
        ("body 4, shifted", True),
        ("body 5, shifted", True),
    ],
)
def test_what_shifts_and_turns_is_told_at_its_own_place(place, constant):
    """By the side of a load or a door, and bodies by a constant as well, which says nothing about the side."""
    fit = with_orientations(314)
    side = np.where(np.arange(len(fit.data)) % 3 == 0, 1.0, 0.0)
    moves = places(fit.problem)[place]
    moved = moves @ np.array([1e-4, -2e-4, 1e-4, 4e-4, 3e-4, -3e-4])[: moves.shape[2]]
    noise = np.random.default_rng(1).normal(size=len(fit.problem.row))
    y = fit.problem.whiten((moved * (side + constant)[:, None])[:, :, None])[:, 0] + noise
    linear = replace(fit.linear, residual=y)
    forms = curve_forms(table(door=side), fit.problem.site, seen=False)
    first = CurveScreen(fit.problem, linear, forms).suspects()[0]
    assert first.where == place and first.evidence > 0
    assert linear.extended(first.columns(fit.problem)).square < 1.2 * len(y)


def test_a_channel_that_goes_with_the_first_one_is_reported_beside_it():
    """A hall that warms up all the time: temperature or time, this data cannot say."""
    fit = base_fit(cell(seed=313, noise=0.02, poses=60)[0])
    time = np.linspace(0.0, 7200.0, len(fit.data))
    warm, other = 20.0 + np.sqrt(time), np.random.default_rng(2).normal(size=len(time))
    turned = fit.problem.whiten(places(fit.problem)["joint 4"])[:, 0] * 4e-4 * ((warm - 20.0) / 50.0)[fit.problem.row]
    linear = replace(fit.linear, residual=turned + np.random.default_rng(1).normal(size=len(turned)))
    lines = CurveForms([block(*law(n, v).factors[0]) for n, v in (("temperature", warm), ("time", time), ("x", other))])
    first, second, *others = by_channel(CurveScreen(fit.problem, linear, lines).suspects())
    assert [(s.channel, s.where) for s in (first, second)] == [("temperature", "joint 4"), ("time", "joint 4")]
    assert second.pattern.endswith("time goes with temperature here") and "x" not in {s.channel for s in others}


def loaded_ripple(g, arm) -> Hidden:
    """A gear of joint 3 that ripples by its load, with no whole number a turn."""
    return Hidden("ripple", "unknown", joint=lambda s, tau: column(2, 4e-7 * tau[:, 2] * np.cos(3.5 * s.q[:, 2] + 0.3)))


def test_a_law_is_told_at_its_own_joint_where_the_casting_beside_it_looks_better_at_first():
    fit = base_fit(cell(loaded_ripple, seed=431, noise=0.03, poses=90)[0])
    forms = curve_forms(fit.problem.sensitivity.state, fit.problem.site)
    first = CurveScreen(fit.problem, fit.linear, forms).suspects()[0]
    assert (first.where, set(first.channels)) == ("joint 3", {"q3", "load3"}) and first.share > 0.99


def suspect(where: str, names: str, worth: float, share: float | None = None, channel: str = "") -> Suspect:
    form, share = law(names, np.ones(1)), worth / 100 if share is None else share
    return Suspect(where, np.zeros((1, 3, 1)), form, worth, worth, 0.0, channel or form.channels[0], share)


@pytest.mark.parametrize(
    ("ranked", "further", "reported"),
    [
        # A shift of the tool across its axis and a turn of joint 6 are the same for positions alone.
        (
            [("joint 6", "dir1", 90, 0.9), ("joint 6", "dir1", 80, 0.9), ("tool", "dir1", 78, 0.9),
             ("base", "dir1", 30, 0.9)],
            [],
            ["joint 6 dir1", "tool dir1"],
        ),
        # A second structure comes before other channels of the first.
        (
            [("joint 2", "load2", 70), ("joint 2", "time", 50), ("joint 2", "x", 45), ("joint 2", "z", 35)],
            [("joint 2", "q5 q6", 20)],
            ["joint 2 load2", "joint 2 q5", "joint 2 time", "joint 2 x"],
        ),
        # What is worth less with a further channel than without it goes, what is worth more stays.
        ([("joint 2", "load2", 70), ("joint 2", "load2 q1", 60, None, "q1")], [], ["joint 2 load2"]),
        (
            [("joint 2", "load2", 70), ("joint 2", "time q6", 50), ("joint 2", "q6 time", 45), ("joint 2", "x", 44),
             ("joint 2", "time", 42)],
            [],
            ["joint 2 load2", "joint 2 time", "joint 2 q6", "joint 2 x"],
        ),
        # A part elsewhere comes before one of the same channel at the same place.
        (
            [("joint 2", "q2", 50)],
            [("joint 2", "q2", 50), ("joint 4", "q2", 50)],
            ["joint 2 q2", "joint 4 q2", "joint 2 q2"],
        ),
        # What the same place follows, though less of it, comes before another place.
        (
            [("joint 2", "temperature", 500, 1.0), ("body 1", "time", 490, 0.99), ("joint 2", "time", 488, 0.6)],
            [],
            ["joint 2 temperature", "joint 2 time"],
        ),
    ],
)  # fmt: skip
def test_other_structures_are_reported_before_other_channels_of_the_first(ranked, further, reported):
    shown = by_channel([suspect(*row) for row in ranked], [suspect(*row) for row in further])
    assert [f"{s.where} {s.channel}" for s in shown] == reported
