"""A name goes where no more patterns of the same channels and places tell nearly as much without it."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from postproc.identify import contest
from postproc.identify.ranking import Search
from postproc.patterns.suspects import Suspect


def suspect(channel, where, evidence=10.0):
    return Suspect(channel, where, "", 0.5, 100.0, evidence, np.zeros((1, 1, 1)), np.zeros(1), (channel,))


@dataclass
class Table(Search):
    """A search in which the names in the fit decide what is left beside the patterns."""

    square: float = 0.0

    def linear(self):
        return SimpleNamespace(square=self.fit.left)


def fit(names, left, outside, aside=()):
    model = SimpleNamespace(effect=lambda key: key if key in names else None)
    return SimpleNamespace(
        names=names, left=left, outside=outside, set_aside=aside, model=model, linear=SimpleNamespace(square=10500.0),
        noise=SimpleNamespace(position=None),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("outside", "left", "aside", "goes"),
    [
        ([suspect("load3", "joint 3")], 1400.0, (), True),
        ([suspect("load3", "joint 3")], 1600.0, (), False),
        # A pattern of another channel, or of a casting beside the joint, is no mending.
        ([suspect("q1", "joint 3")], 510.0, (), False),
        ([suspect("load3", "body 2")], 510.0, (), False),
        # In the place of the name the pattern is worth less.
        ([suspect("load3", "joint 3", 3.0)], 1400.0, (), False),
        # Rows that the name told of are out: what is left says nothing.
        ([suspect("load3", "joint 3")], 510.0, (7,), False),
        ([], 9000.0, (), False),
    ],
)
@pytest.mark.parametrize("second", [[], [suspect("x", "instrument")]])
def test_a_name_goes_where_no_more_patterns_leave_hardly_more(monkeypatch, second, outside, left, aside, goes):
    """A second pattern may have stood beside it for what the name was off by."""
    base, whole = fit((), 10500.0, []), fit(("backlash",), 500.0, [suspect("load3", "joint 3"), *second])
    bare = fit((), left, outside, aside)
    monkeypatch.setattr(contest, "refit_all", lambda base, full, others, noise: bare if not others else None)
    monkeypatch.setattr(contest, "patterns_left", lambda search, most=3: search.fit.outside[:most])
    monkeypatch.setattr(contest, "_worth", lambda one, search, rival: 5.0)
    search = Table(whole, {}, None, [])
    told = SimpleNamespace(candidate=SimpleNamespace(key="backlash"))
    kept = contest.contested(search, base, [told], None)
    assert (kept == []) is goes
    assert search.fit is (bare if goes else whole) and search.outside == search.fit.outside
