"""The residual of a model against its channels: small charts of what stands out, the others folded."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from types import MappingProxyType

import numpy as np

from postproc.channels.units import unit_of
from postproc.estimation.fitted import Fit
from postproc.grouping import grouped
from postproc.identification.compare import LEAST_LEVER_M, Trend, joint_inverse, residual_trends, worst_rows
from postproc.identification.diagnosis import suspect_size
from postproc.identification.screen.suspects import Suspect
from postproc.measure.errors import distances
from postproc.report.blocks import Chart, Section
from postproc.report.drawing.charts import Bins, Range, scatter, spread

HOW = (
    "Points: each pose, less the mean. Red: means with their standard errors; rings: the worst poses. "
    "In space the residual is taken along its main direction; at a joint it is the joint error that would explain it. "
    "The grey band is twice the noise: a pattern beyond it is physics that the model lacks."
)
STANDS_OUT = 0.03  # share of the residual's variance from which on a channel stands out
SEVERAL = 6  # channels that are drawn where many stand out


def standing_out(fit: Fit) -> dict[tuple[str, str], Range]:
    """Return up to six channels that explain at least 3 % of a fit's residual, and the ranges of y of their charts.

    By name and place (joint, or space) where each explains most, so that other fits can be drawn on the same axes.
    """
    trends = [t for t in _best(residual_trends(fit)) if t.share >= STANDS_OUT][:SEVERAL]
    known = [(t, t.values[np.isfinite(t.values)]) for t in trends]
    return {(t.channel, t.where): spread(np.append(y, 0.0)) for t, y in known}


def charts_of(fit: Fit, ranges: Mapping[tuple[str, str], Range]) -> list[str]:
    """Return the charts of some channels for a fit, on given axes.

    Args:
        ranges: as `standing_out` of a fit of the same rows returns them.
    """
    trends = {(t.channel, t.where): t for t in residual_trends(fit)}
    return _charts(fit, [trends[place] for place in ranges if place in trends], ranges)


def channel_sections(
    fit: Fit, title: str, first: Iterable[tuple[str, str]] = (), folded: bool = False
) -> list[Section]:
    """Return two sections of charts of the residual: channels that explain at least 3 %, and the rest, folded.

    Each channel is drawn at the place where it explains most.

    Args:
        title: of the first section. first: (channel, place) that are in it in any case, before the others.
        folded: the first section stays empty, all channels are in the folded one.
    """
    chosen = set(first)

    @cache
    def charts() -> tuple[list[str], list[str]]:
        """Return the charts of the first section and of the second."""
        trends = _best(sorted(residual_trends(fit), key=lambda t: (t.channel, t.where) not in chosen))
        out = [t for t in trends if t.share >= STANDS_OUT or (t.channel, t.where) in chosen]
        quiet = [t for t in trends if t not in out]
        shown, hidden = ([], trends) if folded else (out, quiet)
        drawn = _charts(fit, [*shown, *hidden])
        return drawn[: len(shown)], drawn[len(shown) :]

    others = title if folded else f"{title}: the channels of which none stands out"
    return [
        Section(title, [Chart(lambda: charts()[0], 320)], HOW),
        Section(others, [Chart(lambda: charts()[1], 320)], HOW, folded=True),
    ]


def suspect_chart(fit: Fit, suspect: Suspect, noise: float | None) -> str:
    """Return a chart of the error at a pattern's place over its channel, with the share that parameters absorbed.

    Component plus residual (Larsen and McCleary 1972): c s + J^+ r, with c the size of the pattern s fitted beside all
    parameters, r the residual after it, J the place's column along c, damped as in ``joint_inverse``. Empty for a
    pattern of several sizes, or a place that neither turns nor shifts.

    Args:
        suspect: the pattern. noise: standard deviation per axis [m], [rad], or None.
    """
    named, ours = fit.problem.channels, _unit_at(suspect.where)
    if suspect.channel not in named or suspect.values.ndim > 1 or not ours:
        return ""
    linear, sizes = fit.linear, suspect_size(fit, suspect)
    residual = fit.problem.weights.measured(
        linear.projected_residual - linear.project(suspect.columns(fit.problem)) @ sizes
    )
    ways = sizes[: suspect.place.shape[2]]
    along = ways / np.linalg.norm(ways) if len(ways) > 1 else np.ones(1)
    lever = (suspect.place[:, :3] @ along) * np.isfinite(fit.problem.error[:, :3])
    square = (lever**2).sum(axis=1)
    taken = (lever * np.nan_to_num(residual[:, :3])).sum(axis=1) / (square + LEAST_LEVER_M**2)
    shown = (ways @ along) * suspect.values + taken
    direction = f", along ({', '.join(f'{x:z.1f}' for x in along)})" if len(along) > 1 else ""
    unit, factor = unit_of(suspect.channel)
    quiet = None
    if noise is not None:
        quiet = 2e3 * noise * float(np.sqrt((square / (square + LEAST_LEVER_M**2) ** 2).mean()))
    return scatter(
        named[suspect.channel] * factor,
        1e3 * shown,
        f"{suspect.channel} [{unit}]" if unit else suspect.channel,
        f"{ours} at {suspect.where}{direction}",
        noise=quiet,
        title=f"{suspect.where}: {suspect.pattern}",
    )


def pose_name(fit: Fit, i: int) -> str:
    """Return the name of pose ``i`` in the table, with its row."""
    return f"{fit.data.pose_id[i]} ({fit.data.name(i)})"


def _best(trends: Iterable[Trend]) -> list[Trend]:
    """Return the first trend of every channel.

    Args:
        trends: the one that is wanted first; of the others the strongest first.
    """
    return [group[0] for group in grouped((trend.channel, trend) for trend in trends).values()]


def _unit_at(where: str) -> str:
    """Return the unit, ``mrad`` or ``mm``, in which a place turns or shifts; empty if it does both or neither.

    Args:
        where: such as ``joint 2`` or ``tool, turned``.
    """
    kind, _, how = where.partition(", ")
    kind = kind.rstrip(" 123456")
    if kind in ("joint", "base", "body", "tool", "instrument") and how in ("", "turned", "shifted"):
        return "mm" if how == "shifted" or (kind in ("tool", "instrument") and not how) else "mrad"
    return ""


def _charts(
    fit: Fit, trends: Iterable[Trend], ranges: Mapping[tuple[str, str], Range] = MappingProxyType({})
) -> list[str]:
    """Return SVG charts of the residual over channels, at the trends' places, with means and the worst poses ringed.

    Args:
        ranges: of the y axis by channel and place; an axis without one fits the points.
    """
    named, noise, joint = fit.problem.channels, fit.parts.level, fit.observed.name == "joint"
    # From noise of position to noise of a joint [mrad per m]: rms over the poses of each row of J^+.
    at_joint = 1e3 * np.sqrt((joint_inverse(fit) ** 2).sum(axis=2).mean(axis=0))
    worst = worst_rows(distances(fit.position_error))
    charts = []
    for trend in trends:
        channel, (unit, factor) = trend.channel, unit_of(trend.channel)
        values, centre = named[channel] * factor, trend.centre * factor
        gain, unit_y, place = 1e3, "mm", "in space"
        if trend.where != "space":
            unit_y, place = "mrad", f"at {trend.where}"
            gain = 1e3 if joint else at_joint[int(trend.where[-1]) - 1]
        rows = zip(centre, trend.mean, trend.spread, strict=True)
        text = [f"{channel} {x:.4g} {unit}: mean {m:+.4f} +- {e:.4f} {unit_y}" for x, m, e in rows]
        chart = scatter(
            values,
            trend.values,
            f"{channel} [{unit}]" if unit else channel,
            f"{unit_y} {place}",
            noise=None if noise is None else 2 * noise * gain,
            title=f"{channel}: {100 * trend.share:.0f} % of the variance {place}",
            bins=Bins(centre, trend.mean, trend.spread, text),
            marks=[
                (i, f"{pose_name(fit, i)}: {trend.values[i]:+.4f} {unit_y} at {channel} {values[i]:.4g} {unit}")
                for i in worst
            ],
            across=ranges.get((channel, trend.where)),
        )
        charts.append(chart)
    return charts
