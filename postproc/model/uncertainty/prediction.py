"""How far a prediction can be trusted: parameter covariance, what stays unexplained, the range that was measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, blocks
from postproc.channels.state import State
from postproc.effects.asking import displacement_of
from postproc.effects.roles import Role
from postproc.grouping import grouped
from postproc.model.arm import Model, as_written
from postproc.model.derivatives.places import BATCH, PLACES, displacement_parts, flat
from postproc.model.derivatives.sensitivity import Sensitivity, grown_sensitivity
from postproc.model.equilibrium import predict
from postproc.model.uncertainty.field import Field
from postproc.model.uncertainty.packed import pack_correlation, unpack_correlation

JOINTS = tuple(f"q{j}" for j in range(1, 7))
OF_LOADS = (Role.JOINT_SPRINGS, Role.SETUPS)
"""Roles of effects that follow from loads alone, or only say what was read."""
MARGIN = 0.02  # of a channel's measured span: a program may go so far beyond without a word


@dataclass(frozen=True)
class Uncertainty:
    """What a fit knows about its own errors.

    Args:
        parameters: (effect key, index in its vector) of every fitted parameter.
        covariance: (p, p) in the units of the parameters.
        unexplained: standard deviation per axis [m] of what the model leaves of the true pose (not the noise of the
            instrument).
        not_identifiable: parameters that the data did not determine.
        unseen: (r, p + h) directions in which the fitted and the held ones may be off unseen, each by one standard
            deviation.
        beyond: standard deviation per axis [m] of what the model leaves of the true pose, beside ``unexplained``, where
            no measured row is near; measured: where rows are, None where nobody knows.
    """

    parameters: tuple[tuple[str, int], ...]
    covariance: Array
    unexplained: float = 0.0
    not_identifiable: tuple[tuple[str, int], ...] = ()
    unseen: Array = field(default_factory=lambda: np.zeros((0, 0)))
    link_mass: Array = field(default_factory=lambda: np.zeros((0, 0)))
    beyond: float = 0.0
    measured: Field | None = None

    @property
    def all_parameters(self) -> tuple[tuple[str, int], ...]:
        """The fitted parameters, then those that were not identifiable."""
        return (*self.parameters, *self.not_identifiable)

    def renamed(self, key: str, index: Mapping[int, int]) -> Uncertainty:
        """Return the same with other indices of the parameters of one effect, without those that have none."""
        every = self.all_parameters
        kept = [k for k, (of, i) in enumerate(every) if of != key or i in index]
        names = [(of, index[i] if of == key else i) for of, i in (every[k] for k in kept)]
        fitted = [k for k in kept if k < len(self.parameters)]
        masses = [*kept, *range(len(every), len(every) + 6)]
        return replace(
            self,
            parameters=tuple(names[: len(fitted)]),
            covariance=self.covariance[np.ix_(fitted, fitted)],
            not_identifiable=tuple(names[len(fitted) :]),
            unseen=self.unseen[:, kept] if self.unseen.size else self.unseen,
            link_mass=self.link_mass[:, masses] if self.link_mass.size else self.link_mass,
        )


def uncertainty_table(model: Model, known: Uncertainty) -> dict[str, Any]:
    """Return the keys of the table [fit] of a model file that state a fit's uncertainty.

    ``parameters`` by name, ``sigma`` of each in its own unit, their ``correlation`` as `pack_correlation` writes it,
    ``not_identifiable`` parameters, ``unseen`` directions over both, ``link_mass`` directions over both and the masses
    of the links, ``unexplained_mm``, and ``beyond_mm`` with
    ``measured``.
    """
    names = {e.key: e.names() for e in model.effects}
    sigma = np.sqrt(np.maximum(np.diag(known.covariance), 0.0))
    scale = np.where(sigma > 0, sigma, 1.0)
    correlation = known.covariance / np.outer(scale, scale)
    np.fill_diagonal(correlation, 1.0)
    return {
        "parameters": [f"{key}.{names[key][i]}" for key, i in known.parameters],
        "sigma": [float(f"{x:.9g}") for x in sigma],
        "correlation": pack_correlation(correlation),
        "not_identifiable": [f"{key}.{names[key][i]}" for key, i in known.not_identifiable],
        "unseen": _rows(known.unseen),
        **({"link_mass": _rows(known.link_mass)} if len(known.link_mass) else {}),
        "unexplained_mm": float(known.unexplained * 1e3),
        **({} if known.measured is None else {"beyond_mm": 1e3 * known.beyond, "measured": known.measured.table()}),
    }


def _rows(directions: Array) -> list[str]:
    return [" ".join(f"{x:.9g}" for x in row) for row in directions]


def parameter_name(model: Model, key: str, index: int) -> str:
    """Return the name of a parameter in model files and documents, such as ``joint_offset.offset_rad[1]``.

    Args:
        key: of its effect. index: its place in the effect's vector.
    """
    effect = model.effect(key)
    assert effect is not None
    return f"{key}.{effect.names()[index]}"


def read_uncertainty(model: Model) -> Uncertainty | None:
    """Read the uncertainty in the model's table [fit], but for parameters that it lacks.

    None without covariance, and where the rows of the fit contradict each other: their scatter is not that of an error.
    """
    if model.fit.get("contradicted"):
        return None
    listed = list(model.fit.get("parameters", []))
    open_names = list(model.fit.get("not_identifiable", []))
    covariance = stated_covariance(model.fit, len(listed))
    directions, masses = (
        np.array([row.split() if isinstance(row, str) else row for row in model.fit.get(key, [])], dtype=float)
        for key in ("unseen", "link_mass")
    )
    if covariance is None:
        if listed or not len(directions):
            return None
        covariance = np.zeros((0, 0))
    place = {f"{e.key}.{name}": (e.key, i) for e in model.effects for i, name in enumerate(e.names())}
    kept = [k for k, name in enumerate(listed) if name in place]
    parameters = tuple(place[listed[k]] for k in kept)
    unexplained, beyond = (1e-3 * float(model.fit.get(key, 0.0)) for key in ("unexplained_mm", "beyond_mm"))
    covariance = covariance[np.ix_(kept, kept)]
    known = Uncertainty(parameters, covariance, unexplained, beyond=beyond, measured=model.measured)
    open_ = [k for k, name in enumerate(open_names) if name in place] if len(directions) else []
    column = [*kept, *(len(listed) + k for k in open_)]
    return replace(
        known,
        not_identifiable=tuple(place[open_names[k]] for k in open_),
        unseen=directions[:, column] if len(directions) else known.unseen,
        link_mass=masses[:, [*column, *range(-6, 0)]] if len(masses) else known.link_mass,
    )


def stated_covariance(fit: Mapping[str, Any], count: int) -> Array | None:
    """Return the covariance (p, p) that a table [fit] states; None if it states none.

    It is stated as ``sigma`` and ``correlation``, or by hand and in older files as ``covariance``: the lower triangle,
    each row a list or a text of numbers.

    Args:
        count: number p of ``parameters``.
    """
    if fit.get("correlation") and count:
        sigma = np.array(fit["sigma"], dtype=float)
        return np.asarray(unpack_correlation(fit["correlation"], count) * np.outer(sigma, sigma))
    rows = [row.split() if isinstance(row, str) else row for row in fit.get("covariance", [])]
    if not rows:
        return None
    covariance = np.zeros((len(rows), len(rows)))
    for i, row in enumerate(rows):
        covariance[i, : i + 1] = covariance[: i + 1, i] = np.array(row[: i + 1], dtype=float)
    return covariance


def position_covariance(model: Model, state: State, known: Uncertainty, instrument: bool = True) -> Array:
    """Return the covariance (n, 3, 3) [m^2] of the predicted TCP by its parameters: E E^T + m m^T + e e^T.

    E are its errors by independent causes (`error_directions`). Beyond the range of data of a free function, these are
    errors of the function without its limit, where its parameters have their prior. The prediction keeps the value at
    the limit, and m is how far that is from the function's own. For each edge in an effect that was composed from data
    (a structural number, which no row tells closer than its two bounds) e is half of the change of the position between
    the bounds.

    Args:
        known: the uncertainty that the fit noted.
        instrument: True: as an instrument sees the TCP; False: in the base frame, where the errors of the instrument's
            frame do not count.
    """
    result = np.empty((len(state), 3, 3))
    for rows, E, missed in _errors(model, state, known, instrument):
        result[rows] = E @ E.mT + missed[:, :, None] * missed[:, None, :]
    for half in _half_steps(model, state):
        result += half[:, :, None] * half[:, None, :]
    return result


def error_directions(model: Model, state: State, known: Uncertainty, instrument: bool = True) -> Array:
    """Return the errors (n, 3, e) [m] of the predicted TCP by e independent causes, each off by a standard deviation.

    They are D F, D B^T and D m^T: D are the derivatives of the position by the parameters, F F^T is their covariance, B
    are directions in which the data leaves parameters open, and m those together with the masses of the links; for B
    and m parameters of the instrument's frame always count, as they absorb errors of others. The causes are the same
    for all states and for every model that has some of these parameters: those that it lacks move nothing.

    Args:
        known: the uncertainty that the fit noted; instrument: as of `position_covariance`.
    """
    return np.concatenate([E for _, E, _ in _errors(model, state, known, instrument)])


def _errors(model: Model, state: State, known: Uncertainty, instrument: bool) -> Iterator[tuple[slice, Array, Array]]:
    """Yield rows of states, `error_directions` there, and the distance [m] that `derivatives` says is left out."""
    count, factor = len(known.parameters), covariance_factor(known.covariance)
    for rows in blocks(len(state), BATCH):
        at = grown_sensitivity(model, state.rows(rows))
        D, missed, counted = derivatives(model, state.rows(rows), known.all_parameters, instrument, at)
        parts = [(D[:, :, :count] * counted[:count]) @ factor]
        if len(known.unseen):
            parts.append(D @ known.unseen.T)
        if len(known.link_mass):
            parts.append(np.concatenate([D, at.by_link_mass()[:, :3]], axis=2) @ known.link_mass.T)
        yield rows, np.concatenate(parts, axis=2), missed


def covariance_factor(S: Array) -> Array:
    """Return F (p, p) with F F^T = S for a covariance (p, p), which may be singular, of numbers of any sizes."""
    scale = np.sqrt(np.maximum(np.diag(S), 0.0))
    scale = np.where(scale > 0, scale, 1.0)
    size, axes = np.linalg.eigh(S / np.outer(scale, scale))
    return np.asarray(scale[:, None] * axes * np.sqrt(np.maximum(size, 0.0)))


def _half_steps(model: Model, state: State) -> Iterator[Array]:
    """Yield half the position change (n, 3) [m] between both ends of each number that the data leaves open.

    Such a number is the edge of a step, which lies anywhere between two measured values.
    """
    for effect in model.effects:
        for ends in effect.undecided():
            low, high = (model.with_effects(*(end if e is effect else e for e in model.effects)) for end in ends)
            yield 0.5 * (predict(high, state) - predict(low, state))[:, :3, 3]


def derivatives(
    model: Model,
    state: State,
    parameters: Sequence[tuple[str, int]],
    instrument: bool = True,
    at: Sensitivity | None = None,
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return the derivatives of the predicted position by parameters, and what a limited function leaves out.

    Args:
        parameters: (effect key, index in its vector) of the p parameters.
        instrument: whether parameters of the instrument's frame count, and those that only move the base as a whole.
        at: sensitivity of other numbers (n, 3) than the position; None for that.

    Returns:
        Derivatives (n, 3, p); distance (n, 3) [m] between the position by functions without the limits of their fitted
        range and the predicted one; mask (p,) of the parameters that count.
    """
    at = grown_sensitivity(model, state) if at is None else at
    columns = np.zeros((len(state), 3, len(parameters)))
    missed, counted = np.zeros((len(state), 3)), np.ones(len(parameters), dtype=bool)
    base = set() if instrument else set(model.fit.get("base", ()))
    for effect in model.effects:
        wanted = {i: k for k, (key, i) in enumerate(parameters) if key == effect.key}
        if wanted:
            counts = instrument or displacement_of(effect, at.state).instrument is None
            counted[list(wanted.values())] = counts
            free = np.isin(np.arange(len(effect.vector())), list(wanted))
            unlimited = effect.unlimited()
            columns[:, :, [wanted[i] for i in np.flatnonzero(free).tolist()]] = at.by_parameter(unlimited, free)[:, :3]
            if unlimited is not effect and counts:
                parts = [displacement_parts(displacement_of(e, at.state)) for e in (unlimited, effect)]
                moved = np.subtract(*(flat(part, len(state), PLACES) for part in parts))
                missed += (at.matrix[:, :3] @ moved[:, :, None])[:, :, 0]
    if base:
        columns[:, :, [k for k, name in enumerate(parameters) if parameter_name(model, *name) in base]] = 0.0
    return columns, missed, counted


