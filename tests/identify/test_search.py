"""Which beginnings a search tries, on tables of what every name and pattern is worth."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from postproc.effects.contract import State
from postproc.fit.linear import Linear
from postproc.fit.worth import schwarz
from postproc.identify import search as module
from postproc.identify import taking, unnamed, way
from postproc.identify.alike import CLOSE
from postproc.identify.candidate import Candidate
from postproc.identify.ranking import Search
from postproc.identify.whole import Missing
from postproc.patterns.suspects import Suspect


@dataclass
class Table(Search):
    """A search in which what was taken decides what all the others are worth."""

    worth: dict[frozenset[str], dict[str, float]] = field(default_factory=dict)

    def now(self):
        return frozenset([*self.fit.names, *(s.where for s in self.outside)])

    def beside(self, outside):
        return replace(self, outside=outside)

    def suspects(self, linear, asked=0.0):
        some = self.worth.get(self.now(), {})
        found = [(v, k) for k, v in some.items() if k.startswith("joint")]
        return [Suspect("q1", k, "", 1.0, v, v, np.zeros((1, 1, 1)), np.zeros(1)) for v, k in sorted(found)[::-1]]


@pytest.fixture
def begin(monkeypatch):
    def ranking(search):
        some = search.worth.get(search.now(), {})
        found = [
            SimpleNamespace(key=k, evidence=v, far=k == "hose", first=None)
            for k, v in some.items()
            if not k.startswith("joint")
        ]
        return sorted(found, key=lambda c: -c.evidence)

    def take(search, best, ranked):
        if best.key.startswith("refused"):
            return None
        search.fit = SimpleNamespace(names=(*search.fit.names, best.key))
        return SimpleNamespace(candidate=best)

    def worth(before, search, missing):
        return search.worth.get(search.now(), {}).get("joint total", 0.0)

    monkeypatch.setattr(way, "ranking", ranking)
    monkeypatch.setattr(way, "take", take)
    monkeypatch.setattr(way, "worth", worth)
    monkeypatch.setattr(way, "formed_anew", lambda search, base, missing: missing)
    monkeypatch.setattr(way.Rival, "beats", lambda rival, way: False)
    monkeypatch.setattr(module, "_more_left", lambda fit: "coupling" in fit.names)
    monkeypatch.setattr(way, "convincing", lambda c, fit, count: c.evidence > 0)
    monkeypatch.setattr(
        way,
        "clear",
        lambda search, asked=0.0: [
            s for s in search.suspects(search.fit) if s.evidence > 0 and s.where != "joint total"
        ],
    )

    def begin(table):
        worth = {frozenset(k.split()): v for k, v in table.items()}
        classes = {name: None for key in table for name in key.split()}
        search = Table(SimpleNamespace(names=(), linear=None), classes, None, [], worth=worth)
        missing = module.select_forward(search, ranking(search))
        assert search.classes == classes
        return sorted(m.candidate.key for m in missing), [s.where for s in search.outside]

    return begin


def test_after_the_first_name_that_a_pattern_beats_the_better_goes_first(begin):
    """Drift of all joints beside a joint that softens: once the drift is in, the pattern is worth ten times a name."""
    table = {
        "": {"drift": 200.0, "joint-2": 500.0},
        "drift": {"growth": 30.0, "joint-3": 400.0},
        "joint-2": {"drift": 50.0},
        "drift joint-3": {"joint total": 30.0},
        "joint-2 drift": {"joint total": 20.0},
    }
    assert begin(table) == (["drift"], ["joint-3"])


def test_two_names_give_way_to_the_pattern_that_tells_both(begin):
    """A rubber stop: a balancer and a gear line together, each worth a little more than the pattern."""
    table = {
        "": {"balancer": 505.0, "joint-2": 500.0},
        "balancer": {"line": 12.0},
        "balancer line": {"joint total": 1.0},
        "joint-2": {"joint total": 20.0},
    }
    assert begin(table) == ([], ["joint-2"])
    del table["balancer"], table["balancer line"]
    assert begin(table) == (["balancer"], [])


def test_names_are_not_followed_where_a_pattern_far_ahead_cannot_be_reached_any_more(monkeypatch, begin):
    """A step that a map of four joints comes near with 800 numbers."""
    asked = []

    def beats(rival, way):
        asked.append((rival.worth, way.search.fit.names))
        return way.search.fit.names == ("map",)

    monkeypatch.setattr(way.Rival, "beats", beats)
    table = {
        "": {"map": 200.0, "joint-2": 500.0},
        "map": {"geometry": 30.0},
        "map geometry": {"joint total": 400.0},
        "joint-2": {"joint total": 300.0},
    }
    assert begin(table) == ([], ["joint-2"])
    assert asked == [(300.0 - CLOSE, ("map",))]
    table[""]["joint-2"] = 390.0  # not far ahead: both to the end
    assert begin(table) == (["geometry", "map"], [])


@pytest.mark.parametrize(
    ("noise", "variance", "left", "beaten"),
    [(2e-5, 1.0, 900.0, True), (2e-5, 1.3, 900.0, False), (None, 1.3, 900.0, True), (2e-5, 1.0, 300.0, False)],
)
def test_a_way_is_beaten_where_even_the_noise_alone_would_not_do(monkeypatch, noise, variance, left, beaten):
    """It costs 60 more than its rival, which leaves 400 of 400 numbers: more of it may be gone than of the rival's."""
    base, own = SimpleNamespace(linear=SimpleNamespace(freedom=400)), SimpleNamespace(left=left)
    rival = SimpleNamespace(left=400.0, variance=variance, noise=SimpleNamespace(sigma=noise))
    monkeypatch.setattr(way, "left_by", lambda before, fit: fit.left)
    monkeypatch.setattr(way, "worth_if_left", lambda left, before, search, missing: 400 * np.log(4e4 / left) - 60)
    assert way.Rival(rival, 400 * np.log(100.0)).beats(way.Way(base, SimpleNamespace(fit=own))) == beaten


