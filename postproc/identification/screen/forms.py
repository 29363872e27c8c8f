"""Forms of effects as whitened columns."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, blocks
from postproc.effects.base import Effect, Variant
from postproc.effects.similarity import ordinary_sizes
from postproc.effects.sums import SumOfTerms
from postproc.estimation.problem import Problem
from postproc.model.arm import Model

NUMBERS_AT_ONCE = 4e6
"""Numbers in the columns of forms that are screened together: 32 MB."""


@dataclass(frozen=True)
class Form:
    """One way in which an effect could act on this data.

    Args:
        key: of the effect; label: which form; effect: with null amplitudes.
        refit: (q,) mask of the parameters that a full fit of this form moves.
        values: (N, m) whitened derivatives by the screened amplitudes, in units of their ordinary sizes; or (n, m)
            turns of joints [rad], where the effect only turns joints, in proportion to its amplitudes.
        screened: (q,) mask of these amplitudes; forming: how many parameters beyond them a full fit would move.
        odds: relative prior odds among the forms; sign: 1 for a single amplitude that can only be positive, else 0.
        joint: (m,) joint, from 0, that each amplitude turns; None where ``values`` are derivatives.
    """

    key: str
    label: str
    effect: Effect
    refit: NDArray[np.bool_]
    values: Array
    screened: NDArray[np.bool_]
    forming: int = 0
    odds: float = 1.0
    sign: int = 0
    joint: tuple[int, ...] | None = None

    @property
    def width(self) -> int:
        """Number of screened amplitudes, which a score test judges together."""
        return int(self.screened.sum())

    def columns(self, problem: Problem) -> Array:
        """Return (N, m) whitened derivatives by the screened amplitudes, in units of their ordinary sizes."""
        return self.values if self.joint is None else problem.turns[:, self.joint] * self.values[problem.row]

    def appended(self, effect: SumOfTerms) -> Form:
        """Return the form with its term appended to those of an effect; its columns stay those of its own term."""
        assert isinstance(self.effect, SumOfTerms)
        marked = self.effect.with_vector(self.screened.astype(float))
        total, last = effect.plus(self.effect), effect.with_vector(0 * effect.vector()).plus(marked)
        every = np.ones(len(total.vector()), dtype=bool)
        return replace(self, effect=total, refit=every, screened=last.vector() > 0)


@dataclass(frozen=True)
class Stack:
    """M forms with the same number w of screened amplitudes, which turn the same joints if any, side by side.

    Args:
        index: (M,) position of each among all forms; values: (N or n, M w) and joint: (w,) as in `Form`.
        forming: (M,) number of parameters that only shape the effect; flexible: (M,) whether it is a free function.
        sign: (M,) as in `Form`.
    """

    index: NDArray[np.int_]
    values: Array
    joint: tuple[int, ...] | None
    forming: NDArray[np.int_]
    flexible: NDArray[np.bool_]
    sign: NDArray[np.int_]

    @classmethod
    def of(cls, some: Sequence[Form], index: Sequence[int]) -> Stack:
        """Return the stack of forms of one width.

        Args:
            index: position of each form among all of them.
        """
        values = np.hstack([form.values for form in some])
        numbers = ([f.forming, f.effect.roughness() is not None, f.sign] for f in some)
        forming, flexible, sign = np.array(list(numbers), dtype=int).T
        return cls(np.array(index), values, some[0].joint, forming, flexible.astype(bool), sign)

    @cached_property
    def gram(self) -> Array:
        """(M, w, w) inner products of the derivatives of each form."""
        C = self.values.reshape(len(self.values), len(self.index), -1).transpose(1, 0, 2)
        return np.asarray(C.transpose(0, 2, 1) @ C)


@dataclass(frozen=True)
class Forms:
    """Forms of an effect, stacked once for all screenings: their values are views of the stacks."""

    every: tuple[Form, ...] = ()
    stacks: tuple[Stack, ...] = ()

    @classmethod
    def of(cls, every: Iterable[Form]) -> Forms:
        """Return forms stacked by width and joints, at most `NUMBERS_AT_ONCE` numbers in a stack."""
        forms, stacks, groups = list(every), list[Stack](), dict[tuple[object, ...], list[int]]()
        for i, form in enumerate(forms):
            groups.setdefault((form.width, form.joint), []).append(i)
        for index in groups.values():
            width = forms[index[0]].width
            for rows in blocks(len(index), max(1, int(NUMBERS_AT_ONCE / forms[index[0]].values.size))):
                stacks.append(Stack.of([forms[i] for i in index[rows]], index[rows]))
                for k, i in enumerate(index[rows]):
                    forms[i] = replace(forms[i], values=stacks[-1].values[:, k * width : (k + 1) * width])
        return cls(tuple(forms), tuple(stacks))

    def __len__(self) -> int:
        return len(self.every)

    def __getitem__(self, at: int) -> Form:
        return self.every[at]

    def __iter__(self) -> Iterator[Form]:
        return iter(self.every)

    @cached_property
    def width(self) -> NDArray[np.int_]:
        """(M,) number of screened amplitudes of each form."""
        return np.array([form.width for form in self], dtype=int)


def forms_of(problem: Problem, cls: type[Effect], current: Effect | None = None, alone: Iterable[Form] = ()) -> Forms:
    """Return all forms of one effect on the data of a problem, without those that move nothing.

    Args:
        cls: class of the effect; current: the effect as the search or the model has it, None for nothing.
        alone: its forms on a model without it, whose columns are used again where ``current`` is null and linear.
    """
    forms: list[Form | None] = []
    small = current is not None and current.is_null and bool(current.amplitudes().all())
    known = {form.label: form for form in alone if form.label} if small else {}
    for v in cls.variants(problem.sensitivity.state, current):
        same = known.get(v.label)
        if same is None or same.width != v.free.sum():
            forms.append(make_form(problem, v))
        else:
            forms.append(replace(same, effect=v.effect, refit=v.refit, screened=v.free, odds=v.odds))
    return Forms.of(form for form in forms if form is not None)


def forms_nearby(problem: Problem, effect: Effect, new: int) -> Forms:
    """Return variants of a sum with one of its last ``new`` terms slightly changed, with the columns of all terms.

    There are none for an effect that is no sum of terms.
    """
    near = effect.nearby(new) if isinstance(effect, SumOfTerms) else ()
    every = (replace(v, free=v.refit) for v in near)
    return Forms.of(form for v in every if (form := make_form(problem, v)) is not None)


def make_form(problem: Problem, v: Variant) -> Form | None:
    """Return a variant of an effect as a form; None where it moves nothing on this data."""
    size, state = ordinary(problem.model, v.effect, v.free), problem.sensitivity.state
    basis = None if v.effect.missing(state) else v.effect.joint_basis(state)
    joint = None if basis is None else tuple(basis.joint[v.free].tolist())
    values = problem.columns(v.effect, v.free) * size if basis is None else basis.values[:, v.free] * size
    if not np.isfinite(values).all() or not values.any() or not (joint is None or problem.turns[:, joint].any()):
        return None
    forming = int((v.refit & ~v.effect.amplitudes()).sum())
    sign = int(v.free.sum() == 1 and (v.effect.bounds()[0] == v.effect.null_vector())[v.free].all())
    key = type(v.effect).key
    return Form(key, v.label, v.effect, v.refit, values, v.free, forming, v.odds, sign, joint)


def columns_of(problem: Problem, effect: Effect, mask: NDArray[np.bool_]) -> Array:
    """Return (N, k) whitened derivatives by an effect's amplitudes in a mask (q,), in units of their ordinary sizes.

    Parameters that only shape the effect have no columns while its amplitudes are null.
    """
    part = mask & effect.amplitudes()
    return problem.columns(effect, part) * ordinary(problem.model, effect, part)


def ordinary(model: Model, effect: Effect, mask: NDArray[np.bool_]) -> Array:
    """Return (p,) ordinary sizes (typical magnitudes on such an arm) of an effect's parameters in a mask (q,).

    Those of the rough parts of a free function are smaller than those of the smooth parts.
    """
    size, rough = ordinary_sizes(effect, model.robot), effect.roughness()
    return np.asarray((size if rough is None else size / np.maximum(rough, 1e-12))[mask])