def predict_sigma(model: Model, state: State, instrument: bool = True) -> Array:
    """Return the standard deviation of the predicted position per axis (root mean square over the axes), (n,) [m].

    NaN where the model file has no covariance.

    Args:
        instrument: True: as an instrument sees the TCP; False: in the base frame.
    """
    return np.asarray(np.hypot(*sigma_parts(model, state, instrument)))


def sigma_parts(model: Model, state: State, instrument: bool = True) -> tuple[Array, Array]:
    """Return both parts of `predict_sigma`, (n,) [m] each: by the parameters, and by what no effect explains.

    The latter is sqrt(u^2 + b^2 (1 - c)): u beside the measured rows, b more where none is near, and c what rows tell
    there of a smooth function (`Field.known`).
    """
    known = read_uncertainty(model)
    if known is None:
        return np.full(len(state), np.nan), np.full(len(state), np.nan)
    covariance = position_covariance(model, state, known, instrument)
    parameters = np.sqrt(np.maximum(np.trace(covariance, axis1=1, axis2=2), 0.0) / 3.0)
    far = np.zeros(len(state)) if known.measured is None else 1.0 - known.measured.known(state)
    return parameters, np.sqrt(known.unexplained**2 + known.beyond**2 * far)


@dataclass(frozen=True, slots=True)
class Beyond:
    """A channel that leaves the measured range.

    Args:
        channel: ``q1`` .. ``q6`` [rad], ``payload`` [kg], ``temperature`` [degC], ``dir1`` .. ``dir6`` (+1 or -1),
            ``eax_a`` .. ``eax_f`` [mm or deg].
        low, high: measured; reached: the value farthest outside; rows: (n,) which states are outside.
    """

    channel: str
    low: float
    high: float
    reached: float
    rows: NDArray[np.bool_]

    @property
    def share(self) -> float:
        """How far it is outside, as a share of the measured range; infinity where that is one value."""
        width = self.high - self.low
        return max(self.low - self.reached, self.reached - self.high) / width if width > 0 else float("inf")

    @property
    def text(self) -> str:
        """One clause that names the channel, the value it reaches and the range that was measured."""
        low, high, reached = self.low, self.high, self.reached
        if self.channel.startswith("dir"):
            side = "+" if reached > 0 else "-"
            return f"joint {self.channel[3:]} comes from its {side} side, and was measured from the other alone"
        if self.channel.startswith("q"):
            low, high, reached = np.degrees([low, high, reached]).tolist()
            return f"joint {self.channel[1:]} reaches {reached:.1f} deg, measured from {low:.1f} to {high:.1f}"
        unit = {"payload": " kg", "temperature": " degC"}.get(self.channel, "")
        return f"{self.channel} is {reached:.1f}{unit}, measured from {low:.1f} to {high:.1f}"


