"""What is known of a parameter before any row is read: its value, how far an arm may be from it, and where from."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.effects.base import Effect
from postproc.effects.roles import Role
from postproc.effects.similarity import ordinary_sizes
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model, StatedPrior
from postproc.model.uncertainty.prediction import read_uncertainty
from postproc.model.uncertainty.scatter import NORMAL_95, stiffness_factors

UNDETERMINED_SHARE = 0.7
"""Share of its prior deviation above which a parameter was not determined: rows have said less than half of it."""
TAIL = 2.0
"""Deviations of a logarithm beyond which a prior pulls no harder, and of an ordinary size beyond which it pulls less
again: an arm may be unlike all others of its type, if the rows say so clearly."""
ORDINARY = "ordinary size"
"""Source of the prior of an amplitude of which nothing else is known."""
CHANGED = 0.1
"""Share of its first deviation by which an arm may have changed since an earlier table: zeros move, parts wear."""


@dataclass(frozen=True)
class Prior:
    """The prior of the q parameters of one effect; parameters are independent of each other.

    Args:
        value: (q,) median. spread: (q,) standard deviation, of the logarithm where ``log``; inf where nothing is known.
        log: (q,) mask of parameters that are positive, with a normal logarithm: the compliance of a spring.
        heavy: (q,) mask of amplitudes whose spread is an ordinary size: normal up to `TAIL` spreads, beyond with the
            density z^-TAIL^2 (that of Student's t with 3 degrees of freedom).
        source: (q,) where value and spread come from.
    """

    value: Array
    spread: Array
    log: NDArray[np.bool_]
    heavy: NDArray[np.bool_]
    source: tuple[str, ...]

    def deviation(self, x: Array | None = None) -> Array:
        """Return the standard deviation (q,) of the parameters, in their units.

        Args:
            x: (q,) values; beyond `TAIL` ordinary sizes, the deviation of the normal distribution that pulls as much.
        """
        spread = np.where(self.log, self.value * lognormal_deviation(self.spread), self.spread)
        if x is None:
            return np.asarray(spread)
        return np.asarray(np.where(self.heavy, np.maximum(spread, np.abs(self.off(x)) / TAIL), spread))

    def some(self, index: NDArray[np.int_]) -> Prior:
        """Return the prior of some of the parameters, by their indices."""
        source = tuple(self.source[i] for i in index)
        return Prior(self.value[index], self.spread[index], self.log[index], self.heavy[index], source)

    def off(self, x: Array) -> Array:
        """Return how far values (q,) are from the medians, of positive parameters in logarithms."""
        result, log = x - self.value, self.log & (x > 0)
        result[log] = np.log(x[log] / self.value[log])
        return np.asarray(result)

    def weight(self, x: Array) -> Array:
        """Return the weights (q,) 1 / S^2 at x (q,), less beyond `TAIL`: half the slope of `cost` over the distance."""
        share = np.minimum(1.0, TAIL * self.spread / np.maximum(np.abs(self.off(x)), 1e-300))
        share = np.where(self.log & (x > 0), share, np.where(self.heavy, share**2, 1.0))
        return np.asarray(share * self.spread**-2.0)

    def cost(self, x: Array) -> float:
        """Return minus twice the logarithm of the density at x (q,), but for a constant.

        With z the deviations from the median, it is z^2 up to T = `TAIL`; beyond, T (2 z - T) of logarithms and
        T^2 (1 + 2 ln(z / T)) of amplitudes with an ordinary size.
        """
        z = np.abs(self.off(x) / self.spread)
        far = np.maximum(z, TAIL) / TAIL
        beyond = np.where(self.log, 2 * far - 1, np.where(self.heavy, 1 + 2 * np.log(far), far**2))
        return float(np.sum(np.where(z > TAIL, TAIL**2 * beyond, z**2)))


def prior_of(effect: Effect, model: Model) -> Prior:
    """Return the prior of an effect's parameters on the model's arm.

    What the model states of a parameter counts (`Model.priors`). Else the compliance of a joint is that of the arm's
    file, log-normal within its factor (`stiffness_factors`). Every other amplitude scatters about null by its ordinary
    size, with a heavy tail: no size is ordinary for all arms, and a heavy part is not made lighter for being rare. What
    only forms an effect scatters about the value that it has.
    """
    size, vector, robot = ordinary_sizes(effect, model.robot), effect.vector(), model.robot
    log = np.full(len(size), effect.role is Role.JOINT_SPRINGS)
    heavy = effect.amplitudes() & ~log
    if effect.role is Role.JOINT_SPRINGS:
        value = np.array(size if robot.joint_compliance is None else robot.joint_compliance)
        spread = np.log(stiffness_factors(robot)) / NORMAL_95
        source = [f"stiffness of the type {robot.name}, {robot.stiffness_source or 'an ordinary size'}"] * len(size)
    else:
        value, spread = np.where(effect.amplitudes(), effect.null_vector(), vector), np.array(size)
        source = [ORDINARY] * len(size)
    names = effect.names() if model.priors else ()
    for i, name in enumerate(names):
        stated = model.priors.get(f"{effect.key}.{name}")
        if stated is not None and (stated.value > 0 or not log[i]):
            share = stated.sigma / stated.value if log[i] else 0.0
            value[i], source[i], heavy[i] = stated.value, stated.source, False
            spread[i] = np.sqrt(np.log1p(share**2)) if log[i] else stated.sigma
    return Prior(value, spread, log, heavy, tuple(source))


def prior_at(model: Model, effects: Sequence[Effect], names: Sequence[tuple[str, int]]) -> Prior:
    """Return the prior of some parameters, by effect key and index in its vector, of effects on the model's arm."""
    every = {e.key: prior_of(e, model) for e in effects}
    value, spread, log, heavy = (
        np.array([getattr(every[key], part)[i] for key, i in names], dtype=kind)
        for part, kind in (("value", float), ("spread", float), ("log", bool), ("heavy", bool))
    )
    return Prior(value, spread, log, heavy, tuple(every[key].source[i] for key, i in names))


def with_earlier_fit(model: Model, data: Measurements) -> Model:
    """Return the model with what its fit to other tables has determined as priors; unchanged for a fit to this data.

    Rows must not count twice: a model that was fitted to one of these files keeps the priors that it had before. Frames
    and free functions have none: instruments are set up anew.
    """
    hashes = model.fit.get("data_sha256", [])
    before = {hashes} if isinstance(hashes, str) else set(hashes)
    known = read_uncertainty(model)
    if known is None or not before or before & {hashlib.sha256(s.data).hexdigest() for s in data.sources}:
        return model
    square = np.concatenate([np.diag(known.covariance), np.zeros(len(known.not_identifiable))])
    if len(known.unseen):
        square += np.sum(known.unseen**2, axis=0)
    sigma = dict(zip(known.all_parameters, np.sqrt(square).tolist(), strict=True))
    tables = model.fit.get("data", "an earlier table")
    source = f"fit to {tables if isinstance(tables, str) else ', '.join(tables)}"
    priors = dict(model.priors)
    for effect in model.effects:
        if is_placed(effect) or effect.about_data or effect.roughness() is not None:
            continue
        first = prior_of(effect.with_vector(effect.null_vector()), model).deviation()
        for i, name in enumerate(effect.names()):
            deviation = sigma.get((effect.key, i), np.inf)
            if effect.amplitudes()[i] and deviation < UNDETERMINED_SHARE * first[i]:
                wider = float(max(deviation, CHANGED * first[i]))
                priors[f"{effect.key}.{name}"] = StatedPrior(float(effect.vector()[i]), wider, source)
    return replace(model, priors=priors)


def is_placed(effect: Effect) -> bool:
    """Return whether an effect says where something was put: the instrument, the tool, points on it, a set-up."""
    return effect.role is Role.WORK_OBJECTS or may_be_anywhere(effect)


def may_be_anywhere(effect: Effect) -> bool:
    """Return whether any place is as likely as another: that of a work object is nearly known."""
    return effect.is_frame or effect.role in (Role.SESSION_FRAMES, Role.REFLECTOR_POINTS, Role.SETUPS)


def lognormal_deviation(spread: Array) -> Array:
    """Return the standard deviation over the median of log-normal numbers whose logarithms scatter by ``spread``."""
    square = np.minimum(np.square(spread), 50.0)
    return np.asarray(np.exp(square / 2) * np.sqrt(np.expm1(square)))
