"""Where a search stands: the model as it came, what was added, and what that leaves."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from postproc.channels.expression import in_order
from postproc.effects.base import Effect
from postproc.effects.roles import Role
from postproc.estimation.evidence import schwarz
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.solving.solve import ROUGHLY, Terms
from postproc.estimation.validation.residual_split import SLOW
from postproc.identification.acceptance import convincing, ranking
from postproc.identification.curves.families import CurveForms
from postproc.identification.curves.prior import UNNAMED_LOG_PRIOR
from postproc.identification.forecast import Forecast
from postproc.identification.refits import refit_all
from postproc.identification.screen.candidate import Candidate, FormCache, Screen
from postproc.identification.screen.curves import CurveScreen
from postproc.identification.screen.suspects import joined
from postproc.measure.trajectory import is_record

LEAST_SHARE = 0.15
"""Share of the residual that a curve must explain where nothing tells how much of it is noise: what one function of the
angles leaves looks like another one."""


@dataclass(frozen=True)
class SearchState:
    """What a search has added so far, and what remains then.

    Args:
        base: the fit of the model as it came; fit: with what was added.
        classes: of the effects that may be missing, by key; forms: of the curves that may be missing.
        missing: the effects of the library that were added; curves: the curves that were added.
        stock: forms by the numbers in use, which all states of a search share.
        bare: the state before any curve was added; None where it is not known.
        forecast: is told each state that was examined.
    """

    base: Fit
    fit: Fit
    classes: Mapping[str, type[Effect]]
    forms: CurveForms
    missing: tuple[Candidate, ...] = ()
    curves: tuple[Candidate, ...] = ()
    stock: dict[bytes, FormCache] = field(default_factory=dict, repr=False)
    bare: SearchState | None = field(default=None, repr=False)
    forecast: Forecast = field(default_factory=Forecast, repr=False)

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the effects of the library that were added, in order."""
        return tuple(m.key for m in self.missing)

    @cached_property
    def log_evidence(self) -> float:
        """Log evidence (2 log of odds) of all that was added, against the base.

        The price of finding each part is subtracted, so that five weak effects lose against one smooth curve.
        """
        first, after = self.base.linear, self.fit.linear
        added = max(after.parameters - first.parameters, 1)
        gained = schwarz(first.square, _square_after(self.base, self.fit), added, first.freedom)
        return float(gained) - sum(c.price for c in (*self.missing, *self.curves))

    @cached_property
    def keys_of_base(self) -> frozenset[str]:
        """Keys of the effects that the model had before the search."""
        return frozenset(e.key for e in self.base.model.effects)

    @cached_property
    def screen(self) -> Screen:
        """The forms of all effects on the present fit; their columns are shared by states that use the same rows."""
        problem = self.fit.problem
        used = problem.weights.used.tobytes()
        known = self.stock.get(used) or next(iter(self.stock.values()), FormCache())
        self.stock[used] = known.at(problem.weights)
        return Screen(problem, self.classes, self.fit.free, self.stock[used])

    @cached_property
    def ranked(self) -> list[Candidate]:
        """Every testable effect of the library in its best form on the residual, the best by log evidence first."""
        ranked = ranking(self.fit, self.screen)
        self.forecast.examined(len(self.missing) + len(self.curves), any(map(convincing, ranked)))
        return ranked

    @cached_property
    def curve_screen(self) -> CurveScreen:
        """All curves, tried on the residual of the fit."""
        screen = CurveScreen(self.fit.problem, self.fit.linear, self.forms)
        further = any(s.evidence > 0 for s in screen.tried) or any(map(convincing, self.__dict__.get("ranked", ())))
        self.forecast.examined(len(self.missing) + len(self.curves), further, curves=True)
        return screen

    def candidates(self, refused: Collection[str], named: bool, curves: bool) -> Iterator[Candidate]:
        """Yield what may be missing and convinces, effects of the library and curves, the best by log evidence first.

        Args:
            refused: names of candidates that are left out.
            named: whether effects of the library are tried; curves: whether curves are.
        """
        library = [c for c in self.ranked if c.name not in refused and convincing(c)] if named else []
        for curve in self.ranked_curves(library[0].evidence if library else 0.0) if curves else ():
            while library and library[0].evidence >= curve.evidence:
                yield library.pop(0)
            if curve.name not in refused:
                yield curve
        yield from library

    def ranked_curves(self, least: float = 0.0) -> Iterator[Candidate]:
        """Yield the curves with positive evidence, strongest first.

        Where the noise is not known, they explain the share `LEAST_SHARE` of the residual, unless poses were measured
        one by one and the curve depends on temperature, time, session or row alone.

        Args:
            least: log evidence below which curves may be missing from the result.
        """
        known, poses = self.fit.noise.sigma is not None, not is_record(self.fit.data.state)
        nu, square = self.fit.linear.freedom, self.fit.linear.square
        if known and least > nu * np.log(square / max(nu - 3 * np.sqrt(2 * nu), 1.0)) - UNNAMED_LOG_PRIOR:
            return  # what leaves no more than the noise is worth less
        for curve in self.curve_screen.suspects(least):
            slow = poses and {*SLOW, "row"}.issuperset(curve.channels)
            if curve.evidence > 0 and (known or slow or curve.rss_reduction > LEAST_SHARE * square):
                yield Candidate.of_curve(curve, curve.effect(self.fit.problem.site))

    def with_curves(self, curves: tuple[Candidate, ...]) -> SearchState:
        """Return the state with other curves in the model, and everything fitted again.

        Without any, it is the state before curves were added; where that is not known, knees and points of effects stay
        fixed, since what the curves explained would move them.

        Args:
            curves: in place of those of this state.
        """
        if list(map(id, curves)) == list(map(id, self.curves)):
            return self
        if not curves and self.bare is not None:
            return self.bare
        fit, stated = self.fit, self.base.model.in_role(Role.CURVE)
        others = [e for e in fit.model.effects if e.role is not Role.CURVE]
        free = {e.key: fit.free[e.key] & (bool(curves) | e.amplitudes()) for e in others}
        known = frozenset(p for p in fit.parameters if p[0] in free)
        parts = [*([] if stated is None else [stated]), *(c.effect for c in curves)]
        data, added = fit.data, joined(parts)
        if added:
            free[added[0].key] = np.ones(len(added[0].vector()), dtype=bool)
            derived = in_order(added[0].ordered_channels, fit.problem.sensitivity.state, fit.problem.site).channels
            data = replace(data, state=data.state.with_(channels={**derived, **data.state.channels}))
        terms = Terms(free, fit.strength, False, ROUGHLY, known)
        after = fit_model(fit.model.with_effects(*others), data, added, noise=fit.noise.stated, terms=terms)
        bare = (self.bare if self.curves else self) if curves else None
        return replace(self, fit=after, curves=curves, bare=bare)

    def without_forms(self) -> SearchState:
        """Return this state after its cached columns of forms were dropped, which need most of a search's memory."""
        self.stock.clear()
        for state in (self, self.bare):
            if state is not None:
                state.__dict__.pop("screen", None)
        return self

    def with_effect(self, one: Candidate, fit: Fit) -> SearchState:
        """Return the state with one more effect of the library.

        Further terms of an effect that was added before are merged into it.

        Args:
            one: the effect; fit: the fit that has it.
        """
        at = self.keys.index(one.key) if one.key in self.keys else len(self.missing)
        if at < len(self.missing):
            first, paid = self.missing[at], self.missing[at].price + one.price
            labels = [one.label] if one.effect.roughness() is not None else [first.label, one.label]
            label = "; ".join(filter(None, labels))
            one = replace(first, effect=one.effect, free=one.free, fit=one.fit, label=label, price=paid)
        return replace(self, fit=fit, missing=(*self.missing[:at], one, *self.missing[at + 1 :]), bare=None)

    def with_rivals(self, one: Candidate) -> SearchState:
        """Return the state with one of its effects replaced by the same effect with its rivals filled in."""
        bare = None if self.bare is None else self.bare.with_rivals(one)
        other = replace(self, missing=tuple(one if m.key == one.key else m for m in self.missing), bare=bare)
        known = ("screen", "ranked", "curve_screen")  # rivals change nothing of what the fit leaves
        other.__dict__.update({name: self.__dict__[name] for name in known if name in self.__dict__})
        return other

    def without(self, key: str) -> SearchState:
        """Return the state without one of its effects, by key, everything else fitted again."""
        others = tuple(m for m in self.missing if m.key != key)
        curves = [c.key for c in self.curves[:1]]
        fit = refit_all(self.base, self.fit, [*(m.key for m in others), *curves])
        return replace(self, fit=fit, missing=others, bare=None)


def _square_after(before: Fit, after: Fit) -> float:
    """Return the sum of squares after a fit, at the weights of the fit before.

    The weights are scaled to the same geometric mean: numbers that are weighted by their own residual then count by
    their likelihood.
    """
    weights, others = before.problem.weights, after.problem.weights
    both = weights.used & others.used
    return after.linear.square * float(np.exp(2 * np.mean(np.log(weights.values[both] / others.values[both]))))