def range_table(states: Sequence[State] | State) -> dict[str, list[float]]:
    """Return the table [fit.range] of a model file: lowest and highest value of each channel that the states have."""
    every = [states] if isinstance(states, State) else list(states)
    values = grouped(pair for state in every for pair in _channels(state).items())
    return {n: [min(float(np.nanmin(x)) for x in v), max(float(np.nanmax(x)) for x in v)] for n, v in values.items()}


def beyond_range(model: Model, state: State) -> tuple[Beyond, ...]:
    """Return the channels in which states leave the model's measured range by over 2 % of it; empty without a range.

    Joint angles do not count for a model that has nothing but springs: a spring turns by its torque wherever the arm
    stands, and one that no row wound up has the covariance of its type.
    """
    table: Mapping[str, Any] = model.fit.get("range", {})
    if all(effect.role in OF_LOADS or effect.is_null for effect in model.effects):
        table = {name: span for name, span in table.items() if name not in JOINTS}
    beyond = []
    for name, values in _channels(state.with_(station=model.station)).items():
        if name not in table or name == "time":  # what follows the time is a session's own
            continue
        low, high = (float(x) for x in table[name])
        slack = MARGIN * (high - low)
        excess = np.nan_to_num(np.maximum(low - slack - values, values - high - slack))
        if (excess > 0).any():
            beyond.append(Beyond(name, low, high, float(values[int(np.argmax(excess))]), excess > 0))
    return tuple(beyond)


def _channels(state: State) -> dict[str, Array]:
    """Return the values (n,) of each channel that the states have, by its name in [fit.range]."""
    channels = dict(zip(JOINTS, state.q.T, strict=True))
    for name, values in (("payload", state.payload_mass), ("temperature", state.temperature), ("time", state.time)):
        if values is not None and np.isfinite(values).any():
            channels[name] = np.broadcast_to(np.asarray(values, dtype=float), (len(state),))
    if state.station is not None and state.external_axes is not None:
        stood = as_written(state.station, state.external_axes)
        channels |= {name: values for name, values in stood.items() if np.isfinite(values).any()}
    # What no row comes from is a gap of a model that may lack lost motion; 0 is a side that nobody knows.
    for j, side in enumerate(() if state.approach is None else np.where(state.approach == 0, np.nan, state.approach).T):
        if np.isfinite(side).any():
            channels[f"dir{j + 1}"] = side
    return {name: values for name, values in channels.items() if len(values)}
