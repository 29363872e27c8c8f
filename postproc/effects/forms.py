"""Forms of an effect that a diagnosis tries, and its columns by parameter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array

if TYPE_CHECKING:
    from postproc.effects.base import Effect


@dataclass(frozen=True, slots=True)
class Variant:
    """One form of an effect that a diagnosis tries.

    Args:
        effect: the effect with null amplitudes and starting values for what only forms it.
        free: (p,) which entries of ``effect.vector()`` enter linearly and are screened.
        refit: (p,) which entries a full fit of this form moves (those of ``free`` and the forming ones).
        label: what tells it from the other forms, such as ``joint 3, order 12``.
        odds: how ordinary this form is beside the others of the effect, in any unit.
    """

    effect: Effect
    free: NDArray[np.bool_]
    refit: NDArray[np.bool_]
    label: str = ""
    odds: float = 1.0

    @property
    def count(self) -> int:
        """Number of parameters that this form frees beyond those the model already holds."""
        return int((self.free | (self.refit & ~self.effect.amplitudes())).sum())


@dataclass(frozen=True, slots=True)
class JointBasis:
    """Columns of a linear effect whose every parameter moves one joint: dq[:, joint[k]] += values[:, k] * x[k].

    Args:
        joint: (p,) joint index from 0; values: (n, p) [rad per unit of the parameter].
    """

    joint: NDArray[np.int_]
    values: Array


def variant(
    effect: Effect,
    label: str = "",
    free: NDArray[np.bool_] | None = None,
    refit: Any = None,
    odds: float = 1.0,
) -> Variant:
    """A form with all amplitudes screened and everything refitted, unless masks say otherwise."""
    free = effect.amplitudes() if free is None else free
    everything = free | ~effect.amplitudes() if refit is None else refit
    return Variant(effect, free, np.asarray(everything, dtype=bool), label, odds)


def by_joint(effect: Effect) -> tuple[Variant, ...]:
    """Forms of an effect with one amplitude a joint: all joints at once, then each joint alone."""
    amplitudes = effect.amplitudes()
    where = np.array([name.rpartition("[")[2].rstrip("]") for name in effect.names()])
    alone = [(j, where == str(j)) for j in range(1, 7)]
    single = [variant(effect, f"joint {j}", here & amplitudes, here) for j, here in alone]
    return (variant(effect, "all joints"), *single)
