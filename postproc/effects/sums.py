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
        """The effect with the terms of another one of its kind after its own."""

    def nearby(self, new: int = 1) -> tuple[Variant, ...]:
        """The effect with a structure of one of its last terms a little off, to try where so many of them are new."""
        return ()

    @classmethod
    def rooms(cls, terms: Sequence[Effect], held: Effect | None, others: Mapping[str, Effect]) -> NDArray[np.bool_]:
        """(m,) whether each of some terms is one of the effect after those that are held, beside others (by key)."""
        return np.ones(len(terms), dtype=bool)

    def generalised(self) -> Sequence[tuple[Self | None, str]]:
        """Parts of it that stay, None for nothing, each with the key of a free function that may tell the rest."""
        return ()
