"""Effects that were found one after another, formed anew beside one another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.effects.registry import effect_library
from postproc.estimation.channels import channels
from postproc.estimation.problem import Weights
from postproc.identification.acceptance import judged, refit
from postproc.identification.candidates.composition import compose
from postproc.identification.forward import backward, search
from postproc.identification.state import SearchState
from postproc.patterns.dictionary import patterns
from tests.identification.cells import base_fit, cell
from tests.independent import library_effects as kinds
from tests.independent.cells import Hidden, column


def two_rates(g, arm):
    knee, more = g.uniform(350, 600), g.uniform(3e-7, 8e-7)

    def windup(s, tau):
        return column(1, more * np.sign(tau[:, 1]) * np.maximum(np.abs(tau[:, 1]) - knee, 0))

    return Hidden("two_rates", "nonlinear_compliance", joint=windup, note="")


def eccentric(g, arm):
    size, phase = g.uniform(0.2e-3, 0.4e-3), g.uniform(0, 2 * np.pi)
    return Hidden("eccentric", "transmission_error", joint=lambda s, tau: column(1, size * np.sin(s.q[:, 1] + phase)))


def test_a_law_that_was_taken_before_the_other_effect_gives_way_to_the_one_that_suits_both():
    data, _ = cell(two_rates, eccentric, seed=7)
    base = base_fit(data)
    library = effect_library()
    begin = SearchState(base, base, {k: library[k] for k in ("nonlinear_compliance", "transmission_error")}, None)
    for key, change in (("nonlinear_compliance", {"law": "tanh"}), ("transmission_error", {})):
        found = compose(begin.screen, begin.fit.linear, key)
        told = replace(found, effect=replace(found.effect, **change), label=change.get("law", found.label))
        after = refit(begin.fit, told)
        begin = begin.with_effect(judged(begin.fit, after, told), after)
    early = begin.fit.linear.square
    anew = backward(begin)
    laws = {m.key: getattr(m.effect, "law", "") for m in anew.missing}
    assert laws == {"nonlinear_compliance": "piecewise", "transmission_error": ""}
    assert anew.fit.linear.square < early - 20
    assert backward(anew).fit is anew.fit


def test_a_whole_is_worth_the_same_however_large_the_noise_was_said_to_be():
    """A fit that tells a smaller noise has larger squares, and explains no less for that."""
    data, _ = cell(two_rates, seed=7)
    base = base_fit(data)
    quiet = replace(
        base, problem=base.problem.weighted(Weights(3.0 * base.problem.weights.values)), columns=3.0 * base.columns
    )
    assert quiet.linear.square > 8.0 * base.linear.square
    found = [SearchState(base, fit, {}, None).log_evidence for fit in (base, quiet)]
    np.testing.assert_allclose(found[1], found[0], atol=1e-6)


def test_a_name_takes_the_place_of_a_pattern_that_was_taken_before_it():
    """Beside others a temperature may look like something without a name; once they are in, it is the joint's drift."""
    data, _ = cell(kinds.thermal_joint_drift, seed=31, poses=60)
    base = base_fit(data)
    state, position = base.problem.sensitivity.state, base.problem.equilibrium.T_base_tcp[:, :3, 3]
    every = patterns(channels(state, position), state, position)
    begin = SearchState(base, base, {"thermal_joint_drift": effect_library()["thermal_joint_drift"]}, every)
    early = begin.beside(tuple(begin.patterns_left()[:1]))
    assert early.outside and not early.missing
    found = search(early)
    assert found.keys == ("thermal_joint_drift",) and not found.outside
    assert found.log_evidence > early.log_evidence
