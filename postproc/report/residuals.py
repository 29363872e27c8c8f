"""Pictures of what a model leaves unexplained, shared by the pages of compare and diagnose."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from postproc.arrays import Array
from postproc.fit.channels import fit_channels, unit_of
from postproc.fit.errors import distances
from postproc.fit.fitted import Fit
from postproc.identify.compare import WORST
from postproc.identify.trends import DAMPING, Trend, joint_inverse, residual_trends
from postproc.identify.words.sentences import suspect_size
from postproc.patterns.suspects import Suspect
from postproc.report.charts import Bins, scatter
from postproc.report.figures import chosen, enlargement, plane_views, space_view
from postproc.report.page import Section, grid

HOW = (
    "Points: each pose, less the mean. Red: means with their standard errors; rings: the worst poses. "
    "In space the residual is taken along its main direction{direction}; at a joint it is the joint error that would "
    "explain it. "
    "A pattern is physics that the model lacks, a cloud is noise."
)


def workspace_section(fit: Fit, title: str = "Where it is off") -> Section:
    """Residuals in instrument axes, where they were measured."""
    error = fit.position_error
    good = np.flatnonzero(np.isfinite(error).any(axis=1))
    if not len(good):
        return Section(title, "", "No position was measured.")
    # A coordinate that was not measured is where the model says.
    error = np.nan_to_num(error[good])
    position = fit.problem.T_instrument_tcp[good, :3, 3] + error
    times = enlargement(position, error)
    rows = chosen(error)
    label = [
        f"{_pose(fit, int(good[i]))}: {1e3 * np.linalg.norm(error[i]):.3f} mm off "
        f"({', '.join(f'{1e3 * e:+.3f}' for e in error[i])}), at ({', '.join(f'{p:.3f}' for p in position[i])}) m"
        for i in rows
    ]
    note = f"Arrows from the measured position along measured minus predicted, drawn {times:g} times as long."
    if len(rows) < len(good):
        note += f" {len(rows)} of {len(good)} poses are drawn, the worst among them."
    if fit.set_aside:
        aside = ", ".join(
            f"{_pose(fit, i)} {1e3 * np.linalg.norm(fit.problem.error[i, :3]):.2f} mm" for i in fit.set_aside
        )
        note += f" Not drawn, because the fit left them out: {aside}."
    views = plane_views(position[rows], error[rows], times)
    return Section(title, space_view(position[rows], error[rows], times, label) + views, note)


def channel_section(
    fit: Fit,
    noise: float | None,
    title: str = "What it follows",
    first: Iterable[tuple[str, str]] = (),
    most: int | None = None,
) -> Section:
    """The residual against every channel, each where it tells most.

    Args:
        first: (channel, place) that come before the others; most: so many channels.
    """
    best: dict[str, Trend] = {}
    asked = set(first)
    trends = residual_trends(fit)
    for trend in sorted(trends, key=lambda t: (t.channel, t.where) not in asked):
        best.setdefault(trend.channel, trend)
    named = fit_channels(fit)
    size = distances(fit.position_error)
    worst = [int(i) for i in np.argsort(-np.nan_to_num(size, nan=-1.0))[:WORST] if np.isfinite(size[i])]
    # The instrument's noise as it looks at a joint: rms over the poses of each row of J^+.
    at_joint = 1e3 * np.sqrt((joint_inverse(fit) ** 2).sum(axis=2).mean(axis=0))
    charts = []
    for trend in [*best.values()][:most]:
        joint = int(trend.where[-1]) - 1 if trend.where.startswith("joint") else None
        gain = 1e3 if joint is None else at_joint[joint]
        charts.append(_chart(fit, trend, named[trend.channel], worst, None if noise is None else 2 * noise * gain))
    direction = next(
        (f" ({', '.join(f'{round(x, 1) + 0.0:.1f}' for x in t.direction)})" for t in trends if t.where == "space"), ""
    )
    note = HOW.format(direction=direction) + (" The grey band is twice the noise." if noise is not None else "")
    return Section(title, grid(charts, 330), note)


def suspect_chart(fit: Fit, suspect: Suspect, noise: float | None) -> str:
    """The error of the suspect's place over its channel, without the share that the fit has taken on.

    Component plus residual (Larsen and McCleary 1972): c s + J^+ r, with c the size of the pattern s fitted beside all
    parameters, r the residual after it, J the place's column along c, damped as in ``joint_inverse``. Empty for what
    has several sizes, or neither turns nor shifts.
    """
    named, ours = fit_channels(fit), _moves(suspect.where)
    if suspect.channel not in named or suspect.values.ndim > 1 or not ours:
        return ""
    linear, sizes = fit.linear, suspect_size(fit, suspect)
    rest = fit.problem.weights.measured(linear.rest - linear.project(suspect.columns(fit.problem)) @ sizes)
    ways = sizes[: suspect.place.shape[2]]
    along = ways / np.linalg.norm(ways) if len(ways) > 1 else np.ones(1)
    lever = (suspect.place[:, :3] @ along) * np.isfinite(fit.problem.error[:, :3])
    square = (lever**2).sum(axis=1)
    taken = (lever * np.nan_to_num(rest[:, :3])).sum(axis=1) / (square + DAMPING**2)
    shown = (ways @ along) * suspect.values + taken
    direction = f", along ({', '.join(f'{x:z.1f}' for x in along)})" if len(along) > 1 else ""
    unit, factor = unit_of(suspect.channel)
    return scatter(
        named[suspect.channel] * factor,
        1e3 * shown,
        f"{suspect.channel} [{unit}]" if unit else suspect.channel,
        f"{ours} at {suspect.where}{direction}",
        band=None if noise is None else 2e3 * noise * float(np.sqrt((square / (square + DAMPING**2) ** 2).mean())),
        title=f"{suspect.where}: {suspect.pattern}",
        size=(560, 260),
    )


def _moves(where: str) -> str:
    """In what a place is off: turns or shifts; empty for one that does both, or is neither."""
    kind, _, how = where.partition(", ")
    kind = kind.rstrip(" 123456")
    if kind in ("joint", "base", "body", "tool", "instrument") and how in ("", "turned", "shifted"):
        return "mm" if how == "shifted" or (kind in ("tool", "instrument") and not how) else "mrad"
    return ""


def _chart(fit: Fit, trend: Trend, values: Array, worst: list[int], band: float | None) -> str:
    unit, factor = unit_of(trend.channel)
    if trend.where == "space":
        ours, place = "mm", "in space"
    else:
        ours, place = "mrad", f"at {trend.where}"
    rows = zip(trend.centre * factor, trend.mean, trend.spread, strict=True)
    text = [f"{trend.channel} {x:.4g} {unit}: mean {m:+.4f} +- {e:.4f} {ours}" for x, m, e in rows]
    marks = [
        (i, f"{_pose(fit, i)}: {trend.values[i]:+.4f} {ours} at {trend.channel} {values[i] * factor:.4g} {unit}")
        for i in worst
    ]
    return scatter(
        values * factor,
        trend.values,
        f"{trend.channel} [{unit}]" if unit else trend.channel,
        f"{ours} {place}",
        band=band,
        title=f"{trend.channel}: {100 * trend.share:.0f} % of the error {place}",
        bins=Bins(trend.centre * factor, trend.mean, trend.spread, text),
        marks=marks,
    )


def _pose(fit: Fit, i: int) -> str:
    return f"{fit.data.pose_id[i]} ({fit.data.name(i)})"
