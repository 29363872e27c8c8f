"""Where a model fails on measurements: figures, worst poses, the residual against every channel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.effects.roles import Role
from postproc.estimation.errors import distances, mm, rms
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import evaluate, fit_model
from postproc.estimation.words.findings import some_of_many
from postproc.estimation.words.record import noise_json
from postproc.estimation.words.text import set_aside_lines
from postproc.identification.trends import Trend, residual_trends
from postproc.measure.iso9283 import Iso9283, iso9283
from postproc.measure.measurements import Measurements
from postproc.measure.observations import Observation
from postproc.model.arm import Model

WORST = 10


@dataclass(frozen=True)
class Comparison:
    """How far measured and predicted poses are apart.

    Args:
        fit: the model beside the data (nothing fitted).
        error: (n, k) measured minus predicted of what was observed [m], instrument axes, [rad] of angles; NaN in rows
            that stand out by themselves.
        bound: held-out rms that any smooth function of the channels reaches, everything fitted again [m], [rad].
        before: (6,) the model's own instrument frame, None where it has none.
    """

    fit: Fit
    error: Array
    iso: Iso9283
    trends: tuple[Trend, ...]
    bound: float
    before: Array | None = None

    def as_json(self) -> dict[str, Any]:
        """``postproc/compare/1``; keys of figures end in the unit of what was observed."""
        data, kind, length = self.fit.data, self.fit.observed, self.sizes * 1e3
        key, good = kind.key, np.isfinite(length)
        far = sizes(self.fit.observed_error, kind) * 1e3
        worst = [int(i) for i in np.argsort(-np.nan_to_num(far, nan=-1.0))[:WORST] if np.isfinite(far[i])]
        p50, p95, p99 = np.percentile(length[good], [50, 95, 99]) if good.any() else (0.0, 0.0, 0.0)
        kept = np.isin(np.arange(len(data)), self.fit.set_aside, invert=True)
        rotation = self.fit.problem.error[kept, 3:6] if data.rotation is not None else None
        space = kind.name == "position"
        return {
            "schema": "postproc/compare/1",
            "observed": kind.name,
            "rows": len(data),
            "set_aside_rows": [row for _, row in self.fit.left_out],
            key("rms"): mm(rms(self.error)),
            **(
                {"rms_3d_mm": round(float(np.sqrt(np.mean(length[good] ** 2))), 6) if good.any() else 0.0}
                if space
                else {}
            ),
            key("mean"): round(float(np.mean(length[good])), 6) if good.any() else 0.0,
            key("maximum"): round(float(np.max(length[good])), 6) if good.any() else 0.0,
            key("percentiles"): {"50": round(float(p50), 6), "95": round(float(p95), 6), "99": round(float(p99), 6)},
            key(f"per_{kind.each}"): self._each(),
            **({"rotation_rms_mrad": None if rotation is None else round(1e3 * rms(rotation), 6)} if space else {}),
            **({"iso9283": _iso_json(self.iso)} if space else {}),
            **noise_json(self.fit),
            key("floor"): None if self.fit.parts.level is None else mm(self.fit.parts.level),
            key("bound"): mm(self.bound),
            "worst": [
                {
                    **({"file": data.sources[data.file[i]].path} if data.file else {}),
                    "row": data.row[i],
                    "pose_id": data.pose_id[i],
                    key("error"): round(float(far[i]), 6),
                }
                for i in worst
            ],
            "channels": [t.as_json() for t in self.trends],
            "diagnostics": [d.as_json() for d in (*data.diagnostics, *some_of_many(data), *self.moved)],
        }

    @property
    def sizes(self) -> Array:
        """(n,) how far every row is off [m], [rad] of angles; NaN in rows that stand out by themselves."""
        return sizes(self.error, self.fit.observed)

    def _each(self) -> dict[str, dict[str, float]]:
        """Rms and mean along every axis, or of every joint, that was measured."""
        names = [str(j) for j in range(1, 7)] if self.fit.observed.name == "joint" else "xyz"
        pairs = zip(names, self.error.T, strict=True)
        some = [(name, column[np.isfinite(column)]) for name, column in pairs]
        return {
            name: {"rms": mm(rms(column)), "mean": mm(float(column.mean()))} for name, column in some if len(column)
        }

    @property
    def moved(self) -> list[Diagnostic]:
        """DAT031 where the instrument stood elsewhere than for the model: the figures are those from there."""
        if self.before is None or not self.fit.free["instrument_frame"].any():
            return []
        now = self.fit.model.in_role(Role.INSTRUMENT_FRAME)
        assert now is not None
        far = 1e3 * float(np.linalg.norm((now.vector() - self.before)[:3]))
        message = f"the instrument stood {far:.1f} mm from where the model has it, or turned: these points place it"
        help_ = "nothing, if it was set up anew; else look for what moved"
        return [Diagnostic("DAT031", "info", message, self.fit.data.source, help=help_)]

    def text(self) -> str:
        """The figures in a sentence, then tables."""
        j, kind = self.as_json(), self.fit.observed
        key, unit, each = kind.key, kind.unit, kind.each
        noise, axes = j[key("noise")], j[key(f"per_{each}")]
        told = "the noise is not known" if noise is None else f"the noise is {noise:.3f} {unit} per {each}"
        subject = {"position": "The arm is", "orientation": "The flange is turned", "joint": "The worst joint is"}
        along = f" along {' and '.join(axes)}" if kind.name == "position" and len(axes) in (1, 2) else ""
        lines = [
            f"{subject[kind.name]} {j[key('mean')]:.3f} {unit} from where the model says{along}, "
            f"{j[key('maximum')]:.3f} {unit} at worst (rms {j[key('rms')]:.3f} {unit} per {each})"
            f"{_without(j['set_aside_rows'])}; {told}.",
            _without_physics(j[key("rms")], j[key("bound")], noise, f"{unit} per {each}"),
            *(f"{d.message[0].upper()}{d.message[1:]}." for d in some_of_many(self.fit.data)),
            *set_aside_lines(self.fit),
            "",
            f"{each:5s}  rms {unit}   mean {unit}",
            *(f"  {a}   {v['rms']:7.3f}  {v['mean']:z8.3f}" for a, v in axes.items()),
            "",
            "worst poses: "
            + ", ".join(f"{w['pose_id']} ({_row(w)}) {w[key('error')]:.3f} {unit}" for w in j["worst"][:5]),
        ]
        repeat = j["iso9283"]["repeatability_median_mm"] if "iso9283" in j else None
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


def _without_physics(error: float, bound: float, noise: float | None, unit: str) -> str:
    if noise is not None and error < 1.2 * noise:
        return "What is left is of the size of the noise."
    if bound > 0.9 * error:
        return (
            "No free function of the channels does much better; `postproc diagnose` also looks for steps, waves and "
            "lost motion."
        )
    return (
        f"A free function of the channels, without physics, brings it to {bound:.3f} {unit} on rows that "
        "it has not seen."
    )


def compare(model: Model, data: Measurements, *, noise: float | None = None) -> Comparison:
    """Compare a model, as it is, with measurements.

    Where the model has no instrument frame, or no tool, of its own, the ones that bring the points nearest are used,
    so that the figures speak of the arm. So is the place of an instrument that was set up elsewhere.
    """
    frame = model.in_role(Role.INSTRUMENT_FRAME)
    fit = evaluate(model, data, noise=noise)
    error, place = fit.observed_error.copy(), fit.position_error
    error[list(fit.set_aside)] = np.nan
    iso = iso9283(place[:, np.isfinite(place).any(axis=0)], fit.data.repeats)
    before = None if frame is None else frame.vector()
    moved = before is not None and fit.free["instrument_frame"].any()
    try:
        bound = fit_model(fit.model if moved else model, data, noise=noise).smooth_bound
    except PostprocError:  # too few rows for a fit
        bound = fit.smooth_bound
    return Comparison(fit, error, iso, residual_trends(fit), bound, before)


def sizes(error: Array, kind: Observation) -> Array:
    """(n,) length of the errors of a row, or the largest of its joints; NaN where nothing was measured."""
    if kind.name != "joint":
        return distances(error)
    seen = np.isfinite(error)
    return np.asarray(np.where(seen.any(axis=1), np.max(np.abs(np.where(seen, error, 0.0)), axis=1), np.nan))


def _iso_json(iso: Iso9283) -> dict[str, Any]:
    return {
        "accuracy_mean_mm": round(iso.accuracy_mean, 6),
        "accuracy_max_mm": round(iso.accuracy_max, 6),
        "repeatability_median_mm": iso.repeatability_median,
        "repeatability_max_mm": iso.repeatability_max,
        "repeated_poses": iso.poses,
    }
