"""A model beside measurements: how far it is off, where, and what that follows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from postproc.channels.units import unit_of
from postproc.estimation.findings import subsample_findings
from postproc.identification.compare import Comparison, Trend, sizes, worst_rows
from postproc.measure.errors import rms
from postproc.numbers import decimals_of, mm, mm_or_none
from postproc.report.blocks import Bar, Bars, Chart, DataTable, Document, Figure, Scene, Section, Values, View
from postproc.report.drawing.laws import law_charts, laws_of
from postproc.report.drawing.residuals import channel_sections
from postproc.report.drawing.steps import Rung, steps_data
from postproc.results.improve.fit import excluded_rows, noise_values
from postproc.results.wording import CHANNEL, SMOOTH_FUNCTIONS

RESIDUAL_NOTE = (
    "The channels that stand out. Points: each pose, less the mean; lines: means with their standard errors; rings: "
    "the worst poses; grey: twice the noise."
)
GREY = (
    "Grey: what a smooth function of all columns, without physics, reaches on rows that it has not seen. "
    "An effect that jumps can do better."
)
FOLLOWS = f"What the residual follows: share of its variance that each channel ({CHANNEL}) explains alone, above chance"
WITHIN = {"50": "half", "95": "95 %", "99": "99 %"}  # shares of the poses by their percentile
AS_IT_IS = "this model as it is"
"""Nothing is fitted but where the instrument stands: `diagnose` and `add` state errors of the model fitted again."""
WORST, FOLLOWED = 5, 8
"""Worst poses, and channels that the residual follows, that a terminal prints."""


def comparison_document(name: str, comparison: Comparison) -> Document:
    """Describe a comparison of a model with measurements, for terminal and page.

    Args:
        name: of the model and the tables, for the title.
    """
    values, fit, kind = comparison_values(comparison), comparison.fit, comparison.fit.observed
    noise, each = values[kind.key("noise")], f"{kind.unit} per {kind.each}"
    worst = [(w["pose_id"], w["row"], w.get("file"), w[kind.key("error")]) for w in values["worst"]]
    follows = [(t["channel"], t["where"], f"{100 * t['share']:.0f} %") for t in values["channels"]]
    worst_columns = ("pose", "row", "file", f"off [{kind.unit}]")
    worst_poses = DataTable("worst poses", worst_columns, worst, range(min(WORST, len(worst))), view="worst")
    followed = DataTable("shares", ("channel", "at", "explains"), follows, range(min(FOLLOWED, len(follows))))
    error, bound = values[kind.key("rms")], values[kind.key("bound")]
    bars = Bars([Bar(AS_IT_IS, error), Bar(SMOOTH_FUNCTIONS, bound)], noise, SMOOTH_FUNCTIONS, kind.unit)
    laws = Chart(lambda: law_charts(laws_of(fit, [e.key for e in fit.model.effects])), 320)
    many = [f"{d.message[0].upper()}{d.message[1:]}." for d in subsample_findings(fit.data)]
    known = [_without_physics(error, bound, noise, each), *many, *excluded_rows(fit)]
    return Document(
        title=f"postproc compare {name}",
        values=values,
        sentence=_sentence(comparison, values),
        figures=[
            Figure("mean distance", values[kind.key("mean")], unit=kind.unit),
            Figure(f"rms per {kind.each}", error, "before", kind.unit),
            Figure(f"noise per {kind.each}", noise, unit=kind.unit),
        ],
        sections=[
            Section(f"How far, and how far it could be, rms in {each}", [bars, View("evidence"), *known], GREY),
            *workspace_section(kind.name, "What it follows most"),
            Section("Worst poses", [worst_poses]),
            *channel_sections(fit, "What it follows: every channel", folded=kind.name == "position"),
            Section("Figures", _figures(values, comparison)),
            Section("Laws that the model holds", [laws], "At these poses.", folded=True),
            Section(FOLLOWS, [followed], folded=True),
        ],
        scene=steps_scene(kind.name, lambda: steps_data([Rung(AS_IT_IS, fit, fit.rms, held_out=False)], (), noise)),
    )


def comparison_values(comparison: Comparison) -> Values:
    """Return the ``postproc/compare/1`` document; keys of figures end in the unit of what was observed."""
    data, kind, length = comparison.fit.data, comparison.fit.observed, comparison.sizes * 1e3
    key, good, iso = kind.key, np.isfinite(length), comparison.iso
    known = length[good] if good.any() else np.zeros(1)
    far = sizes(comparison.fit.observed_error, kind) * 1e3
    names = [str(j) for j in range(1, 7)] if kind.name == "joint" else "xyz"
    axes = zip(names, comparison.error.T, strict=True)
    measured = [(name, numbers) for name, column in axes if len(numbers := column[np.isfinite(column)])]
    if kind.each == "reading" and len(measured) == 1:  # of one number, in a direction of its own
        measured = [("reading", measured[0][1])]
    kept = np.isin(np.arange(len(data)), comparison.fit.excluded, invert=True)
    rotation = comparison.fit.problem.error[kept, 3:6] if data.rotation is not None else None
    space = kind.name == "position" and kind.each == "axis"
    iso_values = {
        "accuracy_mean_mm": round(iso.accuracy_mean, 6),
        "accuracy_max_mm": round(iso.accuracy_max, 6),
        "repeatability_median_mm": iso.repeatability_median,
        "repeatability_max_mm": iso.repeatability_max,
        "repeated_poses": iso.poses,
    }
    return {
        "schema": "postproc/compare/1",
        "observed": kind.name,
        "rows": len(data),
        "set_aside_rows": [row for _, row in comparison.fit.excluded_rows],
        key("rms"): mm(rms(comparison.error)),
        **({"rms_3d_mm": round(float(np.sqrt(np.mean(known**2))), 6)} if space else {}),
        key("mean"): round(float(np.mean(known)), 6),
        key("maximum"): round(float(np.max(known)), 6),
        key("percentiles"): {p: round(float(np.percentile(known, float(p))), 6) for p in WITHIN},
        key(f"per_{kind.each}"): {
            name: {"rms": mm(rms(column)), "mean": mm(float(column.mean()))} for name, column in measured
        },
        **({"rotation_rms_mrad": None if rotation is None else round(1e3 * rms(rotation), 6)} if space else {}),
        **({"iso9283": iso_values} if space else {}),
        **noise_values(comparison.fit),
        key("floor"): mm_or_none(comparison.fit.parts.level),
        key("bound"): mm(comparison.bound),
        "worst": [
            {
                **({"file": data.sources[data.file[i]].path} if data.file else {}),
                "row": data.row[i],
                "pose_id": data.pose_id[i],
                key("error"): round(float(far[i]), 6),
            }
            for i in worst_rows(far)
        ],
        "channels": [_trend_values(t) for t in comparison.trends],
        "diagnostics": [d.as_json() for d in (*data.diagnostics, *subsample_findings(data), *comparison.moved)],
    }


def _trend_values(trend: Trend) -> Values:
    """Return an entry of ``channels`` of the document, with channel values in degrees or mm."""
    unit, factor = unit_of(trend.channel)
    return {
        "channel": trend.channel,
        "where": trend.where,
        "share": round(trend.share, 4),
        "centre_unit": unit,
        "unit": "mm" if trend.where == "space" else "mrad",
        "centre": [factor * float(x) for x in trend.centre],
        "mean": [float(x) for x in trend.mean],
        "standard_error": [float(x) for x in trend.spread],
    }


def workspace_section(observed: str, title: str, program: bool = False) -> list[Section]:
    """Return the section of the residual in space; an empty list where no position was measured.

    Args:
        observed: what was measured: ``position``, ``orientation`` or ``joint``. title: of the section.
        program: also show six poses as targets of a program, as each step of the model would correct them.
    """
    return [Section(title, [View("program" if program else "charts")], RESIDUAL_NOTE)] if observed == "position" else []


def steps_scene(observed: str, steps: Callable[[], Values], several: bool = False) -> Scene:
    """Return the scene of a page with steps: residuals in space, where positions were measured, and the controls.

    Args:
        observed: what was measured. steps: returns ``steps_data``. several: there is more than one step.
    """
    space = observed == "position"
    return Scene("steps", steps, "controls" if several else "", "stage" if space else "")


def _sentence(comparison: Comparison, values: Values) -> str:
    """Say how far the arm is from the model, at worst, and how large the noise is.

    Args:
        values: the document of the comparison.
    """
    kind = comparison.fit.observed
    noise, axes = values[kind.key("noise")], values[kind.key(f"per_{kind.each}")]
    noise_text = "the noise is not known" if noise is None else f"the noise is {noise:.3f} {kind.unit} per {kind.each}"
    subject = {"position": "The arm is", "orientation": "The flange is turned", "joint": "The worst joint is"}
    rows = values["set_aside_rows"]
    excluded = "a row that lies" if len(rows) == 1 else f"{len(rows)} rows that lie"
    without = f", without {excluded} far from everything else" if rows else ""
    along = f" along {' and '.join(axes)}" if kind.name == "position" and len(axes) in (1, 2) else ""
    from_model = f"from where the model says{along}"
    if kind.each == "reading":
        subject, from_model = {kind.name: "A reading is"}, "from what the model says"
    return (
        f"{subject[kind.name]} {values[kind.key('mean')]:.3f} {kind.unit} {from_model}, "
        f"{values[kind.key('maximum')]:.3f} {kind.unit} at worst (rms {values[kind.key('rms')]:.3f} {kind.unit} per "
        f"{kind.each}){without}; {noise_text}."
    )


def _without_physics(error: float, bound: float, noise: float | None, unit: str) -> str:
    """Say whether the error is only noise; else, how far a smooth function of all columns would lower it.

    Args:
        error, bound, noise: rms of the model, of a smooth function on held-out rows, and of the noise, in ``unit``;
            noise is None where it is not known.
    """
    if noise is not None and error < 1.2 * noise:
        return "What is left is of the size of the noise."
    if bound > 0.9 * error:
        others = "`postproc diagnose` also looks for steps, waves and lost motion"
        return f"No smooth function of all columns does much better; {others}."
    lowered = f"brings it to {bound:.3f} {unit} on rows that it has not seen"
    return f"A smooth function of all columns, without physics, {lowered}."


def _figures(values: Values, comparison: Comparison) -> list[DataTable]:
    """Return two tables: rms and mean by axis or joint; percentiles, worst pose and ISO 9283 figures.

    Args:
        values: the document of the comparison.
    """
    kind = comparison.fit.observed
    digits = decimals_of(values[kind.key("noise")] or 0.0)
    within, along = values[kind.key("percentiles")], values[kind.key(f"per_{kind.each}")]
    one = "reading" if kind.each == "reading" else "pose"
    single = [
        *((f"{share} of the {one}s are within", within[p]) for p, share in WITHIN.items()),
        (f"worst {one}", values[kind.key("maximum")]),
        *iso_figures(values),
    ]
    axes = [(name, float(v["rms"]), float(v["mean"]) + 0.0) for name, v in along.items()]
    return [
        DataTable("axes", (kind.each, f"rms [{kind.unit}]", f"mean [{kind.unit}]"), axes, decimals=digits),
        DataTable("figures", ("figure", kind.unit), single, decimals=digits),
    ]


def iso_figures(values: Values) -> list[tuple[str, Any]]:
    """Return ISO 9283 figures as (label, value [mm]); empty where no position was measured, as of readings.

    Args:
        values: the document of the comparison.
    """
    labels = ("accuracy AP, mean", "accuracy AP, largest", "repeatability RP, median", "repeatability RP, largest")
    figures = values.get("iso9283", {}).values()
    return [(f"ISO 9283 pose {label}", value) for label, value in zip(labels, figures, strict=False)]
