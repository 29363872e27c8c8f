"""Forms of effects as whitened columns."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.base import Effect, Variant
from postproc.effects.similarity import ordinary_sizes
from postproc.effects.sums import SumOfTerms
from postproc.fit.linear import Linear
from postproc.fit.problem import Problem
from postproc.model.arm import Model

CHUNK = 4e6
"""Numbers in the columns of forms that are screened together: 32 MB."""


@dataclass(frozen=True)
class Turned:
    """Columns of amplitudes that turn a joint each: as the data sees its turn, by one value a row.

    Args:
        turns: (N, 6) whitened derivative by a turn of each joint; row: (N,) row of each entry; joint: (w,) from 0.
        values: (n, w).
    """

    turns: Array
    row: NDArray[np.int_]
    joint: NDArray[np.int_]
    values: Array

    @property
    def columns(self) -> Array:
        return self.turns[:, self.joint] * self.values[self.row]


@dataclass(frozen=True)
class Form:
    """One way in which an effect could act on this data.

    Args:
        key: of the effect; label: which form.
        effect: with null amplitudes; refit: (q,) entries that a full fit of this form moves.
        seen: (N, m) whitened columns of the screened entries for their ordinary sizes; screened: (q,) which entries
            they are.
        forming: how many parameters beyond the screened ones a full fit would move.
        along: (N, k) columns of amplitudes that a full fit moves along, for which the form earns nothing.
        odds: how ordinary the form is beside the others. sign: 1 for a single amplitude that can only be positive.
    """

    key: str
    label: str
    effect: Effect
    refit: NDArray[np.bool_]
    seen: Array | Turned
    screened: NDArray[np.bool_]
    forming: int = 0
    along: Array | None = None
    odds: float = 1.0
    sign: int = 0

    @property
    def columns(self) -> Array:
        return self.seen.columns if isinstance(self.seen, Turned) else self.seen

    @property
    def width(self) -> int:
        return int(self.screened.sum())

    @property
    def joint(self) -> int | None:
        """The joint that a term of a sum turns, as many others do."""
        one = (
            isinstance(self.seen, Turned)
            and isinstance(self.effect, SumOfTerms)
            and len(set(self.seen.joint.tolist())) == 1
        )
        return int(self.seen.joint[0]) if isinstance(self.seen, Turned) and one else None

    def beside(self, effect: SumOfTerms) -> Form:
        """A term of a sum after those of an effect: it moves the arm as it does alone."""
        assert isinstance(self.effect, SumOfTerms)
        marked = self.effect.with_vector(self.screened.astype(float))
        whole, last = effect.plus(self.effect), effect.with_vector(0 * effect.vector()).plus(marked)
        every = np.ones(len(whole.vector()), dtype=bool)
        return replace(self, effect=whole, refit=every, screened=last.vector() > 0)


@dataclass(frozen=True)
class Stack:
    """Forms of one width w side by side.

    Args:
        index: (M,) which forms; values: (N, M w) their columns, or (rows, M w) of turns (N, 6) of one joint (M,) each.
        gram: (M, w, w) products; forming: (M,) parameters that only form the effect; flexible: (M,) whether it is a
            free function; sign: (M,) as in `Form`.
    """

    index: NDArray[np.int_]
    values: Array
    gram: Array
    forming: NDArray[np.int_]
    flexible: NDArray[np.bool_]
    sign: NDArray[np.int_]
    turns: Array | None = None
    joint: NDArray[np.int_] | None = None

    def products(self, linear: Linear) -> tuple[Array, Array]:
        """(k, M w) with the basis of what is fitted, and (M w,) with the residual that it leaves."""
        U, y = linear.nuisance, linear.rest
        if self.turns is None or self.joint is None:
            return U.T @ self.values, self.values.T @ y
        turned = linear.by_row(np.column_stack([U, y]), self.turns)
        found = np.empty((turned.shape[1], self.values.shape[1]))
        each = np.repeat(self.joint, self.gram.shape[1])
        for j in np.unique(self.joint):
            found[:, each == j] = turned[:, :, j].T @ self.values[:, each == j]
        return found[:-1], found[-1]


class Forms(tuple[Form, ...]):
    """Forms of an effect, stacked once for all screenings."""

    @cached_property
    def width(self) -> NDArray[np.int_]:
        """(M,) how many amplitudes of each are screened."""
        return np.array([form.width for form in self], dtype=int)

    @cached_property
    def joined(self) -> list[tuple[int, Array, Forms]]:
        """Those that are fitted along with others: which, the columns of the others, and alone."""
        some = ((i, form, form.along) for i, form in enumerate(self))
        return [(i, along, Forms([replace(form, along=None)])) for i, form, along in some if along is not None]

    @cached_property
    def stacks(self) -> list[Stack]:
        alike: dict[tuple[int, bool], list[int]] = {}
        for i, form in enumerate(self):
            if form.along is None:
                alike.setdefault((int(self.width[i]), form.joint is None), []).append(i)
        return [_stack(self, some) for every in alike.values() for some in _chunks(self, every)]

    def times(self, ratio: Array) -> Forms:
        """The same with (N,) rows of their columns as many times as large."""
        by, turns = ratio[:, None], dict[int, Array]()

        def scaled(seen: Array | Turned) -> Array | Turned:
            if isinstance(seen, np.ndarray):
                return seen * by
            if id(seen.turns) not in turns:
                turns[id(seen.turns)] = seen.turns * by
            return replace(seen, turns=turns[id(seen.turns)])

        along = (None if f.along is None else f.along * by for f in self)
        return Forms(replace(f, seen=scaled(f.seen), along=a) for f, a in zip(self, along, strict=True))


def _chunks(forms: Sequence[Form], index: list[int]) -> list[list[int]]:
    first = forms[index[0]].seen
    size = max(1, int(CHUNK / max((first.values if isinstance(first, Turned) else first).size, 1)))
    return [index[at : at + size] for at in range(0, len(index), size)]


def _stack(forms: Sequence[Form], index: list[int]) -> Stack:
    some = [forms[i] for i in index]
    first, turned = some[0].seen, [f.seen for f in some if isinstance(f.seen, Turned) and f.joint is not None]
    if isinstance(first, Turned) and turned:
        rows, start = np.unique(first.row, return_index=True)
        turns: Array | None = first.turns
        joint: NDArray[np.int_] | None = np.array([one.joint[0] for one in turned])
        values = np.hstack([one.values for one in turned])[rows]
        weight: Array | None = np.add.reduceat(first.turns**2, start)[:, joint].T[:, :, None]
    else:
        turns, joint, values, weight = None, None, np.hstack([f.columns for f in some]), None
    C = values.reshape(len(values), len(some), -1).transpose(1, 0, 2)
    return Stack(
        np.array(index),
        values,
        C.transpose(0, 2, 1) @ (C if weight is None else C * weight),
        np.array([f.forming for f in some]),
        np.array([f.effect.roughness() is not None for f in some]),
        np.array([f.sign for f in some]),
        turns,
        joint,
    )


def forms_of(problem: Problem, cls: type[Effect], current: Effect | None = None, alone: Sequence[Form] = ()) -> Forms:
    """All forms of one effect on the data of a problem; those that move nothing are left out.

    Args:
        alone: forms where the model has nothing of it: while all is small, what nothing else forms moves the arm beside
            others as it does alone.
    """
    found: list[Form] = []
    state, columns = problem.sensitivity.state, _Columns(problem)
    small = current is not None and current.is_null and bool(current.amplitudes().all())
    known = {form.label: form for form in alone if form.label} if small else {}
    for v in cls.variants(state, current):
        same = known.get(v.label)
        fresh = current is None or len(v.free) == len(current.vector())
        if same is None or same.width != v.free.sum():
            form = make_form(problem, v, fresh, columns)
        else:
            along = same.along if fresh else None
            form = replace(same, effect=v.effect, refit=v.refit, screened=v.free, odds=v.odds, along=along)
        if form is not None:
            found.append(form)
    return Forms(found)


class _Columns:
    """Columns of effects by parameter, each worked out once: forms of the same law have many in common."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.known = problem, dict[Hashable, Array]()

    def __call__(self, effect: Effect, mask: NDArray[np.bool_]) -> Array:
        """(N, m) `Problem.columns` of an effect."""
        same = (*(getattr(effect, name) for name in effect.structures()), effect.vector().tobytes())
        index = np.flatnonzero(mask).tolist()
        new = np.zeros(len(mask), dtype=bool)
        new[[i for i in index if (same, i) not in self.known]] = True
        if new.any():
            some = zip(np.flatnonzero(new).tolist(), self.problem.columns(effect, new).T, strict=True)
            self.known.update(((same, i), column) for i, column in some)
        found = np.empty((len(self.problem.row), len(index)))
        for k, i in enumerate(index):
            found[:, k] = self.known[same, i]
        return found