@pytest.mark.parametrize(("name", "stays"), [("coupling", False), ("balancer", True)])
def test_a_name_that_leaves_more_than_the_noise_gives_way_to_a_pattern_that_comes_near_it(begin, name, stays):
    """A cable that pulls a wrist axis by the hyperbolic sine of another one, called their coupling."""
    table = {"": {name: 505.0, "joint-5": 500.0}, "joint-5": {"joint total": 20.0}}
    assert begin(table) == (([name], []) if stays else ([], ["joint-5"]))


def test_a_pattern_that_says_hardly_more_than_names_leaves_them(begin):
    """A hall that warms up in a wave: castings that grow with its temperature, or a scale that follows time."""
    table = {
        "": {"growth": 273.0, "joint-2": 413.0},
        "growth": {"joint total": 457.3},
        "joint-2": {"joint total": 457.9},
    }
    assert begin(table) == (["growth"], [])
    table["joint-2"] = {"joint total": 477.9}
    assert begin(table) == ([], ["joint-2"])


def test_a_pattern_that_spares_no_name_does_not_stand_in_for_one(begin):
    """A gear line beside a casting, and the wave of its joint that does the same without a name."""
    table = {
        "": {"casting": 460.0},
        "casting": {"line": 275.0, "joint-3": 261.0},
        "casting line": {"joint total": 1.0},
        "casting joint-3": {"joint total": 2.0},
    }
    assert begin(table) == (["casting", "line"], [])


def test_one_plainer_name_alone_has_lost_against_a_hose_already(begin):
    table = {"": {"hose": 360.0, "wind-up": 340.0}, "hose": {"joint total": 363.0}, "wind-up": {"joint total": 377.0}}
    assert begin(table) == (["hose"], [])


