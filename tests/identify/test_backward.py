"""Back again: what the others cover goes, and the fit without it stays."""

from types import SimpleNamespace

import numpy as np

from postproc.identify import backward
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
    monkeypatch.setattr(backward, "refit_all", lambda base, fit, others, noise: fits[tuple(c.key for c in others)])
    monkeypatch.setattr(backward, "ranking", lambda search: [first])
    search = Search(None, {}, None, [])
    kept = backward.check_backward(search, None, [Missing(first), Missing(second)], None)
    assert [m.candidate.key for m in kept] == ["arm_load"] and search.fit is fits[("arm_load",)]
