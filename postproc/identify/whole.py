"""What a search has found as a whole: its worth, and its effects formed anew beside one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from postproc.fit.fitted import Fit
from postproc.fit.linear import Linear
from postproc.fit.worth import schwarz
from postproc.identify.candidate import Candidate
from postproc.identify.judgement import fitted_best
from postproc.identify.ranking import Search
from postproc.identify.refits import refit_all
from postproc.identify.selection import compose
from postproc.patterns.tried import ODDS


@dataclass(frozen=True)
class Missing:
    """An effect that the model lacks.

    Args:
        candidate: what it is; held_out_after: held-out rms once it and those before it are in [m].
        alike: effects that explain this data nearly as well; unseen: effects that would not be seen beside it.
    """

    candidate: Candidate
    held_out_after: float
    alike: tuple[str, ...] = ()
    unseen: tuple[str, ...] = ()

    @property
    def not_separable(self) -> tuple[str, ...]:
        """What this data does not tell it from."""
        return (*self.alike, *self.unseen)

    def or_else(self, key: str) -> Missing:
        """The same, which this data does not tell from a further effect."""
        unseen = tuple(k for k in self.unseen if k != key)
        return replace(self, alike=tuple(dict.fromkeys([*self.alike, key])), unseen=unseen)


def worth(before: Linear, search: Search, missing: Sequence[Missing]) -> float:
    """What a finished search explains of the base's residual, less its parameters and what its parts are unlikely.

    A pattern costs the odds of something without a name, a named effect half of them: five weak effects that stand in
    for one smooth pattern lose against it.
    """
    after = search.linear()
    added = max(after.parameters - before.parameters, 1)
    gained = schwarz(before.square, before.square - after.square, added, before.freedom, 1.0)
    return gained - ODDS * (len(search.outside) + 0.5 * len(missing))


def formed_anew(search: Search, base: Fit, missing: list[Missing]) -> list[Missing] | None:
    """What is missing with one effect in a form that suits what came after it better; None where none does.

    What came first was formed beside a residual that held the others, too: a spring in two rates may have looked like
    a smooth one, and what its form leaves would be taken for a law that nobody knows. The search's fit goes with it.
    """
    for at, one in enumerate(missing):
        others = [m.candidate for m in missing if m is not one]
        if not others or one.candidate.effect.roughness() is not None or base.model.effect(one.candidate.key):
            continue
        without = replace(search, fit=refit_all(base, search.fit, others, base.noise.stated))
        screen, linear = without.screen(), without.linear()
        mine = compose(screen, linear, one.candidate.key)
        found = mine and fitted_best(without.fit, screen, linear, mine)
        if not found or found[0].label == one.candidate.label:
            continue
        candidate, fit = found
        if worth(base.linear, replace(search, fit=fit), missing) > worth(base.linear, search, missing):
            search.fit = fit
            anew = [*missing[:at], replace(one, candidate=candidate), *missing[at + 1 :]]
            return [*anew[:-1], replace(anew[-1], held_out_after=fit.held_out_rms)]
    return None
