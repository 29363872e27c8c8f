"""What could be missing: one effect at its best, named or a curve, and the forms of every effect on one problem."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.base import FILLED_BY_MODEL, Effect
from postproc.effects.sums import SumOfTerms
from postproc.estimation.fitted import Fit
from postproc.estimation.problem import Problem, Weights
from postproc.estimation.solving.step import Masks
from postproc.identification.screen.forms import Form, Forms, columns_of, forms_of
from postproc.identification.screen.suspects import Suspect


@dataclass(frozen=True)
class Candidate:
    """An effect that a model may lack: the best composition of its forms on this data, or one curve without a name.

    Args:
        key: of the effect; effect: with starting amplitudes; free: (q,) mask of what a fit of it moves.
        label: which forms; evidence: 2 log of odds for it, less the price.
        rss_reduction: by how much it lowers the whitened sum of squares.
        count: number of parameters; price: 2 log of the prior odds against this form among all that were tried.
        visible: an effect of ordinary size in units of the noise of the whole data; p_value: corrected for what was
            tried.
        starts: itself and its next best forms, where its evidence must be found by full fits.
        fit: the full fit that it was judged by, if any.
        rivals: of one that the model lacks, keys of effects that explain this data nearly as well.
        unseen: keys of those that would not be seen beside it.
        held_out_after: held-out rms [m], [rad] of angles, once it and those taken before it are in the model.
        curve: of a curve, where it acts and what it follows; None for an effect of the library.
    """

    key: str
    effect: Effect
    free: NDArray[np.bool_]
    label: str
    evidence: float
    rss_reduction: float
    count: int
    price: float
    visible: float
    p_value: float
    starts: tuple[Candidate, ...] = ()
    fit: Fit | None = None
    rivals: tuple[str, ...] = ()
    unseen: tuple[str, ...] = ()
    held_out_after: float = float("nan")
    curve: Suspect | None = None

    @classmethod
    def of_curve(cls, curve: Suspect, effect: Effect) -> Candidate:
        """Return a curve as a candidate, which its evidence alone judges: the two tests of an effect are passed.

        Args:
            curve: where it acts and what it follows; effect: its terms, the amplitudes at null.
        """
        free = np.ones(len(effect.vector()), dtype=bool)
        return cls(
            key=effect.key,
            effect=effect,
            free=free,
            label=curve.key,
            evidence=curve.evidence,
            rss_reduction=curve.rss_reduction,
            count=int(free.sum()),
            price=curve.price,
            visible=np.inf,
            p_value=0.0,
            curve=curve,
        )

    @property
    def name(self) -> str:
        """What a search calls it: the key of its effect, or of a curve its place, kind and channels."""
        return self.key if self.curve is None else self.curve.key

    @property
    def not_separable(self) -> tuple[str, ...]:
        """Keys of the effects that this data does not tell from it, or that it may hide."""
        return (*self.rivals, *self.unseen)

    def columns(self, problem: Problem) -> Array:
        """Return (N, k) whitened derivatives by its k free amplitudes, in units of their ordinary sizes."""
        return columns_of(problem, self.effect, self.free) if self.curve is None else self.curve.columns(problem)

    @property
    def forming(self) -> int:
        """Number of free parameters that are no amplitudes but only shape the effect: a knee, the ends of a hose."""
        return int((self.free & ~self.effect.amplitudes()).sum())

    @property
    def far(self) -> bool:
        """Whether most of the free parameters shape the effect, so that all starting forms may be far off.

        A grid of knees is fine enough to start from, a grid of points in space is not.
        """
        return 2 * self.forming > int(self.free.sum())

    @property
    def curved(self) -> bool:
        """Whether the effect has to be judged by full fits, since a linear problem cannot.

        Parameters that shape the effect change its columns, and so does the compliance that its load acts through.
        """
        return self.forming > 0 or type(self.effect).load is not Effect.load


@dataclass
class FormCache:
    """Forms, kept while the same rows are in use; refits change their columns by a few parts in a thousand.

    Args:
        weights: with which they are whitened; those of orientations depend on the residual of the orientations.
        forms: of every effect where the model has nothing of it, by its key and the keys of those it depends on.
        by_load: (n, r, 6) whitened displacement by six unit loads, by number of poses, index of the first load and keys
            of the springs.
        turning: forms that only turn joints, and read measured channels alone: they are the same at any weights.
    """

    weights: Weights | None = None
    forms: dict[tuple[str, ...], Forms] = field(default_factory=dict)
    by_load: dict[Hashable, Array] = field(default_factory=dict)
    turning: dict[tuple[str, ...], Forms] = field(default_factory=dict)

    def at(self, weights: Weights) -> FormCache:
        """Return this cache where it was made with nearly the same weights, else one with the turning forms alone."""
        same = self.weights is not None and self.weights.nearly(weights)
        return self if same else FormCache(weights, turning=self.turning)

    def get(self, known: tuple[str, ...]) -> Forms | None:
        """Return the forms of an effect, by its key and the keys of those it depends on; None if they are not kept."""
        return self.turning.get(known, self.forms.get(known))

    def keep(self, known: tuple[str, ...], forms: Forms) -> Forms:
        """Return the forms of an effect after adding them to those that are kept."""
        measured = (f.joint is not None and set(FILLED_BY_MODEL).isdisjoint(f.effect.reads) for f in forms)
        lasting = len(forms) > 0 and all(measured)
        (self.turning if lasting else self.forms)[known] = forms
        return forms


@dataclass
class Screen:
    """The forms of every testable effect on one problem, made once and used often.

    Args:
        problem: the fitted model beside the data; classes: of the effects, by key; free: masks of what the fit moves,
            by key.
        stock: forms that several screens share; fitted: forms of effects that the model has, by key.
    """

    problem: Problem
    classes: Mapping[str, type[Effect]]
    free: Masks = field(default_factory=dict)
    stock: FormCache = field(default_factory=FormCache)
    fitted: dict[str, Forms] = field(default_factory=dict)

    def forms(self, key: str, current: Effect | None) -> Forms:
        """Return the forms of an effect that may be missing, or that may be added to what there is of it.

        Of a sum these are always single terms; `appended` appends one to the terms that are there.

        Args:
            key: of the effect; current: the effect as a search has composed it so far, None for nothing.
        """
        cls, fitted = self.classes[key], self.problem.model.effect(key)
        known = (key, *self._depends_on(cls))
        if issubclass(cls, SumOfTerms) or (current is None and fitted is None):
            forms = self.stock.get(known)
            return self.stock.keep(known, forms_of(self.problem, cls)) if forms is None else forms
        alone = self.stock.get(known) or ()
        if current is not None:
            return forms_of(self.problem, cls, current, alone or self.fitted.get(key, ()))
        if key not in self.fitted and fitted is not None:
            every = forms_of(self.problem, cls, fitted, alone)
            self.fitted[key] = Forms.of(g for f in every if (g := self._with_fitted(f, fitted)) is not None)
        return self.fitted[key]

    def _depends_on(self, cls: type[Effect]) -> tuple[str, ...]:
        """Return keys of the model's effects that change how an effect of a class moves the arm.

        They are springs, if the effect is a load, and loads, if it reads joint loads.
        """
        springs, loads = cls.load is not Effect.load, "load" in cls.reads
        model = self.problem.model.effects
        return tuple(
            e.key for e in model if (springs and "load" in e.reads) or (loads and type(e).load is not Effect.load)
        )

    def odds(self, key: str, current: Effect | None) -> Array:
        """Return (M,) relative prior odds of the M `forms`, 0 where the effect that is there leaves no room.

        Args:
            key, current: as in `forms`.
        """
        forms, present = self.forms(key, current), current or self.problem.model.effect(key)
        odds = np.array([form.odds for form in forms], dtype=float)
        cls, others = self.classes[key], {e.key: e for e in self.problem.model.effects}
        return odds * cls.rooms([f.effect for f in forms], present, others) if issubclass(cls, SumOfTerms) else odds

    def rarity(self, key: str) -> float:
        """Return 2 log of the prior odds against one effect among all that are tried, which is their number.

        It is 0 for an effect in the model, of which more terms may be missing.
        """
        return 0.0 if self.problem.model.effect(key) is not None else 2 * float(np.log(len(self.classes)))

    def appended(self, form: Form, current: Effect | None) -> Form:
        """Return a form of a sum with its term appended to the terms that are there; other forms as they are.

        Args:
            current: the effect as a search has composed it so far; None for that of the model.
        """
        present = current or self.problem.model.effect(form.key)
        return form.appended(present) if isinstance(present, SumOfTerms) else form

    def _with_fitted(self, form: Form, fitted: Effect) -> Form | None:
        """Return a form of an effect of the model that also frees what the fit moves; None where it frees nothing new.

        What the fit already moves cannot be missing, even where it stands at a bound.

        Args:
            fitted: the effect in the model.
        """
        moved = self.free.get(fitted.key)
        if len(form.refit) != len(fitted.vector()) or moved is None:
            return form if len(form.refit) > len(fitted.vector()) else None
        return replace(form, refit=form.refit | moved) if (form.refit & ~moved).any() else None


def kind(effect: Effect) -> tuple[object, ...]:
    """Return the values of an effect's structural fields; effects with equal ones differ only in their parameters."""
    return tuple(getattr(effect, name) for name in effect.structures())