def forms_nearby(problem: Problem, effect: Effect, new: int) -> Forms:
    """Forms of an effect that say one of its new terms a little differently, each with the columns of all its terms."""
    near = effect.nearby(new) if isinstance(effect, SumOfTerms) else ()
    every = (replace(v, free=v.refit) for v in near)
    return Forms(form for v in every if (form := make_form(problem, v, fresh=False)) is not None)


def make_form(
    problem: Problem, v: Variant, fresh: bool, columns: Callable[[Effect, NDArray[np.bool_]], Array] | None = None
) -> Form | None:
    """The whitened columns of a variant, None where they vanish on this data.

    Args:
        fresh: the variant has no more terms than the model holds (those that it holds are free in its fit already).
        columns: as `Problem.columns`, which is asked else.
    """
    columns = problem.columns if columns is None else columns
    size = ordinary(problem.model, v.effect, v.free)
    state = problem.sensitivity.state
    basis = None if v.effect.missing(state) else v.effect.basis(state)
    if basis is None:
        seen: Array | Turned = columns(v.effect, v.free) * size
    else:
        seen = Turned(problem.turns, problem.row, basis.joint[v.free], basis.values[:, v.free] * size)
    values = seen.values if isinstance(seen, Turned) else seen
    if not np.isfinite(values).all() or not values.any():
        return None
    forming = int((v.refit & ~v.effect.amplitudes()).sum())
    extra = v.refit & v.effect.amplitudes() & ~v.free
    along = columns(v.effect, extra) if fresh and extra.any() else None
    sign = int(v.free.sum() == 1 and (v.effect.bounds()[0] == v.effect.null_vector())[v.free].all())
    key = type(v.effect).key
    return Form(key, v.label, v.effect, v.refit, seen, v.free, forming, along, v.odds, sign)


def ordinary(model: Model, effect: Effect, mask: NDArray[np.bool_]) -> Array:
    """Ordinary size of the parameters of a mask on an arm; rough shares of a free function are smaller than smooth."""
    size, rough = ordinary_sizes(effect, model.robot), effect.roughness()
    return np.asarray((size if rough is None else size / np.maximum(rough, 1e-12))[mask])
