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
        """Return forms with a structure of one of the ``new`` last terms slightly changed, to be tried instead."""
        return ()

    @classmethod
    def rooms(cls, terms: Sequence[Effect], held: Effect | None, others: Mapping[str, Effect]) -> NDArray[np.bool_]:
        """Tell (m,) whether each term may be added to the effect ``held`` (None: to nothing), beside others by key."""
        return np.ones(len(terms), dtype=bool)

    def generalised(self) -> Sequence[tuple[Self | None, str]]:
        """Return parts to keep (None: nothing), each with the key of a free function that may replace the rest."""
        return ()
