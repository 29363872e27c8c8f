"""A name goes where patterns of the same channels and places leave it nothing that they could not tell themselves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from postproc.identify import contest, ranking
from postproc.identify.ranking import Search
from postproc.patterns.suspects import Suspect


def suspect(channel, where, evidence=10.0):
    return Suspect(channel, where, "", 0.5, 100.0, evidence, np.zeros((1, 1, 1)), np.zeros(1), (channel,))


@dataclass
class Told(Search):
    """A search whose fit says which patterns it leaves."""

    def beside(self, outside):
        return replace(self, outside=outside)


def fit(names, outside, aside=()):
    model = SimpleNamespace(effect=lambda key: key if key in names else None)
    return SimpleNamespace(outside=outside, set_aside=aside, model=model, noise=SimpleNamespace(stated=None))


@pytest.mark.parametrize(
    ("outside", "more", "aside", "goes"),
    [
        ([suspect("load3", "joint 3")], -2.0, (), True),
        ([suspect("load3", "joint 3")], 2.0, (), False),
        # A pattern of another channel, or of a casting beside the joint, is no mending.
        ([suspect("q1", "joint 3")], -2.0, (), False),
        ([suspect("load3", "body 2")], -2.0, (), False),
        # In the place of the name the pattern is worth less.
        ([suspect("load3", "joint 3", 3.0)], -2.0, (), False),
        # Rows that the name told of are out: what is left says nothing.
        ([suspect("load3", "joint 3")], -2.0, (7,), False),
        ([], -2.0, (), False),
    ],
)
@pytest.mark.parametrize("second", [[], [suspect("x", "instrument")]])
def test_a_name_goes_where_what_it_tells_may_be_the_pattern_itself(monkeypatch, second, outside, more, aside, goes):
    """A second pattern may have stood beside it for what the name was off by."""
    base, whole = fit((), []), fit(("backlash",), [suspect("load3", "joint 3"), *second])
    bare = fit((), outside, aside)
    monkeypatch.setattr(ranking, "refit_all", lambda base, full, others, noise: bare if not others else None)
    monkeypatch.setattr(contest, "with_patterns", lambda search, most=3: search.beside(search.fit.outside[:most]))
    monkeypatch.setattr(contest, "_worth", lambda one, whole, without, seen, free: more if free else 5.0)
    monkeypatch.setattr(contest, "worth", lambda base, search, missing: 0.0)
    search = Told(whole, {}, None, [])
    told = SimpleNamespace(candidate=SimpleNamespace(key="backlash"))
    kept = contest.contested(search, base, [told])
    assert (kept == []) is goes
    assert search.fit is (bare if goes else whole) and search.outside == search.fit.outside


@pytest.mark.parametrize("left", [-3.0, 3.0])
def test_a_name_goes_that_the_patterns_beside_it_leave_nothing(monkeypatch, left):
    """Half of a law brought it in; what stands there without it is of another place."""
    whole, bare = fit(("transmission_error",), [suspect("q3", "joint 3")]), fit((), [suspect("q3", "body 2")])
    monkeypatch.setattr(ranking, "refit_all", lambda base, full, others, noise: bare)
    monkeypatch.setattr(contest, "with_patterns", lambda search, most=3: search.beside(search.fit.outside[:most]))
    monkeypatch.setattr(contest, "_worth", lambda one, whole, without, seen, free: left if seen is without else 9.0)
    monkeypatch.setattr(contest, "worth", lambda base, search, missing: 9.0 if search.outside == bare.outside else 8.0)
    search = Told(whole, {}, None, [])
    told = SimpleNamespace(candidate=SimpleNamespace(key="transmission_error"))
    assert contest.contested(search, fit((), []), [told]) == ([] if left < 0 else [told])
    assert search.fit is (bare if left < 0 else whole)


@pytest.mark.parametrize("more", [True, False])
def test_a_pattern_that_a_name_tells_in_the_end_goes(monkeypatch, more):
    wave, names = suspect("q2", "body 1"), [SimpleNamespace(), SimpleNamespace()]
    monkeypatch.setattr(contest, "formed_anew", lambda search, base, missing: [*missing] if more else missing)
    monkeypatch.setattr(contest, "with_patterns", lambda search: search.beside([]))
    search = Told(fit((), []), {}, None, [wave])
    assert contest.formed_beside(search, fit((), []), names) == names
    assert search.outside == ([] if more else [wave])


def test_a_pattern_may_be_off_by_whatever_is_smooth_in_its_channels():
    """A step that takes its time, told as a step: half of it is left, which no other place or channel makes."""
    g = np.random.default_rng(3)
    x, z = g.uniform(-2, 5, (2, 80))
    place = g.normal(size=(80, 3, 2))
    step = (x > 1.0).astype(float)
    told = replace(suspect("x", "tool"), place=place, values=step, given=(x,))
    known = place.reshape(-1, 2)  # the tool's own place is fitted
    columns = np.hstack([known, told.freely(SimpleNamespace(whiten=lambda moved: moved.reshape(-1, moved.shape[2])))])

    def left(values):
        moved = (place @ [0.3, -2.0] * values[:, None]).ravel()
        return float(np.sum((moved - columns @ np.linalg.lstsq(columns, moved, rcond=None)[0]) ** 2) / np.sum(moved**2))

    for own in (step, x**3 - x, step * x**2):
        assert left(own) < 1e-12
    assert left(np.tanh(x - 1.0) - step) < 0.2
    assert left(z) > 0.5
