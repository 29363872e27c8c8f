"""Where a model fails on measurements: figures, worst poses, the residual against every channel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic
from postproc.fit.fitted import Fit, distances, rms
from postproc.fit.least_squares import evaluate
from postproc.fit.record import mm
from postproc.fit.report import set_aside_lines
from postproc.identify.trends import Trend, residual_trends
from postproc.measure.iso9283 import Iso9283, iso9283
from postproc.measure.measurements import Measurements
from postproc.measure.repeat import Noise, estimate_noise
from postproc.model.arm import Model

WORST = 10


@dataclass(frozen=True)
class Comparison:
    """How far measured and predicted poses are apart.

    Args:
        fit: the model beside the data (nothing fitted).
        error: (n, 3) measured minus predicted [m], instrument axes; NaN in rows that stand out by themselves.
        bound: held-out rms per axis that a free function of the channels reaches on this residual [m].
        before: (6,) the model's own instrument frame, None where it has none.
    """

    fit: Fit
    error: Array
    noise: Noise
    iso: Iso9283
    trends: tuple[Trend, ...]
    bound: float
    before: Array | None = None

    def as_json(self) -> dict[str, Any]:
        """``postproc/compare/1``."""
        data, length = self.fit.data, distances(self.error) * 1e3
        good = np.isfinite(length)
        far = distances(self.fit.problem.error[:, :3]) * 1e3
        worst = [int(i) for i in np.argsort(-np.nan_to_num(far, nan=-1.0))[:WORST] if np.isfinite(far[i])]
        p50, p95, p99 = np.percentile(length[good], [50, 95, 99]) if good.any() else (0.0, 0.0, 0.0)
        floor = None if self.noise.position is None else mm(self.noise.position)
        kept = np.isin(np.arange(len(data)), self.fit.set_aside, invert=True)
        rotation = self.fit.problem.error[kept, 3:6] if data.rotation is not None else None
        return {
            "schema": "postproc/compare/1",
            "rows": len(data),
            "set_aside_rows": [data.row[i] for i in self.fit.set_aside],
            "rms_mm": mm(rms(self.error)),
            "rms_3d_mm": round(float(np.sqrt(np.mean(length[good] ** 2))), 6) if good.any() else 0.0,
            "mean_mm": round(float(np.mean(length[good])), 6) if good.any() else 0.0,
            "maximum_mm": round(float(np.max(length[good])), 6) if good.any() else 0.0,
            "percentiles_mm": {"50": round(float(p50), 6), "95": round(float(p95), 6), "99": round(float(p99), 6)},
            "per_axis_mm": {
                axis: {
                    "rms": mm(rms(self.error[:, i])),
                    "mean": mm(float(np.nanmean(self.error[:, i]))),
                }
                for i, axis in enumerate("xyz")
                if np.isfinite(self.error[:, i]).any()
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
            "bound_mm": mm(self.bound),
            "worst": [
                {
                    **({"file": data.sources[data.file[i]].path} if data.file else {}),
                    "row": data.row[i],
                    "pose_id": data.pose_id[i],
                    "error_mm": round(float(far[i]), 6),
                }
                for i in worst
            ],
            "channels": [t.as_json() for t in self.trends],
            "diagnostics": [d.as_json() for d in (*data.diagnostics, *self.moved)],
        }

    @property
    def moved(self) -> list[Diagnostic]:
        """DAT031 where the instrument stood elsewhere than for the model: the figures are those from there."""
        if self.before is None or not self.fit.free["instrument_frame"].any():
            return []
        now = self.fit.model.effect("instrument_frame")
        assert now is not None
        far = 1e3 * float(np.linalg.norm((now.vector() - self.before)[:3]))
        message = f"the instrument stood {far:.1f} mm from where the model has it, or turned: these points place it"
        help_ = "nothing, if it was set up anew; else look for what moved"
        return [Diagnostic("DAT031", "info", message, self.fit.data.source, help=help_)]

    def text(self) -> str:
        """The figures in a sentence, then tables."""
        j = self.as_json()
        noise = (
            "the noise is not known"
            if j["noise_mm"] is None
            else f"the instrument's noise is {j['noise_mm']:.3f} mm per axis"
        )
        axes = "" if len(j["per_axis_mm"]) in (0, 3) else f" along {' and '.join(j['per_axis_mm'])}"
        lines = [
            f"The arm is {j['mean_mm']:.3f} mm from where the model says{axes}, {j['maximum_mm']:.3f} mm at worst "
            f"(rms {j['rms_mm']:.3f} mm per axis){_without(j['set_aside_rows'])}; {noise}.",
            _without_physics(j["rms_mm"], j["bound_mm"], j["noise_mm"]),
            *set_aside_lines(self.fit),
            "",
            "axis   rms mm   mean mm",
            *(f"  {a}   {v['rms']:7.3f}  {v['mean']:z8.3f}" for a, v in j["per_axis_mm"].items()),
            "",
            "worst poses: " + ", ".join(f"{w['pose_id']} ({_row(w)}) {w['error_mm']:.3f} mm" for w in j["worst"][:5]),
        ]
        repeat = j["iso9283"]["repeatability_median_mm"]
        if repeat is not None:
            lines.append(f"ISO 9283: accuracy {j['iso9283']['accuracy_mean_mm']:.3f} mm, repeatability {repeat:.3f} mm")
        if self.trends:
            lines += ["", "the residual follows (share of its variance above chance):"]
        lines += [f"  {t.channel:12s} {t.where:8s} {100 * t.share:5.1f} %" for t in self.trends[:8]]
        return "\n".join(lines)


def _without(rows: list[int]) -> str:
    """Rows that the first sentence does not count: whoever counts them finds another figure."""
    if not rows:
        return ""
    return f", without {'a row that lies' if len(rows) == 1 else f'{len(rows)} rows that lie'} far from everything else"


def _row(worst: dict[str, Any]) -> str:
    return f"row {worst['row']} of {worst['file']}" if "file" in worst else f"row {worst['row']}"


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
    so that the figures speak of the arm. So is the place of an instrument that was set up elsewhere.
    """
    frame = model.effect("instrument_frame")
    fit = evaluate(model, data, noise=noise)
    figures = estimate_noise(fit.data, noise)
    error = fit.position_error
    iso = iso9283(error[:, np.isfinite(error).any(axis=0)], fit.data.repeats)
    return Comparison(
        fit, error, figures, iso, residual_trends(fit), fit.leftover.held_out, None if frame is None else frame.vector()
    )
