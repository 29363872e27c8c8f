"""What the remaining structure follows when no effect of the library explains it: curves at places of the arm."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.channels.sight import Site
from postproc.effects.base import Effect
from postproc.effects.registry import effect_in_role
from postproc.effects.roles import Role
from postproc.effects.terms import LOADED, PLACES, SEATED, TIMES
from postproc.estimation.linear import Linear
from postproc.estimation.problem import Problem
from postproc.identification.curves.form import CurveForm, Edge, times_form
from postproc.identification.curves.prior import UNNAMED_LOG_PRIOR, off_everywhere
from postproc.identification.screen.place import excess_over_noise, taken_off

MOST_REPORTED = 5
"""Suspects that are told at most."""


@dataclass(frozen=True, eq=False)
class Suspect:
    """A place of the arm that moves with a curve of channels.

    Args:
        where: name of the place (`places`); place: (n, r, m) derivative of the prediction by its moves.
        form: the curve; limits: returns the lowest and highest value of each of its numbers that the rows leave open,
            in 95 % of experiments around the true one.
        rss_reduction: of the whitened sum of squares; evidence: log evidence, less the price.
        price: 2 log of the prior odds against it among all curves, including those of having no name.
        channel: under which it is reported; one that the curve does not depend on varies along with one that it does.
        share: of the whitened sum of squares above the noise that it explains.
    """

    where: str
    place: Array
    form: CurveForm
    rss_reduction: float
    evidence: float
    price: float
    channel: str
    share: float = 0.0
    limits: Callable[[], Sequence[Edge]] = tuple

    @property
    def key(self) -> str:
        """What it is called in a search: its place, and the kind and the channels of its curve."""
        return " ".join((self.where, self.form.kind, *self.form.channels))

    @property
    def values(self) -> Array:
        """(n,) value of the curve in every row, or (n, k) for k parts with a size each."""
        return self.form.values

    def effect(self, site: Site, sizes: Array | None = None) -> Effect:
        """Return the effect `curve` that moves the place so.

        Args:
            site: where the measured point and the instrument are; sizes: (m,) its amplitudes in the order of
                `columns`; null without them.
        """
        cls: Any = effect_in_role(Role.CURVE)
        largest = float(np.abs(self.form.raw).max()) or 1.0
        every = [(factors, gaps, largest) for factors, gaps in self.form.factors_of_terms]
        every += [([("1", "line", (0.0,))], (0.0,), 1.0)] if off_everywhere(self.where) else []
        terms = [
            cls(
                place=(self.where,),
                channels=(TIMES.join(name for name, *_ in factors),),
                basis=(TIMES.join(basis for _, basis, _ in factors),),
                numbers=tuple(x for *_, numbers in factors for x in numbers),
                gap=gaps,
                largest=(size,),
                point_m=site.point,
                instrument_m_rad=site.instrument,
            )
            for factors, gaps, size in every
        ]
        if sizes is not None:
            moves, parts = self.place.shape[2], len(self.form.factors_of_terms)
            by_term = [*sizes[: moves * parts].reshape(moves, parts).T, sizes[moves * parts :]]
            terms = [term.with_vector(x) for term, x in zip(terms, by_term, strict=False)]
        [effect] = joined(terms)
        return effect

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels of the curve; only the suspect's own where that merely varies along with them."""
        return self.form.channels if self.channel in self.form.channels else (self.channel,)

    @cached_property
    def pattern(self) -> str:
        """Description of the curve for people, with a note where the channel merely varies along with its own."""
        sentence = self.form.sentence_with(self.limits()).rstrip(",")
        together = self.channel not in self.form.channels
        return f"{sentence}; {self.channel} goes with {self.form.channels[0]} here" if together else sentence

    def columns(self, problem: Problem) -> Array:
        """Return (N, m) whitened derivatives by the suspect's m sizes, for the rows that a problem uses."""
        return problem.whiten(self.moves)

    @property
    def moves(self) -> Array:
        """(n, r, m) derivative of the prediction by the suspect's m sizes, in measured units.

        At the end of an arm body a constant displacement of the place is added, since nothing else can take it up.
        """
        moved = times_form(self.place, self.values)
        return np.concatenate([moved, self.place], axis=2) if off_everywhere(self.where) else moved

    def seen_by(self, problem: Problem, linear: Linear) -> list[Suspect]:
        """Return the suspect once per channel, with its fall and explained share on the residual of another fit.

        Args:
            problem, linear: the other fit.
        """
        reduction = float(taken_off(linear, self.columns(problem))[1].sum())
        return replace(self, rss_reduction=reduction).by_each_channel(excess_over_noise(linear))

    def by_each_channel(self, excess: float) -> list[Suspect]:
        """Return the suspect once per channel, with the share that it explains.

        Args:
            excess: the excess of the whitened sum of squares over the noise, of which the share is taken.
        """
        return [replace(self, channel=c, share=min(1.0, self.rss_reduction / excess)) for c in self.channels]


