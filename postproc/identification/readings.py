"""What rows of tips, planes, distances and gauges would read by a model, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.estimation.problem import of_readings
from postproc.estimation.solving.setups import setups_known
from postproc.measure.kinds.base import UNKNOWNS, Readings
from postproc.measure.kinds.observed import kind_of, observed, start_of
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.model.derivatives.sensitivity import grown_sensitivity
from postproc.model.equilibrium import equilibrium
from postproc.model.uncertainty.prediction import covariance_factor, derivatives, read_uncertainty, sigma_parts
from postproc.model.uncertainty.undetermined import full_covariance

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
    balance, known = equilibrium(model, state), read_uncertainty(model)
    unknown, placing = _placed(model, state, readings, balance.T_reference_tcp[:, :3, 3], single)
    seen = observed(state, readings, balance.T_reference_tcp[:, :3, 3], unknown)
    by_unknown, by_parameter, factor = seen.by_unknown[:, 0], np.zeros((len(state), 0)), np.zeros((0, 0))
    if known is not None:
        at = grown_sensitivity(model, state)
        at = replace(at, matrix=of_readings(at, balance, seen, slice(None)))
        by_parameter = derivatives(model, state, known.all_parameters, at=at)[0][:, 0]
        factor = covariance_factor(full_covariance(known))
    noise = np.zeros(len(state)) if data.sigma is None else np.nan_to_num(data.sigma)
    variance = np.column_stack([sigma_parts(model, state)[1], noise]) ** 2
    value, parts = np.full(len(state), np.nan), np.full((len(state), 3), np.nan)
    for name, by in placing.items():
        rows = np.flatnonzero(state.setup_of_rows == name)
        G, spread, reading = by_parameter[rows], variance[rows], seen.value[rows, 0]
        if len(by):
            taken = by_unknown[rows] @ np.linalg.pinv(by_unknown[by])
            G = G - taken @ by_parameter[by]
            spread = spread + taken**2 @ variance[by] * [1.0, np.isfinite(readings.numbers[by, 0]).all()]
        if not kind_of(name).lasting:
            G, spread, reading = (np.sum(part, axis=0, keepdims=True) for part in (G, spread, reading))
        value[rows] = reading
        parts[rows] = np.sqrt(np.column_stack([np.sum((G @ factor) ** 2, axis=1), spread]))
    return PredictedReadings(value, parts)


def _placed(
    model: Model, state: State, readings: Readings, point: Array, setups: Sequence[str]
) -> tuple[Array, dict[str, NDArray[np.intp]]]:
    """Return the unknowns (n, 6) of the set-up of each row, and by which rows each set-up was placed, by its name.

    These are none where the model knows the set-up, or no other reading shares its unknown. Set-ups that nothing places
    have no entry.

    Args:
        point: (n, 3) TCP [m]; setups: names of those that count.
    """
    unknown, known = np.zeros((len(state), UNKNOWNS)), setups_known(model)
    numbers, placing = readings.numbers[:, 0], dict[str, NDArray[np.intp]]()
    for name in setups:
        rows, kind = np.flatnonzero(state.setup_of_rows == name), kind_of(name)
        if name in known or not kind.lasting:
            unknown[rows], placing[name] = known.get(name, 0.0), rows[:0]
            continue
        by = rows[np.isfinite(numbers[rows])]
        if len(by):
            unknown[rows] = start_of(state, readings, point, name)
        elif kind.unknowns(readings.zero_open) == (False, False, True):
            by = rows[:1]
        else:
            continue
        placing[name] = by
    open_ones = {name: by for name, by in placing.items() if len(by)}
    for _ in range(PLACING_STEPS if open_ones else 0):
        seen = observed(state, readings, point, unknown)
        for name, by in open_ones.items():
            missed = np.nan_to_num(numbers[by]) - seen.value[by, 0]
            step = np.linalg.lstsq(seen.by_unknown[by, 0], missed, rcond=1e-9)[0]
            unknown[state.setup_of_rows == name] += step
    return unknown, placing
