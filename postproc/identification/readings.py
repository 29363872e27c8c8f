"""What rows of tips, planes, distances and gauges would read by a model, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.effects.asking import displacement_of
from postproc.effects.roles import Role
from postproc.estimation.solving.setups import setups_known
from postproc.measure.kinds.base import UNKNOWNS
from postproc.measure.kinds.observed import Observed, kind_of, observed, start_of
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.equilibrium import equilibrium
from postproc.model.uncertainty import derivatives, read_uncertainty, sigma_parts
from postproc.model.undetermined import full_covariance

PLACING_STEPS = 8
"""Gauss-Newton steps in which the unknowns of a set-up are found."""


@dataclass(frozen=True)
class PredictedReadings:
    """What rows of a table would read, (n,) [m] each, NaN in rows that read no single number.

    Args:
        value: as the table states it, the whole of a distance between two rows at the first of its ends.
        parts: (n, 3) standard deviations: by the parameters, by what no effect explains, and the noise.
    """

    value: Array
    parts: Array


def predict_readings(model: Model, data: Measurements, state: State) -> PredictedReadings | None:
    """Predict the readings of rows with a set-up; None where no row has one that reads a single number.

    The unknowns of a set-up are the model's where it knows the name. Else rows that hold a reading place it: with U the
    derivatives of their readings by the unknowns and G those by the parameters, errors dp of the parameters move the
    unknowns by -U^+ G dp. A gauge that has neither begins at 0 in its first row.

    Args:
        state: of the rows, with their tools.
    """
    readings = data.readings
    single = [name for name in state.setup_names if kind_of(name).each == 1]
    if readings is None or not single:
        return None
    balance = equilibrium(model, state)
    point, names = balance.T_reference_tcp[:, :3, 3], state.setup_of_rows
    unknown, known = np.zeros((len(state), UNKNOWNS)), setups_known(model)
    for name, values in known.items():
        unknown[names == name] = values
    F, columns = _scatter(model, state)
    turn = np.eye(3) if state.T_reference_base is None else state.T_reference_base[:, :3, :3]
    value, parts = np.full(len(state), np.nan), np.full((len(state), 3), np.nan)
    _, unexplained = sigma_parts(model, state)
    noise = np.zeros(len(state)) if data.sigma is None else np.nan_to_num(data.sigma)
    for name in single:
        rows = np.flatnonzero(names == name)
        placing = rows[np.isfinite(readings.numbers[rows, 0])]
        if name in known or not kind_of(name).lasting:
            placing = placing[:0]
        elif not len(placing) and kind_of(name).unknowns(readings.zero_open) == (False, False, True):
            placing = rows[:1]
        elif not len(placing):
            continue
        else:
            unknown[rows] = start_of(state, readings, point, name)
        seen = _placed(state, data, point, unknown, rows, placing)
        G = np.einsum("mi,mij->mj", seen.by_point[rows, 0], (turn @ columns)[rows])
        G += _by_setups(model, state.rows(rows), seen.by_unknown[rows, 0], G.shape[1])
        own, error = np.diag(unexplained[rows] ** 2), np.diag(noise[rows] ** 2)
        if len(placing):
            at = np.isin(rows, placing)
            take = seen.by_unknown[rows, 0] @ np.linalg.pinv(seen.by_unknown[placing, 0])
            G = G - take @ G[at]
            own = own + take @ own[np.ix_(at, at)] @ take.T
            error = error + (
                take @ error[np.ix_(at, at)] @ take.T if np.isfinite(readings.numbers[placing, 0]).all() else 0
            )
        if not kind_of(name).lasting:
            sums = np.ones((len(rows), len(rows)))
            G, own, error = sums @ G, sums @ own @ sums.T, sums @ error @ sums.T
            seen.value[rows, 0] = np.sum(seen.value[rows, 0])
        value[rows] = seen.value[rows, 0]
        parts[rows] = np.sqrt(np.column_stack([np.sum((G @ F) ** 2, axis=1), np.diag(own), np.diag(error)]))
    return PredictedReadings(value, parts)


def _scatter(model: Model, state: State) -> tuple[Array, Array]:
    """Return a factor (p, k) of the parameters' covariance, and the derivatives (n, 3, p) of the TCP, base axes.

    Both are empty for a model that no fit made.
    """
    known = read_uncertainty(model)
    if known is None:
        return np.zeros((0, 0)), np.zeros((len(state), 3, 0))
    size, axes = np.linalg.eigh(full_covariance(known))
    bare = model.with_effects(*(e for e in model.effects if e.role is not Role.INSTRUMENT_FRAME))
    return axes * np.sqrt(np.maximum(size, 0.0)), derivatives(bare, state, (*known.parameters, *known.held))[0]


def _by_setups(model: Model, state: State, by_unknown: Array, count: int) -> Array:
    """Return the derivatives (m, p) of readings by those parameters of the model that are unknowns of set-ups.

    Args:
        by_unknown: (m, 6) of the same readings; count: p.
    """
    result, known, effect = np.zeros((len(state), count)), read_uncertainty(model), model.in_role(Role.SETUPS)
    if known is None or effect is None:
        return result
    for k, (key, i) in enumerate((*known.parameters, *known.held)):
        if key == effect.key:
            unit = np.zeros(len(effect.vector()))
            unit[i] = 1.0
            moved = displacement_of(effect.with_vector(unit), state).setup
            result[:, k] = 0.0 if moved is None else np.sum(by_unknown * moved, axis=1)
    return result


def _placed(
    state: State, data: Measurements, point: Array, unknown: Array, rows: NDArray[np.intp], placing: NDArray[np.intp]
) -> Observed:
    """Return what rows read once those in ``placing`` have placed their set-up; ``unknown`` (n, 6) is moved to it.

    Args:
        point: (n, 3) TCP [m]; rows, placing: indices of all rows of the set-up, and of those that tell of it.
    """
    assert data.readings is not None
    numbers = np.nan_to_num(data.readings.numbers[placing, 0])
    for _ in range(PLACING_STEPS if len(placing) else 0):
        seen = observed(state, data.readings, point, unknown)
        step = np.linalg.lstsq(seen.by_unknown[placing, 0], numbers - seen.value[placing, 0], rcond=1e-9)[0]
        unknown[rows] += step
    return observed(state, data.readings, point, unknown)