def joined(curves: Sequence[Effect]) -> list[Effect]:
    """Return the terms of several curves as one effect, in a list; an empty list of none."""
    return [reduce(lambda first, other: first.plus(other), curves)] if curves else []  # type: ignore[attr-defined]


def places(problem: Problem, weighed: bool = True) -> dict[str, Array]:
    """Return (n, r, m) derivative of the prediction by m moves of a place of the arm, by the name of the place.

    Joints and base (turn), instrument (translation, turn about the base, or what it reads), the frames of both (as they
    may move, or the base as it leans), tool (translation, with a turn where that is measured), the far end of each arm
    body but the last (turn or shift), and what carries a weight (mass and moment). Body 6 is the tool.

    Args:
        weighed: whether carried weights are places, too.
    """
    # A compliance that a missing load has pushed towards zero would hide it.
    springs = replace(problem.sensitivity, springs=problem.softer.springs)
    site = problem.site
    orientations, cls = problem.sensitivity.matrix.shape[1] > 3, effect_in_role(Role.CURVE)
    moves_of = {}
    for place in PLACES:
        if (place == SEATED and not orientations) or (place in LOADED and not weighed):
            continue
        constant = cls.null(place=(place,), channels=("1",), point_m=site.point, instrument_m_rad=site.instrument)
        moves = springs.by_parameter(constant, constant.amplitudes())
        if moves.any():
            moves_of[place] = moves
    return moves_of


def by_channel(suspects: Sequence[Suspect], further: Sequence[Suspect] = ()) -> list[Suspect]:
    """Return at most `MOST_REPORTED` suspects: the strongest of each channel, and others that were found.

    First the strongest curve, then those found beside it, its second channel, another place that it cannot be told
    from (or the joint on which a weight acts), then other channels that explain nearly the same.

    Args:
        suspects: strongest first; further: curves found once the first was fitted.
    """
    if not suspects:
        return []
    first, likely = suspects[0], _likely(suspects)
    same = list({s.channel: s for s in likely if s.where == first.where and s.form is first.form}.values())
    all_ = first.rss_reduction / max(first.share, 1e-12)
    further = [replace(s, share=min(1.0, s.rss_reduction / all_)) for s in further]
    # A second part that follows the same there comes after another channel of the first.
    again = [(s.channel, s.where) == (first.channel, first.where) for s in further]
    new, repeated = ([s for s, its in zip(further, again, strict=True) if its is which] for which in (False, True))
    # What else the same place follows comes before other places.
    best: dict[str, Suspect] = {}
    for suspect in sorted(likely, key=lambda s: s.where != first.where):
        best.setdefault(suspect.channel, suspect)
    known = {s.channel for s in same}
    dresses = [s for s in best.values() if s.channel not in known]
    return [*same[:1], *new, *same[1:2], *repeated, *_elsewhere(suspects, likely), *dresses][:MOST_REPORTED]


def _likely(suspects: Sequence[Suspect]) -> list[Suspect]:
    """Return the suspects that are unlikely to be chance, in the same order.

    Left out are those that leave over twice as much of the residual as the first without coming near its evidence, and
    those that depend on further channels with less evidence than without them.

    Args:
        suspects: strongest first.
    """
    least, most = suspects[0].evidence - UNNAMED_LOG_PRIOR, 2 * (1 - suspects[0].share)
    near = [s for s in suspects if s.evidence > least or (s.evidence > 0 and 1 - s.share < most)]
    plain: dict[frozenset[str], float] = {}
    for s in near:
        plain.setdefault(frozenset(s.channels), s.evidence)
    return [s for s in near if not any(c < set(s.channels) and plain[c] > s.evidence for c in plain)]


def _elsewhere(suspects: Sequence[Suspect], likely: Sequence[Suspect]) -> list[Suspect]:
    """Return at most one rival of the first suspect: the same channel at another place, with nearly its evidence.

    For a carried weight without such a rival, it is the joint on which the weight acts most.

    Args:
        suspects: strongest first; likely: those unlikely to be chance.
    """
    first = suspects[0]
    close = [s for s in likely if s.channel == first.channel and s.evidence > first.evidence - UNNAMED_LOG_PRIOR]
    if others := [s for s in close if s.where != first.where]:
        return others[:1]
    wound = [s for s in suspects if s.channel == first.channel and s.where.startswith("joint") and s.evidence > 0]
    return wound[:1] if first.where in LOADED else []
