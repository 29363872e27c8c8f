"""Where a model fails on measurements: figures, worst poses, the residual against every channel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.identify.channels import channels, unit_of
from postproc.identify.fit import evaluate
from postproc.identify.fitted import Fit, rms
from postproc.measure.measurements import Measurements
from postproc.measure.repeat import Iso9283, Noise, estimate_noise, iso9283
from postproc.model.arm import Model

WORST = 10
FEWEST, MOST, IN_EACH = 12, 48, 30
"""Bins of a channel, and the rows wanted in each: long records show finer patterns."""


@dataclass(frozen=True)
class Trend:
    """The residual against one channel.

    Args:
        channel: name; where: ``space`` or ``joint 2``; share: of the residual's variance that the binned means explain,
            less what as many bins would explain of noise.
        values: (n,) the residual less its mean, mm along ``direction`` or mrad at the joint, NaN where not measured.
        direction: (3,) unit vector in instrument axes, (1,) at a joint.
        centre, mean, spread: per bin: channel, mean of the values, its standard error.
    """

    channel: str
    where: str
    share: float
    values: Array
    direction: Array
    centre: Array
    mean: Array
    spread: Array

    def as_json(self) -> dict[str, Any]:
        """An entry of ``channels``, in the units that people read."""
        unit, factor = unit_of(self.channel)
        return {
            "channel": self.channel,
            "where": self.where,
            "share": round(self.share, 4),
            "centre_unit": unit,
            "unit": "mm" if self.where == "space" else "mrad",
            "centre": [factor * float(x) for x in self.centre],
            "mean": [float(x) for x in self.mean],
            "standard_error": [float(x) for x in self.spread],
        }


@dataclass(frozen=True)
class Comparison:
    """How far measured and predicted poses are apart.

    Args:
        fit: the model beside the data (nothing fitted). error: (n, 3) measured minus predicted [m], instrument axes.
        joint_error: (n, 6) the smallest joint errors that would explain it [rad].
        bound: held-out rms per axis that a free function of the channels reaches on this residual [m].
    """

    fit: Fit
    error: Array
    joint_error: Array
    noise: Noise
    iso: Iso9283
    trends: tuple[Trend, ...]
    bound: float

    @property
    def length(self) -> Array:
        """(n,) distance between measured and predicted position [m]."""
        return np.asarray(np.linalg.norm(self.error, axis=1))

    def as_json(self) -> dict[str, Any]:
        """``postproc/compare/1``."""
        data, length = self.fit.data, self.length * 1e3
        good = np.isfinite(length)
        worst = [int(i) for i in np.argsort(-np.nan_to_num(length, nan=-1.0))[:WORST] if good[i]]
        p50, p95, p99 = np.percentile(length[good], [50, 95, 99]) if good.any() else (0.0, 0.0, 0.0)
        floor = None if self.noise.position is None else round(1e3 * self.noise.position, 6)
        rotation = self.fit.problem.error[:, 3:6] if data.rotation is not None else None
        return {
            "schema": "postproc/compare/1",
            "rows": len(data),
            "rms_mm": round(1e3 * rms(self.error), 6),
            "rms_3d_mm": round(float(np.sqrt(np.mean(length[good] ** 2))), 6) if good.any() else 0.0,
            "mean_mm": round(float(np.mean(length[good])), 6) if good.any() else 0.0,
            "maximum_mm": round(float(np.max(length[good])), 6) if good.any() else 0.0,
            "percentiles_mm": {"50": round(float(p50), 6), "95": round(float(p95), 6), "99": round(float(p99), 6)},
            "per_axis_mm": {
                axis: {
                    "rms": round(1e3 * rms(self.error[:, i]), 6),
                    "mean": round(1e3 * float(np.nanmean(self.error[:, i])), 6),
                }
                for i, axis in enumerate("xyz")
            },
            "rotation_rms_mrad": None if rotation is None else round(1e3 * rms(rotation), 6),
            "iso9283": {
                "accuracy_mean_mm": round(self.iso.accuracy_mean, 6),
                "accuracy_max_mm": round(self.iso.accuracy_max, 6),
                "repeatability_median_mm": self.iso.repeatability_median,
                "repeatability_max_mm": self.iso.repeatability_max,
                "repeated_poses": self.iso.poses,
            },
            "noise_mm": floor,
            "floor_mm": floor,
            "bound_mm": round(1e3 * self.bound, 6),
            "worst": [
                {"row": data.row[i], "pose_id": data.pose_id[i], "error_mm": round(float(length[i]), 6)} for i in worst
            ],
            "channels": [t.as_json() for t in self.trends],
            "diagnostics": [d.as_json() for d in data.diagnostics],
        }

    def text(self) -> str:
        """The figures in a sentence, then tables."""
        j = self.as_json()
        noise = (
            "the noise is not known"
            if j["noise_mm"] is None
            else f"the instrument's noise is {j['noise_mm']:.3f} mm per axis"
        )
        lines = [
            f"The arm is {j['mean_mm']:.3f} mm from where the model says, {j['maximum_mm']:.3f} mm at worst "
            f"(rms {j['rms_mm']:.3f} mm per axis); {noise}.",
            _without_physics(j["rms_mm"], j["bound_mm"], j["noise_mm"]),
            "",
            "axis   rms mm   mean mm",
            *(f"  {a}   {v['rms']:7.3f}  {v['mean']:8.3f}" for a, v in j["per_axis_mm"].items()),
            "",
            "worst poses: "
            + ", ".join(f"{w['pose_id']} (row {w['row']}) {w['error_mm']:.3f} mm" for w in j["worst"][:5]),
        ]
        repeat = j["iso9283"]["repeatability_median_mm"]
        if repeat is not None:
            lines.append(f"ISO 9283: accuracy {j['iso9283']['accuracy_mean_mm']:.3f} mm, repeatability {repeat:.3f} mm")
        lines += ["", "the residual follows (share of its variance above chance):"]
        lines += [f"  {t.channel:12s} {t.where:8s} {100 * t.share:5.1f} %" for t in self.trends[:8]]
        return "\n".join(lines)


def _without_physics(rms_mm: float, bound_mm: float, noise_mm: float | None) -> str:
    if noise_mm is not None and rms_mm < 1.2 * noise_mm:
        return "What is left is of the size of the noise."
    if bound_mm > 0.9 * rms_mm:
        return (
            "No free function of the channels does much better; `postproc diagnose` also looks for steps, waves and "
            "lost motion."
        )
    return (
        f"A free function of the channels, without physics, brings it to {bound_mm:.3f} mm per axis on rows that "
        "it has not seen."
    )


def compare(model: Model, data: Measurements, *, noise: float | None = None) -> Comparison:
    """Compare a model, as it is, with measurements.

    Where the model has no instrument frame, or no tool, of its own, the ones that bring the points nearest are used,
    so that the figures speak of the arm.
    """
    fit = evaluate(model, data, noise=noise)
    figures = estimate_noise(fit.data, noise)
    error = fit.problem.error[:, :3]
    joint = joint_errors(fit)
    return Comparison(
        fit, error, joint, figures, iso9283(error, fit.data.repeats), residual_trends(fit), fit.leftover.held_out
    )


def fit_channels(fit: Fit) -> dict[str, Array]:
    """Every channel (n,) of the data beside a fit."""
    return channels(fit.problem.sensitivity.state, fit.problem.rest.T_base_tcp[:, :3, 3])


def joint_errors(fit: Fit) -> Array:
    """(n, 6) joint errors of least square sum that would move the TCP by the position error, dq = J^+ e [rad]."""
    e = np.nan_to_num(fit.problem.error[:, :3])
    return np.asarray((joint_inverse(fit) @ e[:, :, None])[:, :, 0])


def joint_inverse(fit: Fit) -> Array:
    """(n, 6, 3) J^+ = J^T (J J^T + s^2)^-1 [rad/m], damped with s = 0.05 m.

    Near singular directions no joint is blamed for what it could hardly cause.
    """
    J = fit.problem.sensitivity.matrix[:, :3, :6]
    square = J @ np.swapaxes(J, 1, 2) + 0.05**2 * np.eye(3)
    return np.asarray(np.swapaxes(np.linalg.solve(square, J), 1, 2))


def residual_trends(fit: Fit) -> tuple[Trend, ...]:
    """The residual of a fit against every channel, in space and at the channel's joint, the most telling first."""
    error, joint, named = fit.problem.error[:, :3], joint_errors(fit), fit_channels(fit)
    good = np.asarray(np.isfinite(error).all(axis=1))
    if good.sum() < 3 * FEWEST:
        return ()
    found: list[Trend] = []
    for name, values in named.items():
        member, centre = _bins(values[good])
        found.append(_trend(name, "space", error * 1e3, good, member, centre))
        if name[:-1] in ("q", "v", "dir", "load", "a") and name[-1] in "123456":
            j = int(name[-1]) - 1
            found.append(_trend(name, f"joint {j + 1}", joint[:, j : j + 1] * 1e3, good, member, centre))
    return tuple(sorted(found, key=lambda t: -t.share))


