"""What is known of a parameter before any row is read: its value, how far an arm may be from it, and where from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.base import Effect
from postproc.effects.roles import Role
from postproc.effects.similarity import ordinary_sizes
from postproc.model.arm import Model
from postproc.model.scatter import WITHIN_95, stiffness_factors


@dataclass(frozen=True)
class Prior:
    """The prior of the q parameters of one effect; parameters are independent of each other.

    Args:
        value: (q,) median. spread: (q,) standard deviation, of the logarithm where ``log``; inf where nothing is known.
        log: (q,) mask of parameters that are positive, with a normal logarithm: the compliance of a spring.
        source: where value and spread come from.
    """

    value: Array
    spread: Array
    log: NDArray[np.bool_]
    source: str

    def deviation(self) -> Array:
        """Return the standard deviation (q,) of the parameters, in their units."""
        return np.asarray(np.where(self.log, self.value * lognormal_deviation(self.spread), self.spread))


def prior_of(effect: Effect, model: Model) -> Prior:
    """Return the prior of an effect's parameters on the model's arm.

    The compliance of a joint is that of the arm's file, log-normal within its factor (`stiffness_factors`). Frames may
    be anywhere. Every other amplitude scatters about null by its ordinary size; what only forms an effect scatters
    about the value that it has.
    """
    size, vector = ordinary_sizes(effect, model.robot), effect.vector()
    if effect.role is Role.JOINT_SPRINGS:
        known = model.robot.joint_compliance
        value = np.array(size if known is None else known)
        spread = np.log(stiffness_factors(model.robot)) / WITHIN_95
        source = f"{model.robot.name}, {model.robot.stiffness_source or 'ordinary size'}"
        return Prior(value, spread, np.ones(6, dtype=bool), source)
    value = np.where(effect.amplitudes(), effect.null_vector(), vector)
    return Prior(value, size, np.zeros(len(size), dtype=bool), "ordinary size")


def lognormal_deviation(spread: Array) -> Array:
    """Return the standard deviation over the median of log-normal numbers whose logarithms scatter by ``spread``."""
    square = np.minimum(np.square(spread), 50.0)
    return np.asarray(np.exp(square / 2) * np.sqrt(np.expm1(square)))
