"""Back again: what the others cover goes, and the fit without it stays."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from postproc.identify import backward, ranking
from postproc.identify.candidate import Candidate
from postproc.identify.ranking import Search
from postproc.identify.whole import Missing


def named(key, evidence):
    none = np.zeros(0, dtype=bool)
    effect = SimpleNamespace(key=key)
    return Candidate(key, effect, none, "", evidence, 100.0, 1, 0.0, 9.0, 1e-9)


def test_an_effect_that_the_others_cover_goes(monkeypatch):
    first, second = named("backlash", -3.0), named("arm_load", 80.0)
    fits = {
        ("arm_load",): SimpleNamespace(
            linear=SimpleNamespace(square=500.0), model=SimpleNamespace(effect=lambda key: None)
        ),
        ("backlash",): None,
    }
    monkeypatch.setattr(ranking, "refit_all", lambda base, fit, others, noise: fits[tuple(c.key for c in others)])
    monkeypatch.setattr(backward, "ranking", lambda search: [first])
    search = Search(None, {}, None, [])
    base = SimpleNamespace(noise=SimpleNamespace(stated=None))
    kept = backward.check_backward(search, base, [Missing(first), Missing(second)])
    assert [m.candidate.key for m in kept] == ["arm_load"] and search.fit is fits[("arm_load",)]


def test_the_same_parts_of_a_fit_are_fitted_once(monkeypatch):
    first, second = named("backlash", 30.0), named("arm_load", 80.0)
    base = SimpleNamespace(noise=SimpleNamespace(stated=None))
    monkeypatch.setattr(ranking, "refit_all", lambda base, fit, others, noise: object())
    search = Search(SimpleNamespace(), {}, None, [])
    both = search.only(base, [first, second])
    assert search.only(base, [second, first]) is both and search.only(base, [first]) is not both
    assert replace(search, fit=SimpleNamespace()).only(base, [first, second]) is not both
