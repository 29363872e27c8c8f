"""Where a search stands: the model as it came, what was taken, and what that leaves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np

from postproc.channels.expression import in_order
from postproc.channels.sight import Site
from postproc.effects.base import Effect
from postproc.effects.registry import effect_in_role
from postproc.effects.roles import Role
from postproc.estimation.evidence import schwarz
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.residual_split import SLOW
from postproc.estimation.solving.solve import ROUGHLY, Terms
from postproc.identification.acceptance import ranking
from postproc.identification.candidates.candidate import Candidate, FormCache, Screen
from postproc.identification.refits import refit_all
from postproc.measure.trajectory import is_record
from postproc.patterns.dictionary import Patterns
from postproc.patterns.pattern_prior import UNNAMED_LOG_PRIOR
from postproc.patterns.screening import PatternScreen
from postproc.patterns.suspects import Suspect

UNSURE = 0.15
"""Share of what is left that a pattern must explain where nothing tells how much of it is noise: what one function of
the angles leaves looks like another one."""


@dataclass(frozen=True)
class SearchState:
    """What a search has taken so far, and what is left then.

    Args:
        base: the fit of the model as it came; fit: with what was taken.
        classes: of the effects that may be missing, by key; patterns: those that may stand beside the model.
        missing: the effects that were taken; outside: the patterns that were taken.
        stock: columns of forms by the numbers in use, which all states of a search share.
        plain: the state before any pattern was added; None where it is not known.
    """

    base: Fit
    fit: Fit
    classes: Mapping[str, type[Effect]]
    patterns: Patterns | None
    missing: tuple[Candidate, ...] = ()
    outside: tuple[Suspect, ...] = ()
    stock: dict[bytes, FormCache] = field(default_factory=dict, repr=False)
    plain: SearchState | None = field(default=None, repr=False)

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the effects that were taken, in order."""
        return tuple(m.key for m in self.missing)

    @cached_property
    def log_evidence(self) -> float:
        """Log evidence (2 log of odds) of all that was taken, against the base.

        The price of finding each part is subtracted, so that five weak effects lose against one smooth pattern.
        """
        first, after = self.base.linear, self.fit.linear
        added = max(after.parameters - first.parameters, 1)
        gained = schwarz(first.square, _left_by(self.base, self.fit), added, first.freedom)
        paid = sum(m.price for m in self.missing) + sum(s.price for s in self.outside)
        return float(gained) - paid

    @cached_property
    def given(self) -> frozenset[str]:
        """Keys of the effects that the model had before the search."""
        return frozenset(e.key for e in self.base.model.effects)

    @cached_property
    def screen(self) -> Screen:
        """The forms of all effects on the present fit; their columns are shared by states that use the same rows."""
        problem = self.fit.problem
        used = problem.weights.used.tobytes()
        self.stock[used] = self.stock.get(used, FormCache()).at(problem.weights)
        return Screen(problem, self.classes, self.fit.free, self.stock[used])

    @cached_property
    def ranked(self) -> list[Candidate]:
        """Every testable effect in its best form on the residual, the best by log evidence first."""
        return ranking(self.fit, self.screen)

    @cached_property
    def pattern_screen(self) -> PatternScreen:
        """All patterns, tried on the residual of the fit."""
        assert self.patterns is not None
        return PatternScreen(self.fit.problem, self.fit.linear, self.patterns)

    def patterns_left(self, asked: float = 0.0) -> list[Suspect]:
        """Return the patterns with positive evidence, strongest first.

        Where the noise is not known, they explain the share `UNSURE` of the residual, unless poses were measured one by
        one and the pattern depends on temperature, time, session or row alone.

        Args:
            asked: log evidence below which patterns may be missing from the result.
        """
        known, poses = self.fit.noise.sigma is not None, not is_record(self.fit.data.state)
        nu, square = self.fit.linear.freedom, self.fit.linear.square
        if known and asked > nu * np.log(square / max(nu - 3 * np.sqrt(2 * nu), 1.0)) - UNNAMED_LOG_PRIOR:
            return []  # what leaves no more than the noise is worth less

        def enough(suspect: Suspect) -> bool:
            """Return whether a suspect explains enough of the residual."""
            slow = poses and {*SLOW, "row"}.issuperset(suspect.channels)
            return known or slow or suspect.fall > UNSURE * self.fit.linear.square

        return [s for s in self.pattern_screen.suspects(asked) if s.evidence > 0 and enough(s)]

    def beside(self, outside: tuple[Suspect, ...]) -> SearchState:
        """Return the state with other patterns beside the model, and everything fitted again.

        Without any, it is the state before patterns were added; where that is not known, knees and points of effects
        stay fixed, since what the patterns explained would move them.

        Args:
            outside: the patterns, in place of those of this state.
        """
        if list(map(id, outside)) == list(map(id, self.outside)):
            return self
        if not outside and self.plain is not None:
            return self.plain
        fit, given = self.fit, self.base.model.in_role(Role.CURVE)
        others = [e for e in fit.model.effects if e.role is not Role.CURVE]
        curve = curve_of([term for one in outside for term in one.terms], fit.problem.site, given)
        free = {e.key: fit.free[e.key] & (bool(outside) | e.amplitudes()) for e in others}
        known = frozenset(p for p in fit.parameters if p[0] in free)
        data = fit.data
        if curve is not None:
            free[curve.key] = np.ones(len(curve.vector()), dtype=bool)
            derived = in_order(curve.ordered_channels, fit.problem.sensitivity.state, fit.problem.site).channels
            new = {name: values for name, values in derived.items() if name not in data.state.channels}
            data = replace(data, state=data.state.with_(channels={**data.state.channels, **new}))
        terms = Terms(free, fit.strength, False, ROUGHLY, known)
        added = [] if curve is None else [curve]
        after = fit_model(fit.model.with_effects(*others), data, added, noise=fit.noise.stated, terms=terms)
        plain = (self.plain if self.outside else self) if outside else None
        return replace(self, fit=after, outside=outside, plain=plain)

    def without_forms(self) -> SearchState:
        """Return this state after its cached columns of forms were dropped, which need most of a search's memory."""
        self.stock.clear()
        for state in (self, self.plain):
            if state is not None:
                state.__dict__.pop("screen", None)
        return self

    def with_effect(self, one: Candidate, fit: Fit) -> SearchState:
        """Return the state with one more effect.

        Further terms of an effect that was taken before are merged into it.

        Args:
            one: the effect; fit: the fit that has it.
        """
        at = self.keys.index(one.key) if one.key in self.keys else len(self.missing)
        if at < len(self.missing):
            first, paid = self.missing[at], self.missing[at].price + one.price
            told = [one.label] if one.effect.roughness() is not None else [first.label, one.label]
            label = "; ".join(filter(None, told))
            one = replace(first, effect=one.effect, free=one.free, fit=one.fit, label=label, price=paid)
        return replace(self, fit=fit, missing=(*self.missing[:at], one, *self.missing[at + 1 :]), plain=None)

    def told(self, one: Candidate) -> SearchState:
        """Return the state with one of its effects replaced by the same effect with further fields filled in."""
        plain = None if self.plain is None else self.plain.told(one)
        return replace(self, missing=tuple(one if m.key == one.key else m for m in self.missing), plain=plain)

    def without(self, key: str) -> SearchState:
        """Return the state without one of its effects, by key, everything else fitted again."""
        others = tuple(m for m in self.missing if m.key != key)
        fit = refit_all(self.base, self.fit, [m.key for m in others])
        return replace(self, fit=fit, missing=others, plain=None)


def curve_of(terms: Sequence[Mapping[str, Any]], site: Site, given: Effect | None = None) -> Effect | None:
    """Return the effect `curve` with some terms, its amplitudes at null, behind those of the curve that a model has.

    Args:
        terms: fields of the effect, for one term each; site: where the measured point and the instrument are.
        given: the curve of the model; None where it has none.
    """
    cls = effect_in_role(Role.CURVE)
    place = {"point_m": site.point, "instrument_m_rad": site.instrument}
    parts = [*([] if given is None else [given]), *(cls(**term, **place) for term in terms)]
    return reduce(lambda first, other: first.plus(other), parts) if parts else None  # type: ignore[attr-defined]


def _left_by(before: Fit, after: Fit) -> float:
    """Return the sum of squares that a fit leaves, at the weights of the fit before.

    The weights are scaled to the same geometric mean: numbers that are weighted by their own residual then count by
    their likelihood.
    """
    weights, others = before.problem.weights, after.problem.weights
    both = weights.used & others.used
    return after.linear.square * float(np.exp(2 * np.mean(np.log(weights.values[both] / others.values[both]))))
