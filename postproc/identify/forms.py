"""Forms of effects as whitened columns, and how far each would bring the residual down."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.base import Effect, Variant
from postproc.effects.similarity import ordinary_sizes
from postproc.fit.linear import Linear, schwarz
from postproc.fit.problem import Problem
from postproc.model.arm import Model


@dataclass(frozen=True)
class Form:
    """One way in which an effect could act on this data.

    Args:
        key: of the effect; label: which form.
        effect: with null amplitudes; refit: (q,) entries that a full fit of this form moves.
        columns: (N, m) whitened columns of the screened entries for their ordinary sizes; screened: (q,) which entries
            they are.
        forming: how many parameters beyond the screened ones a full fit would move.
        along: (N, k) columns of amplitudes that a full fit moves along, for which the form earns nothing.
        odds: how ordinary the form is beside the others. sign: 1 for a single amplitude that can only be positive.
    """

    key: str
    label: str
    effect: Effect
    refit: NDArray[np.bool_]
    columns: Array
    screened: NDArray[np.bool_]
    forming: int = 0
    along: Array | None = None
    odds: float = 1.0
    sign: int = 0

    def beside(self, effect: Effect) -> Form:
        """A term of a sum after those of an effect: it moves the arm as it does alone."""
        whole = effect.plus(self.effect)
        last = effect.with_vector(0 * effect.vector()).plus(self.effect.with_vector(self.screened.astype(float)))
        assert whole is not None and last is not None
        every = np.ones(len(whole.vector()), dtype=bool)
        return replace(self, effect=whole, refit=every, screened=last.vector() > 0)


@dataclass(frozen=True)
class Stack:
    """Forms of one width w side by side.

    Args:
        index: (M,) which forms; columns: (N, M w); gram: (M, w, w) their products; forming: (M,) parameters that only
            form the effect; flexible: (M,) whether it is a free function; sign: (M,) as in `Form`.
    """

    index: NDArray[np.int_]
    columns: Array
    gram: Array
    forming: NDArray[np.int_]
    flexible: NDArray[np.bool_]
    sign: NDArray[np.int_]


class Forms(tuple[Form, ...]):
    """Forms of an effect, stacked once for all screenings."""

    @cached_property
    def stacks(self) -> list[Stack]:
        by_width: dict[int, list[int]] = {}
        for i, form in enumerate(self):
            if form.along is None:
                by_width.setdefault(form.columns.shape[1], []).append(i)
        return [_stack(self, some) for every in by_width.values() for some in _chunks(self, every)]


def _chunks(forms: Sequence[Form], index: list[int]) -> list[list[int]]:
    size = max(1, int(4e7 / max(forms[index[0]].columns.size, 1)))
    return [index[at : at + size] for at in range(0, len(index), size)]


def _stack(forms: Sequence[Form], index: list[int]) -> Stack:
    some = [forms[i] for i in index]
    width = some[0].columns.shape[1]
    columns = np.hstack([f.columns for f in some])
    C = columns.reshape(len(columns), len(some), width).transpose(1, 0, 2)
    return Stack(
        np.array(index),
        columns,
        C.transpose(0, 2, 1) @ C,
        np.array([f.forming for f in some]),
        np.array([f.effect.roughness() is not None for f in some]),
        np.array([f.sign for f in some]),
    )


WIDE = 3.0
DECADES = (0.1, 1.0, 10.0, 100.0)
"""Ordinary sizes are known to a decade or so: amplitudes may be ten times as large or small for odds of ten, .."""
DIM = 1e-6
"""Below a thousandth of its length a direction is what the fitted parameters can do as well (this is the square)."""


def forms_of(problem: Problem, cls: type[Effect], current: Effect | None = None, alone: Sequence[Form] = ()) -> Forms:
    """All forms of one effect on the data of a problem; those that move nothing are left out.

    Args:
        alone: forms where the model has nothing of it: while all is small, what nothing else forms moves the arm beside
            others as it does alone.
    """
    found: list[Form] = []
    state = problem.sensitivity.state
    small = current is not None and current.is_null and bool(current.amplitudes().all())
    known = {form.label: form for form in alone if form.label} if small else {}
    for v in cls.variants(state, current):
        same = known.get(v.label)
        if same is None or same.columns.shape[1] != v.free.sum():
            form = make_form(problem, v, current is None)
        else:
            along = same.along if current is None else None
            form = replace(same, effect=v.effect, refit=v.refit, screened=v.free, odds=v.odds, along=along)
        if form is not None:
            found.append(form)
    return Forms(found)


def forms_nearby(problem: Problem, effect: Effect) -> Forms:
    """Forms of an effect that say its last term a little differently, each with the columns of all its terms."""
    every = (replace(v, free=v.refit) for v in effect.nearby())
    return Forms(form for v in every if (form := make_form(problem, v, fresh=False)) is not None)


def is_sum(cls: type[Effect]) -> bool:
    """Whether an effect is a sum of terms, each of which moves the arm as it does alone."""
    return cls.plus is not Effect.plus


def make_form(problem: Problem, v: Variant, fresh: bool) -> Form | None:
    """The whitened columns of a variant, None where they vanish on this data.

    Args:
        fresh: the model holds nothing of this effect (terms that it holds are free in its fit already).
    """
    columns = problem.columns(v.effect, v.free)
    if not np.isfinite(columns).all() or not columns.any():
        return None
    forming = int((v.refit & ~v.effect.amplitudes()).sum())
    extra = v.refit & v.effect.amplitudes() & ~v.free
    along = problem.columns(v.effect, extra) if fresh and extra.any() else None
    size = ordinary(problem.model, v.effect, v.free)
    low, null = v.effect.bounds()[0][v.free], v.effect.null_vector()[v.free]
    sign = int(len(low) == 1 and low[0] == null[0])
    key = type(v.effect).key
    return Form(key, v.label, v.effect, v.refit, columns * size, v.free, forming, along, v.odds, sign)


@dataclass(frozen=True)
class Gain:
    """What a form would bring.

    Args:
        fall: of the whitened sum of squares; count: parameters behind it (forming ones included).
        visible: the form at its ordinary size, in units of the noise, as far as the fitted parameters cannot do the
            same.
        evidence: 2 log of the odds against nothing, before counting how many forms were tried.
    """

    fall: float
    count: int
    visible: float
    evidence: float


NOTHING = Gain(0.0, 0, 0.0, -np.inf)


def gains(linear: Linear, forms: Forms) -> list[Gain]:
    """The gain of every form with the fitted parameters projected out (score test), forms of equal width together."""
    result: list[Gain] = [NOTHING] * len(forms)
    for i, form in enumerate(forms):
        if form.along is not None:
            result[i] = gains(linear.extended(form.along), Forms([replace(form, along=None)]))[0]
    for stack in forms.stacks:
        for i, found in zip(stack.index, _gains(linear, stack), strict=True):
            result[i] = found
    return result


def gain(linear: Linear, columns: Array, forming: int = 0, flexible: bool = False) -> Gain:
    """The gain of (N, m) columns, each for an ordinary size of its parameter."""
    one = np.zeros(1, dtype=int)
    stack = Stack(one, columns, (columns.T @ columns)[None], one + forming, np.array([flexible]), one)
    return _gains(linear, stack)[0]


def _gains(linear: Linear, stack: Stack) -> list[Gain]:
    """What each of M groups of columns C would bring.

    evidence = nu log(S / (S - q)) - log det(I + G/s^2 w^2),  q = b^T (G + s^2/w^2)^-1 b,  G = C^T M C,  b = C^T M y:
    the marginal likelihood of parameters that scatter by w = 3 ordinary sizes, with the noise s^2 left free; or by a
    decade more or less, w = 3 d, for 2 |log d|. Directions that the data cannot see cost and bring nothing.
    Source: Bayesian linear regression with a conjugate prior, e.g. O'Hagan and Forster (2004), Ch. 11.
    """
    before, freedom, forming = linear.square, float(linear.freedom), stack.forming
    M, width = stack.gram.shape[:2]
    if freedom < 2:
        return [NOTHING] * M
    inside = (linear.nuisance.T @ stack.columns).reshape(-1, M, width).transpose(1, 0, 2)
    length = np.diagonal(stack.gram, axis1=1, axis2=2)
    along = (stack.columns.T @ linear.rest).reshape(M, width)
    G = stack.gram - inside.transpose(0, 2, 1) @ inside
    value, vector = np.linalg.eigh(G)
    value = np.maximum(value, 0.0)
    part = np.einsum("mij,mi->mj", vector, along) ** 2
    # How much of each direction the fitted parameters leave, against what it is in columns of length one.
    seen = value > DIM * np.einsum("mij,mi->mj", vector**2, length)
    count = seen.sum(axis=1)
    fall = np.minimum(np.sum(part * seen / np.where(seen, value, 1.0), axis=1), before)
    left = freedom - count - forming
    s2 = np.maximum(before - fall, 1e-12 * before) / np.maximum(left, 1.0)
    worth = np.full(M, -np.inf)
    for decade in DECADES:
        wide = ((WIDE * decade) ** 2 / s2)[:, None]
        q = np.sum(wide * part / (1 + wide * value), axis=1)
        gained = freedom * np.log(before / np.maximum(before - q, 1e-12 * before))
        worth = np.maximum(worth, gained - np.sum(np.log1p(wide * value), axis=1) - 2 * abs(np.log(decade)))
    # A knee or a point is never known as well as an amplitude: half of Schwarz's price.
    worth -= 0.5 * forming * np.log(freedom)
    # A hose only pulls: what it would have to push explains nothing.
    pushes = (stack.sign == 1) & (along[:, 0] < 0)
    worth[pushes], fall[pushes] = -np.inf, 0.0
    result = []
    for m in range(M):
        if not count[m] or left[m] < 1:
            result.append(NOTHING)
            continue
        # A free function must earn every coefficient, or it would stand in for any effect of a few parameters.
        most = schwarz(before, fall[m], count[m], freedom, 1.0) if stack.flexible[m] else np.inf
        visible = float(np.sqrt(value[m].sum()))
        result.append(Gain(float(fall[m]), int(count[m] + forming[m]), visible, float(min(worth[m], most))))
    return result


def laplace(linear: Linear, rest: float, gram: Array, x: Array, wide: Array, amplitude: NDArray[np.bool_]) -> float:
    """What parameters are worth where they have been fitted, 2 log of odds, each counted by what it moves.

    nu log(S / (S' + s^2 |a/w|^2)) - log det(I + W C^T M C W / s^2): Laplace's approximation of the marginal likelihood,
    with S and S' the sums of squares without them and with them, C their columns at the fit, a the amplitudes, and W
    how far each parameter scatters: amplitudes by three ordinary sizes, or decades off as in `gains`, what only forms
    the effect by its own size. A point or a knee that the data hardly sees costs hardly anything.
    Source: MacKay (2003), Ch. 27.

    Args:
        linear: the fit without them; rest: S'. gram: (p, p) C^T M C; x: (p,) values; wide: (p,) ordinary sizes.
        amplitude: (p,) which of them are amplitudes.
    """
    before, freedom = linear.square, linear.freedom
    s2 = rest / max(freedom - len(x), 1)
    worth = -np.inf
    for decade in DECADES:
        scatter = np.where(amplitude, WIDE * decade * wide, np.maximum(np.abs(x), wide))
        strength = np.maximum(np.linalg.eigvalsh(gram * np.outer(scatter, scatter)), 0.0)
        far = s2 * float(np.sum((x[amplitude] / scatter[amplitude]) ** 2))
        gained = freedom * np.log(before / max(rest + far, 1e-12 * before)) - np.sum(np.log1p(strength / s2))
        worth = max(worth, float(gained) - 2 * abs(float(np.log(decade))))
    return worth


def ordinary(model: Model, effect: Effect, mask: NDArray[np.bool_]) -> Array:
    """Ordinary size of the parameters of a mask on an arm; rough shares of a free function are smaller than smooth."""
    size, rough = ordinary_sizes(effect, model.robot), effect.roughness()
    return np.asarray((size if rough is None else size / np.maximum(rough, 1e-12))[mask])
