"""Effects that are a sum of terms, each of which moves the arm as it does alone."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from postproc.effects.base import Effect, Variant


class SumOfTerms(Effect, ABC):
    """A sum of terms of one kind: a diagnosis adds one after another, and moves all of them when a new one is in."""

    @abstractmethod
    def plus(self, term: Self) -> Self:
        """Return the effect with the terms of another one of its kind after its own."""

    def nearby(self, new: int = 1) -> tuple[Variant, ...]:
        """Return forms with the structure of one of the ``new`` last terms slightly changed, to be tried instead."""
        return ()

    @classmethod
    def rooms(cls, terms: Sequence[Effect], present: Effect | None, others: Mapping[str, Effect]) -> NDArray[np.bool_]:
        """Tell (m,) for each of m terms whether it may be added; False where another kind of effect is more likely.

        Args:
            terms: effects of one term each.
            present: the effect in the model to which it would be added; None if the model has none.
            others: effects of the model by key.
        """
        return np.ones(len(terms), dtype=bool)

    def generalised(self) -> Sequence[tuple[Self | None, str]]:
        """Return alternatives in which a free function replaces terms.

        Returns:
            Pairs of what is kept of this effect (None: nothing) and the key of the effect that may replace the rest.
        """
        return ()
