"""Whether what was found carries over: a fit without one level of a channel, which then predicts it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from postproc.diagnostics import PostprocError
from postproc.estimation.fitted import Fit
from postproc.estimation.held_out import neighbouring_blocks
from postproc.estimation.least_squares import evaluate, fit_model
from postproc.estimation.solving.solve import ROUGHLY, Terms
from postproc.identification.diagnosis import Diagnosis, Intervention, Level
from postproc.measure.errors import rms
from postproc.measure.measurements import FEWEST_ROWS_JUDGED, Measurements
from postproc.model.arm import Model

MOST_LEVELS = 6
"""Values of a channel that are a level each; more of them are parted into three ranges of about as many rows."""
HELD_OUT_CHANNELS = ("payload", "temperature", "session", "approach", "region")


def hold_out_levels(found: Diagnosis, channel: str) -> Intervention:
    """Predict each level of a channel by fits to the other levels, with and without the effects that were found.

    Args:
        found: the diagnosis; channel: one of `HELD_OUT_CHANNELS`.

    Raises:
        PostprocError: DAT036 where the table has no such channel, or only one level of it.
    """
    data = found.final.data
    levels = list(_levels(data, channel))
    if len(levels) < 2:
        message = f"`--hold-out {channel}`: the table has {'one level' if levels else 'nothing'} of it"
        help_ = (
            f"measure at two at least, {FEWEST_ROWS_JUDGED} rows each; {', '.join(HELD_OUT_CHANNELS)} can be held out"
        )
        raise PostprocError.of("DAT036", message, data.source, help=help_)
    keys = [m.key for m in found.missing]
    told = []
    for name, rows in levels:
        kept, left = data.rows(~rows), data.rows(rows)
        without = {key: _predicted(found.final, _model_without(found.final, key), kept, left, keys)[0] for key in keys}
        after, untold = _predicted(found.final, found.final.model, kept, left, keys)
        before = _predicted(found.base, found.base.model, kept, left, ())[0] if keys else after
        told.append(Level(name, int(rows.sum()), before, after, without, untold))
    return Intervention(channel, tuple(told), found.final.observed.unit)


def _model_without(fit: Fit, key: str) -> Model:
    """Return the model of a fit without one effect, by its key."""
    return fit.model.with_effects(*(e for e in fit.model.effects if e.key != key))


def _predicted(
    fit: Fit, model: Model, kept: Measurements, left: Measurements, keys: Sequence[str]
) -> tuple[float, tuple[str, ...]]:
    """Return the rms [m], [rad] of rows predicted by a model fitted to others, and keys of effects these leave open.

    Args:
        fit: tells which parameters are free, the noise and the smoothness; model: the one that is fitted.
        kept: the rows that are fitted; left: those that are predicted.
        keys: effects that were found with all rows; parameters of theirs that the fitted rows do not determine go to
            null.
    """
    free = {key: mask for key, mask in fit.free.items() if model.effect(key) is not None}
    strength = {key: value for key, value in fit.strength.items() if key in free}
    known = frozenset((key, int(i)) for key in keys if key in free for i in np.flatnonzero(free[key]))
    terms = Terms(free, strength, closely=ROUGHLY, determined=known)
    fitted = fit_model(model, kept, noise=fit.noise.stated, terms=terms)
    told = {key for key, _ in (*fitted.parameters, *fitted.at_bound)}
    own = evaluate(fitted.model, replace(left, sources=()))
    return rms(own.observed_error), tuple(key for key in keys if key in free and key not in told)


def _levels(data: Measurements, channel: str) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Yield (name, (n,) mask of its rows) of each level of a channel that has, as its rest, `FEWEST_ROWS_JUDGED` rows.

    Args:
        channel: one of `HELD_OUT_CHANNELS`.
    """
    for name, rows in _parts(data, channel):
        if FEWEST_ROWS_JUDGED <= rows.sum() <= len(data) - FEWEST_ROWS_JUDGED:
            yield name, rows


def _parts(data: Measurements, channel: str) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Yield (name, (n,) mask of its rows) of each level of a channel; none where the data lacks the channel.

    Args:
        channel: one of `HELD_OUT_CHANNELS`.
    """
    state = data.state
    if channel == "session" and state.session is not None:
        yield from ((f"`{name}`", state.session == k) for k, name in enumerate(state.session_names))
    elif channel == "approach" and state.approach is not None:
        for j in range(6):
            for side, word in ((1, "+"), (-1, "-")):
                yield f"joint {j + 1} from {word}", np.asarray(state.approach[:, j] == side)
    elif channel == "region":
        blocks = neighbouring_blocks(data.repeats, state.q)
        yield from ((f"region {k + 1}", blocks == k) for k in range(int(blocks.max()) + 1))
    elif channel in ("payload", "temperature"):
        values = state.payload_mass if channel == "payload" else state.temperature
        if values is not None:
            yield from _of_values(values, "kg" if channel == "payload" else "degC")


def _of_values(values: NDArray[np.float64], unit: str) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Yield (name, (n,) mask) of each value of at most six, otherwise of three ranges with about as many rows each.

    Args:
        values: (n,) in the unit; unit: for the name, ``kg``.
    """
    some = np.unique(np.round(values, 3))
    if len(some) <= MOST_LEVELS:
        yield from ((f"{value:g} {unit}", np.isclose(values, value, atol=1e-3)) for value in some)
        return
    edges = np.quantile(values, [0.0, 1 / 3, 2 / 3, 1.0])
    for k, (low, high) in enumerate(pairwise(edges)):
        last = k == len(edges) - 2
        yield f"{low:.4g} to {high:.4g} {unit}", (values >= low) & ((values <= high) if last else (values < high))
