"""Predicted poses for the rows of a table.

With the standard deviation of the pose, that of a measurement of it, and a word about where the model does not hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, invert
from postproc.channels.state import State
from postproc.diagnostics import Diagnostic, PostprocError, joined
from postproc.effects.roles import Role
from postproc.estimation.findings import derived_sides
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import evaluate
from postproc.estimation.solving.session_laws import session_laws
from postproc.estimation.solving.start import FEWEST_POSES_TO_PLACE, reflectors_known
from postproc.identification.readings import predict_readings
from postproc.measure.checks.readings import SUSPICIOUS_M
from postproc.measure.errors import distances
from postproc.measure.measurements import Measurements
from postproc.measure.read.columns import columns_of
from postproc.model.arm import Model
from postproc.model.doubts import contradicted
from postproc.model.equilibrium import predict
from postproc.model.ordered import with_ordered_channels
from postproc.model.uncertainty.prediction import (
    beyond_range,
    covariance_factor,
    derivatives,
    read_uncertainty,
    sigma_parts,
)
from postproc.model.uncertainty.undetermined import full_covariance

SIGMA_PARTS = ("parameters", "unexplained", "noise")
COLUMNS_OF_ALL = "pose_id,x_mm,y_mm,z_mm,sigma_mm,sigma_measured_mm"
PREDICTION_HEADER = ",".join([COLUMNS_OF_ALL, *(f"sigma_{part}_mm" for part in SIGMA_PARTS)])


@dataclass(frozen=True)
class Prediction:
    """One predicted position per row of the table, in the instrument's frame, or in the work object that a row states.

    Args:
        pose_id: (n,) labels. position: (n, 3) [m], NaN where the row has no commanded joints.
        sigma: (n,) standard deviation of the true position per axis [m], NaN where the model file has no covariance.
        measured: (n,) that of a measurement of it, with the noise of instrument and arm, NaN where that is not known.
        parts: (n, 3) standard deviations [m] that these two consist of: by the parameters, by what no effect explains,
            and the noise.
        reading: (n,) what rows of a plane, a distance or a gauge would read [m], NaN in others, whose standard
            deviations are those of the reading. None where no row reads such a number.
        diagnostics: effects and channels for which the model does not hold here, and where the instrument stands.
    """

    pose_id: tuple[str, ...]
    position: Array
    sigma: Array
    measured: Array
    parts: Array
    reading: Array | None = None
    diagnostics: tuple[Diagnostic, ...] = ()

    def as_csv(self) -> str:
        """Return the prediction as CSV (``PREDICTION_HEADER``), a row for each input row, empty if unknown."""
        lines = [PREDICTION_HEADER + ("" if self.reading is None else ",predicted_mm")]
        numbers = [self.position, self.sigma, self.measured, self.parts]
        columns = np.column_stack(numbers if self.reading is None else [*numbers, self.reading]) * 1e3
        for label, row in zip(self.pose_id, columns, strict=True):
            lines.append(",".join([label, *(f"{x:.5f}" if np.isfinite(x) else "" for x in row)]))
        return "\n".join(lines) + "\n"


def predict_rows(model: Model, data: Measurements, place: bool = False) -> Prediction:
    """Predict the true TCP position for every row of a table, with its standard deviation.

    Args:
        place: whether the instrument's frame is fitted to rows that hold a measured position; else it is the model's.

    Raises:
        PostprocError: DAT034 where an effect of the order of rows belongs to another table; DAT035 where too few rows
            place the instrument.
    """
    good = np.asarray(np.isfinite(data.state.q).all(axis=1))
    seen = np.asarray(good & np.isfinite(data.position).all(axis=1) & ~data.off_arm)
    placed = _place(model, data.rows(seen)) if place else None
    findings, known = list[Diagnostic](), model
    if placed is not None:
        surest = None if model.surest is None else _place(model.surest, data.rows(seen)).model
        known = replace(placed.model, surest=surest)
        message = f"{len(placed.data) - len(placed.excluded)} measured rows place the instrument anew; "
        message += f"they are off by {1e3 * placed.rms:.3f} mm per axis then"
        findings.append(Diagnostic("DAT035", "info", message, placed.data.source))
    some = data.rows(good)
    some = replace(some, state=with_ordered_channels(known, some.state))
    findings += session_laws(model, data)
    state = some.state if data.tool_known else some.state.with_(T_flange_tcp=model.T_flange_tcp)
    position, parts = np.full((2, len(data), 3), np.nan)
    position[good] = predict(known, state)[:, :3, 3]
    parts[good, 0], parts[good, 1] = sigma_parts(known, state)
    if placed is not None:
        parts[good, 0] = _sigma_placed(placed, state)
    parts[good, 2] = _noise(model, some)
    read, reading = predict_readings(known, some, state), None
    if read is not None:
        reading = np.full(len(data), np.nan)
        reading[good], single = read.value, np.isfinite(read.value)
        parts[np.flatnonzero(good)[single]] = read.parts[single]
    sigma, measured = np.hypot(parts[:, 0], parts[:, 1]), np.sqrt(np.sum(parts**2, axis=1))
    if placed is None:
        findings += _elsewhere(model, data, seen, position)
    findings += [
        *contradicted(model, data.source),
        *derived_sides(model, data),
        *_unread_effects(model, state, data),
        *_beyond(model, state, data),
    ]
    findings += _unknown_reflectors(known, state, data)
    if data.T_frame_object is not None:
        stated = np.isfinite(data.T_frame_object).all(axis=(1, 2))
        T = invert(data.T_frame_object[stated])
        position[stated] = (T[:, :3, :3] @ position[stated, :, None])[:, :, 0] + T[:, :3, 3]
    # The far ends of distances between rows stand behind all rows of a table.
    rows = slice(0, data.listed)
    columns = (position[rows], sigma[rows], measured[rows], parts[rows], None if reading is None else reading[rows])
    return Prediction(data.pose_id[rows], *columns, tuple(findings))


def _noise(model: Model, data: Measurements) -> Array:
    """Return (n,) noise of a measured position [m], NaN where unknown.

    It is that of the fit; where the row states `sigma_mm`, it is that combined with the arm's repeatability.
    """
    noise, arm = model.fit.get("noise_mm"), model.fit.get("noise_repeatability_mm")
    level = np.full(len(data), np.nan if noise is None else 1e-3 * float(noise))
    if data.sigma is None or arm is None:
        return level
    return np.where(np.isfinite(data.sigma), np.hypot(data.sigma, 1e-3 * float(arm)), level)


def _place(model: Model, seen: Measurements) -> Fit:
    """Return the model with its instrument frame alone fitted to measured rows.

    Raises:
        PostprocError: DAT035 where these are too few, or stand in line.
    """
    if len(np.unique(np.round(seen.state.q, 6), axis=0)) < FEWEST_POSES_TO_PLACE:
        message = f"{len(seen)} rows hold a measured position: they do not place the instrument"
        help_ = f"measure {FEWEST_POSES_TO_PLACE} poses at least, far from each other and not in line"
        raise PostprocError.of("DAT035", message, seen.source, help=help_)
    bare = model.with_effects(*(e for e in model.effects if e.role is not Role.INSTRUMENT_FRAME))
    placed = evaluate(bare, replace(seen, rotation=None, joint=None))
    if any(key == "instrument_frame" for key, _ in placed.unidentifiable):
        message = f"the {len(seen)} measured positions stand in line: they do not place the instrument"
        raise PostprocError.of("DAT035", message, seen.source, help="measure poses far from each other, not in line")
    return placed


def _sigma_placed(placed: Fit, state: State) -> Array:
    """Return (n,) standard deviation per axis [m] by the parameters of a model whose instrument was placed anew.

    With D_x the derivatives of measured positions by the frame, D_p those by the other parameters, whose covariance is
    F F^T, the placed frame is off by D_x^+ (D_p F z + s w), z and w standard normal: what the model is off at the rows
    that placed it, it takes up.

    Args:
        placed: the model with its fitted instrument frame; state: of the n rows.
    """
    model, seen = placed.model, placed.problem.sensitivity.state
    known = read_uncertainty(model)
    if known is None:
        return np.full(len(state), np.nan)
    names = known.all_parameters
    counted = derivatives(model, state.rows(slice(0, 1)), names, instrument=False)[2]
    factor = covariance_factor(full_covariance(known)[np.ix_(counted, counted)])
    names = (*placed.parameters, *(name for name, one in zip(names, counted, strict=True) if one))
    measured, count = placed.problem.weights.used[:, :3], len(placed.parameters)
    D, at_rows = derivatives(model, state, names)[0], derivatives(model, seen, names)[0][measured]
    inverse = np.linalg.pinv(at_rows[:, :count])
    off = (D[:, :, count:] - D[:, :, :count] @ (inverse @ at_rows[:, count:])) @ factor
    scatter = np.sqrt(placed.scatter_of_parameters) / float(np.mean(placed.problem.weights.values[:, :3]))
    noise = scatter * D[:, :, :count] @ inverse
    return np.asarray(np.sqrt((np.sum(off**2, axis=(1, 2)) + np.sum(noise**2, axis=(1, 2))) / 3))


def _elsewhere(model: Model, data: Measurements, seen: NDArray[np.bool_], position: Array) -> Iterator[Diagnostic]:
    """Yield DAT035 where measured positions lie over `SUSPICIOUS_M` from the predicted ones in the median row.

    Args:
        seen: (n,) mask of rows with a measured position; position: (n, 3) predicted [m].
    """
    off = distances(data.position[seen] - position[seen])
    if not len(off) or np.median(off) < SUSPICIOUS_M:
        return
    message = f"the measured positions lie {1e3 * np.median(off):.0f} mm from the predicted ones in the median row"
    help_ = "is the instrument set up anew? `--place` places it by these rows"
    if model.in_role(Role.INSTRUMENT_FRAME) is None:
        help_ = f"the model does not know where the instrument stands; {help_.partition('? ')[2]}"
    yield Diagnostic("DAT035", "warning", message, data.source, help=help_)


def _unread_effects(model: Model, state: State, data: Measurements) -> Iterator[Diagnostic]:
    """Yield DAT021 for effects that read channels that the table lacks."""
    for effect in model.effects:
        unread = effect.missing(state)
        if unread and not effect.is_null and {"session", "reflector"}.isdisjoint(unread):
            message = f"`{effect.key}` is left out: the table has no {' and no '.join(map(columns_of, unread))}"
            help_ = "record it, or fit a model without the effect"
            if "row" in unread:
                help_ = "rows of the table that it was fitted to are numbered with `--rows-in-order`; else leave it out"
            yield Diagnostic("DAT021", "warning", message, data.source, help=help_)


def _unknown_reflectors(model: Model, state: State, data: Measurements) -> Iterator[Diagnostic]:
    """Yield DAT021 for reflectors of which the model does not know where they are on the tool."""
    known, names = reflectors_known(model), dict.fromkeys(state.reflector_of_rows.tolist())
    some = [*[*known][:1], *(name for name in names if name not in (*known, *data.references))]
    if state.reflector is not None and (unknown := some[1:]):
        listed, many = joined([f"`{name}`" for name in unknown]), len(unknown) > 1
        message = f"the model does not know where {listed} {'are' if many else 'is'} on the tool: "
        message += f"{'their' if many else 'its'} rows are predicted as those of `{some[0]}`"
        help_ = "measured rows of it and `--place` tell"
        yield Diagnostic("DAT021", "warning", message, data.source, help=help_)


def _beyond(model: Model, state: State, data: Measurements) -> Iterator[Diagnostic]:
    """Yield DAT023 for channels beyond the range of the data that the model was fitted to."""
    for beyond in beyond_range(model, state):
        count = int(beyond.rows.sum())
        rows = "1 row leaves" if count == 1 else f"{count} rows leave"
        message = f"{rows} the range in which the model was measured: {beyond.text}"
        yield Diagnostic("DAT023", "warning", message, data.source, help="measure there before relying on it")