def _bins(values: Array) -> tuple[NDArray[np.int_], Array]:
    distinct = np.unique(values)
    count = int(np.clip(len(values) // IN_EACH, FEWEST, MOST))
    if len(distinct) <= count:
        member = np.searchsorted(distinct, values)
        return member, distinct
    edges = np.quantile(values, np.linspace(0, 1, count + 1)[1:-1])
    member = np.searchsorted(edges, values)
    centre = np.array([np.median(values[member == k]) if (member == k).any() else np.nan for k in range(count)])
    return member, centre


def _trend(
    name: str, where: str, rows: Array, good: NDArray[np.bool_], member: NDArray[np.int_], centre: Array
) -> Trend:
    values = rows[good] - rows[good].mean(axis=0)
    direction = np.linalg.svd(values, full_matrices=False)[2][0]
    direction = direction * np.sign(direction[np.argmax(np.abs(direction))])
    main = values @ direction
    bins = [k for k in range(len(centre)) if (member == k).sum() > 0]
    means = np.array([values[member == k].mean(axis=0) for k in bins])
    count = np.array([(member == k).sum() for k in bins])
    total = float(np.sum(values**2))
    between = float(np.sum(count[:, None] * means**2))
    share = between / total if total > 0 else 0.0
    chance = (len(bins) - 1) / max(1, len(values) - 1)
    share = max(0.0, (share - chance) / (1 - chance)) if chance < 1 else 0.0
    spread = np.array([main[member == k].std() / np.sqrt(max(1, (member == k).sum())) for k in bins])
    mean = np.array([main[member == k].mean() for k in bins])
    every = np.full(len(rows), np.nan)
    every[good] = main
    return Trend(name, where, share, every, direction, centre[bins], mean, spread)