@pytest.mark.parametrize(("near", "together"), [(340.0, 377.0), (340.0, 350.0), (300.0, 377.0)])
def test_a_hose_gives_way_to_plainer_names_that_came_near_it_and_are_worth_more_together(
    monkeypatch, begin, near, together
):
    reached = []
    monkeypatch.setattr(way.Rival, "beats", lambda rival, way: bool(reached.append(rival.worth)))
    table = {
        "": {"hose": 360.0, "wind-up": near},
        "hose": {"joint total": 363.0},
        "wind-up": {"line": 110.0},
        "wind-up line": {"joint total": together},
    }
    assert begin(table) == ((["line", "wind-up"] if (near, together) == (340.0, 377.0) else ["hose"]), [])
    assert set(reached) == ({363.0} if near > 0.9 * 360.0 else set())


def test_a_name_that_was_refused_is_asked_again_once_another_is_in(begin):
    table = {"": {"refused": 90.0, "refused-2": 80.0, "backlash": 50.0}, "backlash": {"joint-1": 20.0}}
    assert begin(table) == (["backlash"], ["joint-1"])


def test_a_way_goes_six_steps_at_most_and_takes_three_patterns_at_most(begin):
    def table(kind):
        every = [f"{kind}-{k}" for k in range(8)]
        return {" ".join(every[:k]): {one: 90.0 - 9 * k} for k, one in enumerate(every)}

    assert begin(table("name")) == ([f"name-{k}" for k in range(6)], [])
    assert begin(table("joint")) == ([], [f"joint-{k}" for k in range(3)])


def test_patterns_are_looked_for_as_far_as_they_come_near_the_name(monkeypatch, begin):
    """To the first fork those behind it by the odds at most, then those that are ahead of it; all where none is named."""
    asked, clear = [], way.clear
    monkeypatch.setattr(way, "clear", lambda search, least: asked.append(least) or clear(search, least))
    table = {"": {"drift": 90.0, "joint-2": 85.0}, "drift": {"growth": 30.0}, "drift growth": {}}
    assert begin(table) == (["drift", "growth"], [])
    assert asked[:3] == [90.0 - way.ODDS, 30.0, 0.0]


@pytest.mark.parametrize(
    ("table", "asked"),
    [
        ({"": {"drift": 90.0}, "drift": {"growth": 30.0}}, [(), ("drift",)]),
        ({"": {"refused": 90.0, "drift": 50.0}, "drift": {}}, [()]),
        ({"": {"drift": 90.0}, "drift": {"joint-1": 50.0}, "drift joint-1": {"growth": 9.0}}, [(), ("drift",)]),
    ],
)
def test_effects_are_formed_anew_before_anything_is_taken_but_beside_patterns_and_what_was_refused(
    monkeypatch, begin, table, asked
):
    seen = []
    monkeypatch.setattr(way, "formed_anew", lambda search, base, missing: seen.append(search.fit.names) or missing)
    begin(table)
    assert seen == asked


@pytest.mark.parametrize(("spread", "alone"), [(True, False), (False, True)])
def test_a_name_that_only_one_row_asks_for_is_none(monkeypatch, spread, alone):
    """The same gain: from 40 poses that follow a law, or from one reading at the pose where the law says most."""
    rng = np.random.default_rng(5)
    law, noise = rng.standard_t(3, (40, 3)), 0.5 * rng.standard_normal((40, 3))
    most = np.argmax((law**2).sum(axis=1))
    size = np.zeros((40, 1)) + 1.0 if spread else 2.0 * (np.arange(40) == most)[:, None]
    column, residual = law.reshape(-1, 1), (noise + size * law).ravel()
    linear = Linear(residual, np.zeros((120, 0)), np.repeat(np.arange(40), 3))
    fall = float((column[:, 0] @ residual) ** 2 / (column[:, 0] @ column[:, 0]))
    worth = schwarz(linear.square, fall, 1, linear.freedom, 1.0)
    assert worth > 5.0
    fit = SimpleNamespace(linear=linear, problem=None)
    monkeypatch.setattr(taking, "columns_of", lambda problem, effect, free: column)
    best = SimpleNamespace(effect=None, free=None, evidence=worth, fall=fall, count=1)
    assert taking._lives_on_a_row(fit, best) is alone


