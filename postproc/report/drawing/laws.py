"""The laws that a fit has found: where an effect moves the arm over the channel that it follows, with band and data.

Everything is asked of the effect itself, through what every effect answers: its displacement and its load at states.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.channels.units import unit_of
from postproc.effects.asking import displacement_of, load_of
from postproc.effects.base import Effect
from postproc.estimation.fitted import Fit
from postproc.identification.compare import LEAST_LEVER_M
from postproc.model.derivatives.places import BODY, INSTRUMENT, JOINT, PLACES, TOOL, displacement_parts, flat
from postproc.report.drawing.charts import DrawnCurve, scatter
from postproc.robot.kinematics import body_poses

GRID, ROWS = 80, 24  # values of a channel, and measured rows over which the law is averaged at each of them
LARGEST_SCATTER = 0.3  # of the variance, that may not follow the channel of a law
MINOR = 0.15  # of the largest, that a coordinate must move to be drawn
MOST_COORDINATES = 4  # coordinates of one effect
PREFIXES = {"q": "q", "pose": "q", "v": "v", "a": "a", "approach": "dir", "load": "load", "wrench": "f"}
CHANNEL_FIELDS = {"q": "q", "v": "v", "a": "a", "dir": "approach", "load": "joint_load"}


@dataclass(frozen=True, slots=True)
class Law:
    """The dependence of one displacement, or joint torque, of an effect on the channel that explains it best.

    Args:
        effect: its key; where: the displaced coordinate or the joint, for people; unit: of y; channel: name.
        x: (n,) values of the channel in SI units.
        y: (n,) effect plus residual at the measured rows, in thousandths (mm, mrad); of a torque the effect [N m].
        curve: the effect over values of the channel, averaged over the other channels as they were measured.
    """

    effect: str
    where: str
    unit: str
    channel: str
    x: Array
    y: Array
    curve: DrawnCurve


def laws_of(fit: Fit, keys: Iterable[str]) -> list[Law]:
    """Return the curves of some effects of a fitted model over the channel that each follows.

    Effects that are constant over the rows, or that follow no single channel, have none.

    Args:
        keys: of the effects; those that the model lacks have no curve.
    """
    state, named = fit.problem.sensitivity.state, fit.problem.channels
    laws = []
    for key in keys:
        effect = fit.model.effect(key)
        if effect is not None and not effect.is_null and not effect.missing(state):
            laws += _laws(fit, effect, state, named)
    return laws


def law_charts(laws: Iterable[Law]) -> list[str]:
    """Return an SVG chart of each curve, with the data around it."""
    charts = []
    for law in laws:
        unit, factor = unit_of(law.channel)
        curve = DrawnCurve(law.curve.x * factor, law.curve.y, law.curve.sigma)
        label = f"{law.channel} [{unit}]" if unit else law.channel
        title = f"{law.effect}: {law.where}"
        charts.append(scatter(law.x * factor, law.y, label, law.unit, title=title, curve=curve))
    return charts


def _laws(fit: Fit, effect: Effect, state: State, named: dict[str, Array]) -> list[Law]:
    """Return the curves of one effect at the coordinates that it moves most, at most four.

    Args:
        state: of the measured rows. named: the channels of the fit by name, (n,) each.
    """
    amounts, moved = coordinates, coordinates(effect, state)
    loads = not moved.any()
    if loads:
        amounts, moved = torques, torques(effect, state)
    # What is the same in all rows differs by rounding.
    size = np.where(np.ptp(moved, axis=0) > 1e-9 * np.abs(moved).max(axis=0), moved.std(axis=0), 0.0)
    laws = []
    for k in np.argsort(-size, kind="stable")[:MOST_COORDINATES]:
        channel = _channel(effect, int(k), moved[:, k], named) if size[k] > 0 else None
        if size[k] < MINOR * size.max() or channel is None:
            continue
        curve = _curve(fit, effect, state, (channel, named[channel]), (amounts, int(k)))
        y = moved[:, k] if loads else moved[:, k] + 1e3 * _residual(fit, int(k))
        where, unit = (f"torque on joint {k + 1}", "N m") if loads else place_name(int(k))
        laws.append(Law(effect.key, where, unit, channel, named[channel], y, curve))
    return laws


def coordinates(effect: Effect, state: State) -> Array:
    """Return how far an effect moves each of the 60 coordinates of `model.derivatives.places`, (n, 60) [mrad or mm]."""
    return 1e3 * flat(displacement_parts(displacement_of(effect, state)), len(state), PLACES)


def torques(effect: Effect, state: State) -> Array:
    """Return the torques (n, 6) [N m] that an effect puts on the joints, its forces on bodies included.

    tau_j = sum of z_j . (m_b - p_j x f_b) over the bodies b behind joint j, wrenches about the base origin.
    """
    load = load_of(effect, state)
    result = np.zeros((len(state), 6)) if load.joint is None else np.array(load.joint, dtype=float)
    assert state.robot is not None and state.T_base_body is not None
    for body, wrench in load.body.items():
        for j in range(min(body, 6)):
            T = state.T_base_body[:, j + 1]
            moment = wrench[:, 3:] - np.cross(T[:, :3, 3], wrench[:, :3])
            result[:, j] += np.sum((T[:, :3, :3] @ state.robot.axis[j]) * moment, axis=1)
    return result


def place_name(k: int) -> tuple[str, str]:
    """Return the name of coordinate k of `model.derivatives.places`, and the unit to show it in, ``mm`` or ``mrad``."""
    if k < BODY:
        return f"joint {k - JOINT + 1}", "mrad"
    begin = next(start for start in (INSTRUMENT, TOOL, BODY) if k >= start)
    name = {INSTRUMENT: "instrument", TOOL: "tool"}.get(begin, f"body {(k - BODY) // 6}")
    axis, turned = "xyz"[(k - begin) % 3], (k - begin) % 6 >= 3
    return f"{name}, {'turned about' if turned else 'shifted along'} {axis}", "mrad" if turned else "mm"


def _channel(effect: Effect, k: int, values: Array, named: dict[str, Array]) -> str | None:
    """Return the channel that explains most of (n,) values; None if none explains 70 % of their variance.

    The unexplained share is estimated from differences of successive rows, in the order of the channel (von Neumann).

    Args:
        effect: only channels that it reads are tried. named: channels by name, (n,) each.
        k: coordinate of the values; its own joint's channel comes first among equals.
    """
    read = [PREFIXES.get(name, name) for name in effect.reads]
    channels = [
        c for c in named if c in read or (c[:-1] in read and c[-1:].isdigit()) or (c[:1] == "f" and "f" in read)
    ]
    best, least = None, LARGEST_SCATTER
    # At a joint its own channel comes first among those that explain as much.
    for channel in sorted(channels, key=lambda c: c[-1:] != str(k + 1)):
        y = values[np.lexsort((values, named[channel]))]
        spread = float(np.sum((y - y.mean()) ** 2))
        scatter = float(np.sum(np.diff(y) ** 2)) / (2 * spread) if spread > 0 else 1.0
        if scatter < 0.8 * least:
            best, least = channel, scatter
    return best


def _curve(
    fit: Fit, effect: Effect, state: State, along: tuple[str, Array], seen: tuple[Callable[[Effect, State], Array], int]
) -> DrawnCurve:
    """Return an effect's curve along a channel, averaged over up to 24 measured rows, with its standard deviation.

    Args:
        along: name of the channel and its values (n,).
        seen: function that returns the displacements or torques (n, m) of an effect in n states, and which is drawn.
    """
    (channel, values), (amounts, k) = along, seen
    known = np.unique(values)
    at = known if len(known) <= 6 else np.linspace(values.min(), values.max(), GRID)
    rows = np.linspace(0, len(values) - 1, min(ROWS, len(values))).astype(int)
    swept = _swept(state.rows(np.tile(rows, len(at))), channel, np.repeat(at, len(rows)))

    def law(e: Effect) -> Array:
        """Return what an effect with these parameters does (k,) at each value of the channel, averaged over rows."""
        return np.asarray(amounts(e, swept)[:, k].reshape(len(at), -1).mean(axis=1))

    y, x = law(effect), effect.vector()
    columns = np.array([k for k, (key, _) in enumerate(fit.parameters) if key == effect.key], dtype=int)
    slopes = np.zeros((len(at), len(columns)))
    for m, i in enumerate(fit.parameters[column][1] for column in columns):
        step = 1e-3 * effect.scale()[i] * (np.arange(len(x)) == i)
        slopes[:, m] = (law(effect.with_vector(x + step)) - y) / step[i]
    covariance = fit.covariance[np.ix_(columns, columns)]
    sigma = np.sqrt(np.maximum(np.einsum("nm,mk,nk->n", slopes, covariance, slopes), 0.0))
    return DrawnCurve(at, y, sigma)


def _swept(state: State, channel: str, values: Array) -> State:
    """Return the n states with one channel set to (n,) values; poses of bodies follow the joints."""
    name, joint = channel[:-1], channel[-1:]
    if name in CHANNEL_FIELDS and joint.isdigit():
        column = np.array(getattr(state, CHANNEL_FIELDS[name]), dtype=float)
        column[:, int(joint) - 1] = values
        state = state.with_(**{CHANNEL_FIELDS[name]: column})
        if name == "q" and state.robot is not None:
            state = state.with_(T_base_body=body_poses(state.robot, column))
        return state
    if channel in ("fx", "fy", "fz"):
        wrench = np.array(state.wrench, dtype=float)
        wrench[:, "xyz".index(joint)] = values
        return state.with_(wrench=wrench)
    if channel in state.channels:
        return state.with_(channels={**state.channels, channel: values})
    return state.with_(**{"payload_mass" if channel == "payload" else channel: values})


def _residual(fit: Fit, k: int) -> Array:
    """Return (n,) how much more coordinate k would move to explain the residual [rad or m]; NaN where nothing shows it.

    l . r / (l^2 + s^2) with the residual r and the coordinate's lever l [m/rad or m/m], damped by s.

    Args:
        k: of `model.derivatives.places`.
    """
    error = fit.observed_error.copy()
    error[list(fit.excluded)] = np.nan
    if fit.observed.name == "joint":
        return error[:, k] if k < BODY else np.full(len(error), np.nan)
    if fit.observed.name != "position":
        return np.full(len(error), np.nan)
    known = np.isfinite(error)
    lever = fit.problem.sensitivity.matrix[:, :3, k] * known
    projected = np.sum(lever * np.nan_to_num(error), axis=1) / (np.sum(lever**2, axis=1) + LEAST_LEVER_M**2)
    return np.where(known.any(axis=1), projected, np.nan)
