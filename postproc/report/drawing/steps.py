"""The steps of a model from the base to the last effect: residuals, charts and sample targets at each of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from postproc.arrays import Array
from postproc.compensation.correction.inverse import command
from postproc.effects.asking import displacement_of, load_of
from postproc.estimation.fitted import Fit
from postproc.measure.errors import distances
from postproc.model.arm import Model
from postproc.report.blocks import Values
from postproc.report.drawing.charts import shares
from postproc.report.drawing.columns import chain_of, exact, packed
from postproc.report.drawing.laws import law_charts, laws_of
from postproc.report.drawing.residuals import charts_of, pose_name, standing_out
from postproc.robot.kinematics import forward
from postproc.robot.pose import displace

MOST_POSES_DRAWN = 3000  # poses that are drawn
MOST_TARGETS_DRAWN = 6  # of the sample program


@dataclass(frozen=True, slots=True)
class Rung:
    """One step of a growing model: a name, its fit to the measurements, and its error on held-out rows [m], [rad].

    Args:
        held_out: whether the fit itself can tell how far rows are off that it has not seen.
    """

    name: str
    fit: Fit
    error: float
    held_out: bool = True


def steps_data(rungs: Sequence[Rung], keys: Iterable[str], floor: float | None) -> Values:
    """Return what the page draws of every step, at rows that are the same in all of them.

    Args:
        rungs: the steps, the last model last. keys: of effects whose curves are drawn. floor: the noise [mm], [mrad].
    """
    last, keys = rungs[-1].fit, list(keys)
    rows, ranges = _chosen(last), standing_out(rungs[0].fit)
    q, joint = last.data.state.q[rows], last.observed.name == "joint"
    steps = [
        {
            "name": rung.name,
            "error": 1e3 * rung.error,
            "away": None if joint else packed(1e3 * _in_base(rung.fit, rows)[0]),
            "charts": charts_of(rung.fit, ranges),
            "laws": law_charts(laws_of(rung.fit, keys)),
            "forces": _forces(rung.fit, keys, rows),
            "program": _sample_program(rung.fit.model, last, rows),
            "distances": distance_chart(rungs, [k], floor),
        }
        for k, rung in enumerate(rungs)
    ]
    return {
        "unit": last.observed.unit,
        "floor": floor,
        "row": [last.data.row[i] for i in rows.tolist()],
        "label": [pose_name(last, i) for i in rows.tolist()],
        "p": exact(_in_base(last, rows)[1]),
        "q": packed(q),
        "arm": chain_of(last.model.robot, last.model.T_flange_tcp[None]),
        "distances": distance_chart(rungs, [0, len(rungs) - 1], floor) if len(rungs) > 1 else "",
        "drawn": len(rows),
        "of": len(last.data),
        "steps": steps,
    }


def _forces(fit: Fit, keys: Sequence[str], rows: Array) -> list[Values]:
    """Return the forces of some effects on bodies, each with body and encoded wrench (k, 6) about the base origin.

    Args:
        keys: of the effects. rows: (k,) indices of the poses that are drawn.
    """
    state = fit.problem.sensitivity.state.rows(rows)
    effects = [e for key in keys if (e := fit.model.effect(key)) is not None and not e.missing(state)]
    every = [
        (e.key, body, np.broadcast_to(wrench, (len(state), 6)))
        for e in effects
        for body, wrench in load_of(e, state).body.items()
    ]
    return [{"name": key, "body": body, "wrench": packed(wrench)} for key, body, wrench in every if wrench.any()]


def distance_chart(rungs: Sequence[Rung], of: Sequence[int], noise: float | None) -> str:
    """Return a chart of the share of poses within each distance at some steps, and what the noise alone would give.

    Held-out rows count, where a step can tell of them; of one step alone also the rows of its fit.

    Args:
        rungs: all steps, by whose distances the axis goes. of: numbers of the steps that are drawn.
        noise: standard deviation per axis [mm], [mrad], or None.
    """
    unit = rungs[0].fit.observed.unit
    every = [_distances(rung) for rung in rungs]
    most = max((float(np.nanpercentile(x, 99.5)) for x in every if np.isfinite(x).any()), default=0.0)
    curves: dict[str, tuple[str, Array]] = {}
    if len(of) == 1 and rungs[of[0]].held_out:
        curves["in the fit"] = ("fit", 1e3 * distances(_counted(rungs[of[0]].fit)))
    for k in of:
        label = (
            "held out"
            if len(of) == 1 and rungs[k].held_out
            else "poses"
            if len(of) == 1
            else "found"
            if k
            else "as it came"
        )
        curves[label] = ("found-line" if k else "came-line", every[k])
    if noise is not None:
        axes = max(int(np.isfinite(_counted(rungs[0].fit)).any(axis=0).sum()), 1)
        curves["noise alone"] = ("quiet", noise * np.sqrt(stats.chi2.ppf((np.arange(400) + 0.5) / 400, axes)))
    return shares(curves, unit, "How many poses are how near", most or None)


def _counted(fit: Fit) -> Array:
    """Return the errors (n, k) [m], [rad] of a fit, NaN in rows that it left out."""
    error = fit.observed_error.copy()
    error[list(fit.excluded)] = np.nan
    return error


def _distances(rung: Rung) -> Array:
    """Return (n,) distances [mm], [mrad] of the poses at a step, held out where the step can tell."""
    return 1e3 * distances(rung.fit.held_out_error if rung.held_out else _counted(rung.fit))


def _chosen(fit: Fit) -> Array:
    """Return the indices (k,) of rows that are drawn: at most about 3000 evenly, and the 20 worst."""
    n = len(fit.data)
    every = np.arange(0, n, -(-n // MOST_POSES_DRAWN) or 1)
    worst = np.argsort(-np.nan_to_num(distances(fit.observed_error)))[:20]
    return np.union1d(every, worst)


def _in_base(fit: Fit, rows: Array) -> tuple[Array, Array]:
    """Return measured minus predicted position (k, 3) [m] and the predicted TCP (k, 3) [m], both in base axes.

    Args:
        rows: (k,) indices of the measurements.
    """
    error = np.nan_to_num(fit.position_error[rows])
    equilibrium = fit.problem.equilibrium
    error = np.einsum("nji,nj->ni", equilibrium.R_instrument_base[rows], error)
    return error, equilibrium.T_base_tcp[rows, :3, 3]


def _sample_program(model: Model, fit: Fit, rows: Array) -> list[Values]:
    """Return up to six measured poses, chosen evenly from some rows, as targets before and after correction.

    Args:
        model: by which they are corrected. fit: whose data and equilibrium give the poses.
        rows: (r,) indices of the rows to choose from.

    Returns:
        One entry a pose: its ``name``, and the positions ``programmed`` and ``written`` [mm] of the TCP.
    """
    index = rows[np.linspace(0, len(rows) - 1, min(MOST_TARGETS_DRAWN, len(rows))).astype(int)]
    state = fit.problem.equilibrium.state.rows(index)
    if not fit.data.tool_known:
        # Nobody said which tool it was: what was fitted is the tool, and no error of it.
        frames = [displacement_of(e, state).tool for e in model.effects if e.is_frame]
        tool = sum((np.broadcast_to(xi, (len(index), 6)) for xi in frames if xi is not None), np.zeros((len(index), 6)))
        state = state.with_(T_flange_tcp=state.T_flange_tcp @ displace(tool))
        model = model.with_effects(*(e for e in model.effects if not e.is_frame))
    wanted = forward(model.robot, state.q) @ state.T_flange_tcp
    written = command(model, state, wanted).T_base_tcp
    return [
        {"name": fit.data.pose_id[i], "programmed": (1e3 * a).round(3).tolist(), "written": (1e3 * b).round(3).tolist()}
        for i, a, b in zip(index.tolist(), wanted[:, :3, 3], written[:, :3, 3], strict=True)
    ]
