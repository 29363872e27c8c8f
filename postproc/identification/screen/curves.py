"""CurveForms tried at places of the arm: what each takes off the residual, at the price of all that were tried."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.arrays import Array
from postproc.effects.terms import SEATED
from postproc.estimation.evidence import ROUNDING_SHARE, schwarz
from postproc.estimation.linear import Linear
from postproc.estimation.problem import Problem
from postproc.identification.curves.families import CurveForms
from postproc.identification.curves.form import Block, CurveForm, Edge, times_form
from postproc.identification.curves.functions import sharper
from postproc.identification.curves.prior import UNNAMED_LOG_PRIOR, off_everywhere
from postproc.identification.curves.signal import unit
from postproc.identification.screen.limits import limits
from postproc.identification.screen.place import Place, excess_over_noise, taken_off, with_and_without_a_row
from postproc.identification.screen.suspects import Suspect, places

MOST = 40
"""CurveForms at one place that are kept, and of all places in the end."""
SHARPER, NARROWER, SWITCHED = 1.65, 2.5, 3.0
"""As much more as a saw tooth may take off than its wave, a narrow window than a wide one around it, what acts in a
third of the rows than the same in all."""
SHAPED, FINER = 2, 1.2
"""How often a curve is refined until it has its final shape; as much more it may take off when only its numbers are."""
Kind = tuple[tuple[str, ...], str]
"""Signals by their labels, and the kind of a curve of them."""
TOGETHER = 0.97
"""Rank correlation of two channels (Spearman 1904) from which on one stands for the other."""
Made = Callable[[int], CurveForm]


@dataclass
class CurveScreen:
    """Every curve at every place, beside the parameters of a fit; the best curves are refined when asked for.

    Args:
        problem, linear: the fit; every: the curves to try.
        moves: (n, r, m) derivative by the moves of each place, by its name; prepared: places while curves are tried.
        tried: the best curves at each place, with numbers of the coarse grid.
        last: the suspects as they were last asked for; least: log evidence from which on these are refined.
    """

    problem: Problem
    linear: Linear
    every: CurveForms
    moves: dict[str, Array] = field(init=False)
    tried: tuple[Suspect, ...] = field(init=False)
    prepared: dict[str, Place] = field(default_factory=dict)
    last: list[Suspect] = field(default_factory=list)
    least: float = np.inf

    def __post_init__(self) -> None:
        self.moves = places(self.problem, weighed=bool(self.every.user_columns))
        anywhere = np.zeros(len(self.every.every))
        self.tried = tuple(one for where in self.moves for one in self._screened(where, anywhere))

    def suspects(self, least: float = 0.0) -> list[Suspect]:
        """Return the curves that explain most of the residual, strongest first, once for each of their channels.

        Args:
            least: log evidence below which a curve may come back with numbers of the coarse grid.
        """
        if least < self.least:
            # Whatever is so near the best is sharpened in any case.
            sure = max(one.evidence for one in self.tried) - UNNAMED_LOG_PRIOR
            ranked = [s for one in self._best(least) for s in one.by_each_channel(excess_over_noise(self.linear))]
            self.last = [*ranked[:1], *_together(ranked[:1], self.every), *ranked[1:]]
            self.least = 0.0 if least < sure else least
            self.prepared.clear()  # a search keeps many screens, and asks few of them again
        return self.last

    def _screened(self, where: str, anywhere: Array) -> Iterator[Suspect]:
        """Yield the best `MOST` curves with one size at a place, and all with several sizes that make sense there.

        Args:
            where: name of the place.
            anywhere: (P,) the largest fall of the sum of squares by each curve at any place so far, updated here. It
                selects the curves that are tried at arm bodies and at the tool that shifts and turns.
        """
        group = self.every.every
        for some, everywhere in self.every.at(where):
            use = np.arange(some.start, some.stop)
            values = group.values[:, some]
            # What moves a casting is seen at the joints beside it, and what turns a tool where it shifts.
            if everywhere and (where.startswith("body") or where == SEATED):
                use = use[np.argsort(-anywhere[some])[: max(MOST, len(use) // 8)]]
                values = group.values[:, use]
            falls = self._seen(where).falls(values)
            anywhere[use] = np.maximum(anywhere[use], falls)

            evidence = self._evidence_of(where, falls, self.every.prices[use])
            best = np.argpartition(-evidence, MOST)[:MOST] if len(evidence) > MOST else np.arange(len(evidence))
            best = best[np.argsort(-evidence[best])]
            # The best of each block is enough: those beside it are found again where it is refined.
            first = np.sort(np.unique(group.block_of(use[best]), return_index=True)[1])
            for k in best[first].tolist():
                yield self._suspect(where, group[int(use[k])], float(falls[k]), float(evidence[k]))
        yield from (self._tested(where, pattern) for pattern in self.every.wide if self.every.sensible(pattern, where))

    def _suspect(self, where: str, form: CurveForm, reduction: float, evidence: float) -> Suspect:
        """Return the suspect of a curve at a place, under the curve's first channel.

        Args:
            where: name of the place; form: the curve; reduction: of the sum of squares; evidence: log evidence.
        """
        suspect = Suspect(where, self.moves[where], form, reduction, evidence, self.every.price(form), form.channels[0])
        return replace(suspect, limits=lambda: self._limits(where, form))

    def _limits(self, where: str, form: CurveForm) -> tuple[Edge, ...]:
        """Return between which values the rows leave each number of a curve at a place open, in 95 % of experiments."""
        seen = self._place(where, np.float64)

        def likelihood(numbers: Array) -> Array:
            """Return (P,) 2 log likelihood of the curve with other numbers (P, K)."""
            square = seen.linear.square
            after = square - seen.falls(np.array([unit(some) for some in Block(form, numbers).raw.astype(float)]).T)
            return np.asarray(-seen.linear.freedom * np.log(np.maximum(after, ROUNDING_SHARE * square)))

        return limits(form, likelihood)

    def _tested(self, where: str, form: CurveForm) -> Suspect:
        """Return the suspect of one curve at a place, with its fall of the sum of squares and its log evidence.

        Args:
            where: name of the place; form: the curve.
        """
        linear = self._seen(where).linear
        columns = self.problem.whiten(times_form(self.moves[where], form.values))
        reduction = float(taken_off(linear, columns)[1].sum())
        evidence = schwarz(linear.square, linear.square - reduction, columns.shape[1], linear.freedom)
        return self._suspect(where, form, reduction, float(evidence) - self.every.price(form))

    def _best(self, least: float) -> list[Suspect]:
        """Return the best suspect for each place and set of channels, strongest first, at most `MOST`.

        Their log evidence is limited to what it is without the row that gains most, so that one bad reading makes no
        curve. Of several with the same evidence, that with the larger fall of the sum of squares comes first.

        Args:
            least: log evidence below which curves are not refined.
        """
        once: dict[tuple[str, tuple[str, ...]], Suspect] = {}
        for one in sorted((*self.tried, *self._sharpened(least)), key=lambda s: -s.evidence):
            once.setdefault((one.where, one.channels), one)
        best = list(once.values())[:MOST]
        limited = (self._without_a_row(s) if s.evidence > 0 else s for s in best)
        return sorted(limited, key=lambda s: (-round(s.evidence, 6), -s.rss_reduction))

    def _without_a_row(self, one: Suspect) -> Suspect:
        """Return the suspect with its log evidence limited to what it is without the row that gains most by it."""
        columns = self.problem.whiten(times_form(one.place, one.values))
        _, less = with_and_without_a_row(self._seen(one.where).linear, columns)
        return replace(one, evidence=min(one.evidence, less - one.price))

    def _evidence_of(self, where: str, falls: Array, price: Array) -> Array:
        """Return (P,) log evidence of P curves at a place.

        Args:
            where: name of the place; falls: (P,) of the sum of squares; price: (P,) 2 log of the prior odds against
                each.
        """
        seen = self._seen(where)
        square = seen.linear.square
        return np.asarray(schwarz(square, square - falls, seen.count, seen.linear.freedom) - price)

    def _strongest(self, where: str, falls: Array, price: Array, made: Made) -> Suspect:
        """Return the suspect of the best of P curves at a place.

        Args:
            where, falls, price: as in `_evidence_of`; made: returns the k-th curve.
        """
        evidence = self._evidence_of(where, falls, price)
        k = int(np.argmax(evidence))
        return self._suspect(where, made(k), float(falls[k]), float(evidence[k]))

    def _seen(self, where: str) -> Place:
        """Return the prepared `Place` of a name, made once."""
        if where not in self.prepared:
            self.prepared[where] = self._place(where)
        return self.prepared[where]

    def _place(self, where: str, precision: type = np.float32) -> Place:
        """Return a place by its name; at the ends of arm bodies a constant displacement is fitted beside it.

        Args:
            precision: in which curves are tried there.
        """
        place = self.problem.whiten(self.moves[where])
        return Place(self.linear.extended(place) if off_everywhere(where) else self.linear, place, precision)

    def _sharpened(self, required: float) -> list[Suspect]:
        """Return refined suspects: numbers on finer grids, and products with switches, where these may become the best.

        First the best curve of each kind is refined at the place where it explains most, then it is restricted by
        switches of other channels, and what turns out best is tried at every place where it makes sense.

        Args:
            required: log evidence below which no suspect is of interest.
        """
        ranked = sorted(self.tried, key=lambda s: -s.evidence)
        plain, required = ranked[0].evidence, min(required, 0.9 * self._evidence_with(ranked[0], np.inf))
        refined, closest = list[Suspect](), dict[Kind, Suspect]()
        for one in ranked:
            least = max(required, plain - UNNAMED_LOG_PRIOR)
            if self._evidence_with(one, NARROWER) < least:
                break
            if _kind(one) not in closest and (one.form.kind == "window" or self._evidence_with(one, SHARPER) >= least):
                closest[_kind(one)] = self._refined(one, refined, least)
                plain = max(plain, closest[_kind(one)].evidence)
        best = max([ranked[0], *closest.values()], key=lambda s: s.evidence)
        for one in closest.values():
            products = self._switched(one, max(required, best.evidence))
            switched = [self._refined(other, products, max(required, best.evidence)) for other in products[:1]]
            if switched and switched[0].evidence > best.evidence:
                best, refined = switched[0], [*refined, *products]
        # A curve is no more at home in what moves every direction in its own way.
        others = (where for where in self.moves if where != best.where and self.every.sensible(best.form, where))
        return [*refined, *(replace(self._tested(where, best.form), limits=best.limits) for where in others)]

    def _evidence_with(self, one: Suspect, times: float, tries: float = 1.0) -> float:
        """Return the log evidence of a suspect if its fall of the sum of squares and its rivals were multiplied.

        Args:
            times: factor on the fall; tries: factor on the number of curves that were tried.
        """
        seen = self._seen(one.where)
        square = seen.linear.square
        after = max(square - times * one.rss_reduction, 0.01 * square)
        evidence = schwarz(square, after, seen.count, seen.linear.freedom)
        return float(evidence) - 2 * float(np.log(tries)) - self.every.price(one.form)

    def _refined(self, one: Suspect, refined: list[Suspect], least: float) -> Suspect:
        """Return the best suspect of all levels while the numbers of its curve are refined level by level.

        Args:
            refined: the best suspect of every level is appended to it.
            least: log evidence; a curve that cannot reach it is refined no further than its shape.
        """
        best = one
        while near := sharper(one.form):
            if one.form.level >= SHAPED and self._evidence_with(one, FINER) < least:
                break
            price = near.of_blocks(lambda b: self.every.price(b.like))
            one = self._strongest(one.where, self._seen(one.where).falls(near.values), price, near.__getitem__)
            refined.append(one)
            best = max(best, one, key=lambda s: s.evidence)
        return best

    def _switched(self, one: Suspect, least: float) -> list[Suspect]:
        """Return, in a list, the best product of the curve, or one of its factors, with another channel's switch.

        A switch is 1 where a curve of that channel is on, and 0 elsewhere. The product is charged for all switches that
        were tried.

        Args:
            least: log evidence that it must be able to reach; else, or where no switch fits, the list is empty.
        """
        count = len(self.every.switches[0])
        if not count or one.form.wide or self._evidence_with(one, SWITCHED, count) < least:
            return []
        parts = list(self.every.grown(one.form))
        if not parts:
            return []
        falls = np.concatenate([self._seen(one.where).falls(values) for values, _ in parts])
        ends = np.cumsum([0, *(values.shape[1] for values, _ in parts)])

        def made(k: int) -> CurveForm:
            """Return the k-th product, at the price of having tried them all."""
            which = int(np.searchsorted(ends, k, side="right")) - 1
            return replace(parts[which][1](k - int(ends[which])), tries=one.form.tries * len(falls))

        price = np.full(len(falls), 2 * np.log(len(falls)) + self.every.price(one.form))
        best = self._strongest(one.where, falls, price, made)
        # A switch that is worth its price is nearly so at the coarse edge nearest to its own.
        near = one.evidence - UNNAMED_LOG_PRIOR
        return [best] if best.evidence > near and self.every.sensible(best.form, best.where) else []


def _kind(one: Suspect) -> Kind:
    """Return the labels of a suspect's signals and its curve's kind; of suspects alike in these, one is refined."""
    return tuple(s.label for s in one.form.signals), one.form.kind


def _together(first: Sequence[Suspect], every: CurveForms) -> list[Suspect]:
    """Return suspects again under each channel that varies along with their own (rank correlation over `TOGETHER`).

    Args:
        first: the suspects; every: the curves that were tried, whose lines hold the channels.
    """
    lines = {p.channels[0]: _ranks(p.values) for p in every.lines}
    return [
        replace(s, channel=name)
        for s in first
        if len(s.channels) == 1 and s.channel in lines
        for name, ranks in lines.items()
        if name != s.channel and abs(np.corrcoef(ranks, lines[s.channel])[0, 1]) > TOGETHER
    ]


def _ranks(values: Array) -> Array:
    """Return (n,) rank of each value; equal values have their mean rank."""
    _, index, count = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(count) - 0.5 * count)[index])