def test_more_of_an_effect_goes_with_what_stands_there_already():
    def found(key, label, size=2):
        none = np.zeros(size, dtype=bool)
        effect = SimpleNamespace(roughness=lambda: None)
        return Missing(Candidate(key, effect, none, label, 9.0, 9.0, 1, 0.0, 9.0, 1e-9), ("drift",))

    lag, wrist, more = found("lag", "joint 2"), found("wrist", ""), found("lag", "joint 6", 3)
    both = taking.together([lag, wrist], more)
    assert [(m.candidate.key, m.candidate.label) for m in both] == [("lag", "joint 2; joint 6"), ("wrist", "")]
    assert both[0].candidate.free is more.candidate.free and taking.together([lag], wrist) == [lag, wrist]


@pytest.mark.parametrize(("hose", "whole"), [(100.0, False), (44.0, True)])
def test_of_two_lines_the_first_alone_is_taken_where_another_effect_tells_clearly_more_beside_it(
    monkeypatch, hose, whole
):
    first = SimpleNamespace(key="line")
    best = SimpleNamespace(key="line", first=first)
    monkeypatch.setattr(taking, "refit", lambda fit, c: SimpleNamespace(names=("line",)))
    beside = [SimpleNamespace(key="hose", evidence=hose), SimpleNamespace(key="line", evidence=40.0)]
    monkeypatch.setattr(taking, "ranking", lambda search: beside if search.fit.names else [])
    search = Table(SimpleNamespace(names=()), {}, None, [])
    assert taking.one_or_more(search, best) is (best if whole else first)
    single = SimpleNamespace(key="line", first=None)
    assert taking.one_or_more(search, single) is single


def test_two_names_are_formed_anew_before_a_third_is_taken(monkeypatch, begin):
    """A line whose order suits no payload, and a balancer that mends it."""

    def anew(search, base, missing):
        if search.fit.names != ("line-2", "payload"):
            return missing
        search.fit = SimpleNamespace(names=("line-3", "payload"), linear=None)
        return [SimpleNamespace(candidate=SimpleNamespace(key=key, far=False)) for key in search.fit.names]

    table = {
        "": {"line-2": 300.0},
        "line-2": {"payload": 50.0},
        "line-2 payload": {"balancer": 13.0},
        "line-3 payload": {"balancer": -1.0},
    }
    monkeypatch.setattr(way, "formed_anew", anew)
    assert begin(table) == (["line-3", "payload"], [])


@pytest.mark.parametrize(
    ("channel", "noise", "recorded", "told"),
    [
        ("row", None, False, True),
        ("q2", None, False, False),
        ("q2", 2e-5, False, True),
        ("time", None, False, True),
        ("time", None, True, False),
    ],
)
def test_without_repeats_little_is_scatterof_the_arm_and_more_of_what_drifts(channel, noise, recorded, told):
    n = 50
    state = State(q=np.zeros((n, 6)), v=np.full((n, 6), 0.5), time=np.arange(n) * (0.01 if recorded else 60.0))
    scatter, linear = SimpleNamespace(sigma=noise), SimpleNamespace(square=1.0)
    fit = SimpleNamespace(noise=scatter, data=SimpleNamespace(state=state), linear=linear, names=())
    ninth = Suspect(channel, "tool", "", 0.09, 0.09, 50.0, np.zeros((1, 1, 1)), np.zeros(1), (channel,))

    class One(Table):
        def suspects(self, linear, asked=0.0):
            return [ninth]

    assert unnamed.clear(One(fit, {}, None, [])) == ([ninth] if told else [])
