"""Shapes of one signal side by side, each with a size of its own: several slips, a tooth that lags and leads."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product
from math import factorial, log

import numpy as np

from postproc.arrays import Array
from postproc.fit.problem import Problem
from postproc.patterns.formula import Pattern, sharper, side_by_side, spread, together, values_of
from postproc.patterns.place import Place, explained
from postproc.patterns.shapes import CLOSER, SOME, Abrupt
from postproc.patterns.signals import Signal

MOST = 5
"""Shapes side by side, at most."""
OWN = 2
"""The same of a joint by its own angle: more than a pair is the free function that the library has, but for slips."""
COLUMNS = 600
"""Columns of all shapes of a signal at a place, at most."""
PAIRED = 150
"""Shapes that are asked for the best two."""
APART = 1e-3
"""Share of a shape's square that must be left beside the others."""
ROUNDS = 3
"""How often each shape is moved, the others as they are."""

Worth = Callable[[Array, int, Array], Array]
"""Of what shapes take off the sum of squares with so many parameters, for so many that were tried."""


def chains(
    problem: Problem, seen: Place, moves: Array, signal: Signal, worth: Worth, own: bool = False
) -> Iterator[Pattern]:
    """The best shape of a signal at a place, two, three .., each of them better than any other beside the others.

    Each pays for all that it was chosen from, and their order is nothing: n! chains are one.

    Args:
        seen, moves: the place as the data sees it, and how the prediction moves with it (n, r, m).
        own: whether it is a joint, by its own angle.
    """
    some = Abrupt(signal, COLUMNS // seen.count)
    kinds = Counter(some.kinds.tolist())
    # Every kind is as likely; steps at all edges count as many as coarse ones.
    many = {kind: CLOSER * min(number, SOME if kind == "step" else number) for kind, number in kinds.items()}
    tries = np.array([len(kinds) * (1.0 if kind == "line" else many[kind]) for kind in some.kinds.tolist()])
    gram, along = seen.products(some.values)
    [one], _ = _settled(gram, along, tries, worth, [])
    yield replace(some[one], kind="line", tries=float(tries[one]), finer=None)
    # Among bumps and steps alike, several steps are soon taken for a bump, and are hard to find from there.
    starts = [("line", "step"), tuple(kinds)] if kinds["step"] else [tuple(kinds)]
    for start in starts:
        most = OWN if own and len(start) == len(kinds) else MOST
        among = np.flatnonzero(np.isin(some.kinds, start))
        inside = gram.take(among, 0).take(among, 2), along[among], tries[among]
        grown = [_settled(*inside, worth, _pair(*inside, worth)[:1])]
        while len(grown[-1][0]) < most:
            longer = _settled(*inside, worth, grown[-1][0])
            if longer[1] < grown[-1][1]:
                break
            grown.append(longer)
        # Moved closer, a shape less may do.
        for taken, _ in grown[-2:]:
            shapes = _closer(problem, seen, moves, [some[int(k)] for k in among[taken]])
            yield side_by_side(shapes, float(np.prod(tries[among[taken]])) / factorial(len(taken)))


def _settled(gram: Array, along: Array, tries: Array, worth: Worth, taken: list[int]) -> tuple[list[int], float]:
    """One more, then each in turn the best beside the others, until none is better elsewhere; what all are worth."""

    def best(others: list[int]) -> tuple[float, int]:
        parameters = (len(others) + 1) * along.shape[1]
        every = worth(_falls(gram, along, others), parameters, float(np.prod(tries[others])) * tries)
        every[others] = -np.inf
        return float(every.max()), int(np.argmax(every))

    reached, new = best(taken)
    taken = [*taken, new]
    while True:
        before = reached
        for _ in taken:
            reached, new = best(taken[1:])
            taken = [*taken[1:], new]
        if reached <= before:
            return taken, reached + 2 * log(factorial(len(taken)))


def _pair(gram: Array, along: Array, tries: Array, worth: Worth) -> list[int]:
    """Which two of some of them are worth most together: one alone may tell less than something else."""
    some = np.arange(0, len(along), -(-len(along) // PAIRED))
    i, j = some[np.stack(np.triu_indices(len(some), 1))]
    m = along.shape[1]
    whole, both = np.empty((2 * m, 2 * m, len(i))), np.hstack([along[i], along[j]]).T
    for (a, p), (b, q) in product(((0, i), (m, j)), repeat=2):
        whole[a : a + m, b : b + m] = np.moveaxis(gram[p, :, q], 0, -1)
    scale = np.einsum("iic->c", whole)  # none where the fitted parameters do all that both could
    falls = explained(whole, both, APART * np.where(scale > 0, scale, 1.0) / len(both))
    best = int(np.argmax(worth(falls, 2 * m, tries[i] * tries[j])))
    return [int(i[best]), int(j[best])]


def _falls(gram: Array, along: Array, others: list[int]) -> Array:
    """(P,) what each takes off the sum of squares together with others."""
    P, m = along.shape
    whole = gram.reshape(P * m, P * m)
    at = (np.array(others, dtype=int)[:, None] * m + np.arange(m)).ravel()
    held = whole[at][:, at]
    each = np.diag(held).reshape(-1, m).mean(axis=1)  # none where the fitted parameters do all that a shape could
    held = held + APART * np.diag(np.repeat(np.where(each > 0, each, 1.0), m))
    known = np.linalg.solve(held, np.column_stack([whole[at], along.ravel()[at]]))
    fall = float(along.ravel()[at] @ known[:, -1])
    rest = along - (whole[:, at] @ known[:, -1]).reshape(P, m)
    own = np.einsum("kikj->ijk", gram)
    scale = np.einsum("iik->k", own)
    own = own - np.einsum("kia,akj->ijk", whole[:, at].reshape(P, m, -1), known[:, :-1].reshape(-1, P, m))
    least = APART * np.where(scale > 0, scale, 1.0) / m
    seen = np.einsum("iik->k", own) > APART * scale
    return fall + np.where(seen, explained(own, rest.T.copy(), least), 0.0)


def _closer(problem: Problem, seen: Place, moves: Array, shapes: list[Pattern]) -> list[Pattern]:
    """Each where it tells most beside the others, and still what it is."""
    still = 0
    for _ in range(ROUNDS * len(shapes)):
        first, *others = shapes
        near = together([first, sharper(first)])
        columns = problem.whiten(spread(moves, values_of(others).astype(float)))
        best = int(np.argmax(seen.beside(columns).falls(values_of(near))))
        shapes = [*others, near[best]]
        still = still + 1 if best == 0 else 0
        if still == len(shapes):
            break
    return shapes
