"""A diagnosis: the verdict, the error now and with what is missing, and what was found."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from postproc.channels.units import shown, unit_of
from postproc.diagnostics import joined
from postproc.effects.registry import BUILT_IN
from postproc.estimation.contradictions import unphysical
from postproc.estimation.solving.smooth import effective_parameters
from postproc.grouping import grouped
from postproc.identification.diagnosis import Diagnosis, law_of_suspect
from postproc.identification.joint_curves import JointCurve, curves
from postproc.identification.screen.candidate import Candidate
from postproc.measure.errors import rms
from postproc.numbers import decimals_of, mm, mm_or_none
from postproc.report.blocks import Bar, Bars, Chart, DataTable, Document, Figure, Section, Values, View
from postproc.report.drawing.residuals import channel_sections, suspect_chart
from postproc.report.drawing.steps import Rung, steps_data
from postproc.results.improve.addition import BASE_LABEL
from postproc.results.improve.comparison import steps_scene, workspace_section
from postproc.results.improve.fit import (
    effect_values,
    noise_values,
    parameter_sections,
    parameter_table,
    sentence_of,
    undetermined_sentences,
)
from postproc.results.improve.sentences import MOST_RIVALS_NAMED, doubts, headline, title
from postproc.results.wording import ABOVE_NOISE, CHANNEL, SMOOTH_FUNCTIONS, p_text, percent, place

IN_REGIONS = "in parts of the joint space left out, searched anew"
NOTHING = "Nothing is missing"
"""The verdict "complete" in words."""
TELLING_CHANCE = 0.05
"""Chance below which a candidate stands in the ranking on the terminal; the first FEWEST and no more than MOST do.

Those of the user's own always do.
"""
FEWEST, MOST = 3, 8
LIBRARY = frozenset(cls.key for cls in BUILT_IN)
BLIND = "This data could not have shown (`postproc effects show KEY` says what to measure)"
NOISE = "The dashed line is the noise: no model can be expected below it. "
GREY_NOTE = "Grey: what smooth functions of all recorded columns reach without physics, for comparison."
REMAINING_NOTE = (
    f"A channel is {CHANNEL}; it explains a share {ABOVE_NOISE} that the final model leaves. The chart shows the "
    "first without the share that the fitted parameters have taken on. `postproc add` adds it as a `curve`."
)
RANKED = (
    "Evidence is twice the logarithm of the odds, after paying for parameters and for the number of forms that were "
    "tried: above 0 it speaks for the effect."
)


def diagnosis_document(name: str, d: Diagnosis) -> Document:
    """Describe a diagnosis, for terminal and page.

    Args:
        name: of the model and the tables, for the title.
    """
    values, kind, unit = diagnosis_values(d), d.base.observed, d.base.observed.unit
    floor, error, rms_key = values[kind.key("floor")], kind.key("held_out_rms"), kind.key("rms")
    rungs = [Rung(BASE_LABEL, d.base, d.base.held_out_rms)]
    if d.missing:
        rungs.append(Rung("with what is missing", d.model, d.final.held_out_rms))
    steps = cache(lambda: steps_data(rungs, [m.key for m in d.missing], floor))
    suspected = [(s.channel, s.where) for s in d.remaining]
    strongest = Chart(lambda: [suspect_chart(d.searched, s, d.floor) for s in d.remaining[:1] if d.missing], 320)
    law = [f"In symbols: {'; '.join(s['law'])}" for s in values["suspects"][:1]]
    blind = DataTable("not shown", ("effect", "why"), list(d.blind.items()))
    return Document(
        title=f"postproc diagnose {name}",
        values=values,
        sentence=headline(d),
        figures=[
            Figure("error now", values[error], "before", unit),
            Figure("noise", floor, unit=unit),
            *verdict_figures(values),
            Figure("error with it", values[f"{error}_after"] if d.missing else None, "after", unit),
            Figure("error in parts left out with what has no name", values[f"{rms_key}_unnamed"], "after", unit),
        ],
        sections=[
            _ladder(d, values, steps),
            Section(
                "Also to know", [*doubts(d), *undetermined_sentences(d.model), *map(sentence_of, unphysical(d.model))]
            ),
            _missing_section(d),
            *parameter_sections(d.model, [m.key for m in d.missing]),
            Section("What remains follows", [strongest, suspect_table(d.remaining), *law], REMAINING_NOTE),
            *workspace_section(kind.name, "What it follows, at this step", program=bool(d.missing)),
            *channel_sections(d.final, "What the rest follows", suspected, folded=kind.name == "position"),
            _ranking(d, values),
            Section(BLIND, [blind], folded=True),
        ],
        scene=steps_scene(kind.name, steps, several=bool(d.missing)),
    )


def diagnosis_values(d: Diagnosis) -> Values:
    """Return the ``postproc/diagnose/1`` document; keys of figures hold the unit of what was observed."""
    key = d.base.observed.key
    return {
        "schema": "postproc/diagnose/1",
        "observed": d.base.observed.name,
        "verdict": d.verdict,
        **noise_values(d.final),
        key("rms"): mm_or_none(d.base.rms),
        key("held_out_rms"): mm_or_none(d.base.held_out_rms),
        f"{key('rms')}_after": mm_or_none(d.final.rms),
        f"{key('held_out_rms')}_after": mm_or_none(d.final.held_out_rms),
        "missing": [
            {
                "effect": m.key,
                "form": m.label,
                f"{key('held_out_rms')}_after": mm_or_none(m.held_out_after),
                "p_value": m.p_value,
                **_kind_values(d, m.key),
                "not_separable_from": list(m.not_separable),
                "not_seen_beside": list(m.unseen),
                **effect_values(d.model, m.key),
                "law": [_curve_values(curve) for curve in curves(d.model, m.key)],
            }
            for m in d.missing
        ],
        "candidates": [_candidate(d, c.key, c) for c in d.candidates] + [_candidate(d, key) for key in d.untestable],
        "suspects": [
            {"channel": s.channel, "where": s.where, "share": round(s.share, 4), "pattern": s.pattern}
            | {"law": law_of_suspect(d.searched, s)}
            for s in d.remaining
        ],
        key("floor"): mm_or_none(d.floor),
        f"{key('rms')}_unnamed": None if d.regions is None else mm(rms(d.regions.after)),
        f"{key('rms')}_unnamed_before": None if d.regions is None else mm(rms(d.regions.before)),
        "searched": {"rows": len(d.searched.data), key("held_out_rms"): mm_or_none(d.searched.held_out_rms)},
        key("bound"): mm_or_none(d.bound),
        "blind_to": [{"effect": k, "why": why} for k, why in d.blind.items()],
        "diagnostics": [x.as_json() for x in d.diagnostics],
    }


def _kind_values(d: Diagnosis, key: str) -> Values:
    """Return ``is`` of an effect: ``cause`` or ``smooth correction``, the latter with its ``effective_parameters``.

    Args:
        key: of the effect. Effective parameters are those that the data determines.
    """
    effect = d.final.model.effect(key)
    if effect is None or effect.roughness() is None:
        return {"is": "cause"}
    return {"is": "smooth correction", "effective_parameters": round(effective_parameters(d.final, key), 1)}


def _curve_values(curve: JointCurve) -> Values:
    """Return an entry of ``missing[].law``: a joint's turn [mrad] over a channel."""
    unit, factor = unit_of(curve.channel)
    return {
        "joint": curve.joint,
        "channel": curve.channel,
        "unit": unit,
        "at": np.round(curve.at * factor, 3).tolist(),
        "turn_mrad": [mm(x) for x in curve.turn],
        "sigma_mrad": [mm(x) for x in curve.sigma],
    }


def _candidate(d: Diagnosis, key: str, c: Candidate | None = None) -> Values:
    """Return an entry of ``candidates``: an effect that was tried alone.

    Args:
        key: of the effect; c: its best form, None for an effect that this data cannot test.
    """
    before, why = d.screened.linear.square, {**d.blind, **d.untestable}.get(key)
    after = d.base.rms if c is None else d.base.rms * np.sqrt(max(before - c.rss_reduction, 0.0) / before)
    return {
        "effect": key,
        "form": "" if c is None else c.label,
        f"{d.base.observed.key('rms')}_after": mm_or_none(after),
        "p_value": 1.0 if c is None else float(c.p_value),
        "evidence": None if c is None or not np.isfinite(c.evidence) else round(c.evidence, 2),
        "testable": why is None,
        "why_not": why,
    }


def verdict_figures(values: Values) -> list[Figure]:
    """Return the missing effects as a figure, or the verdict and the effects where these do not explain all.

    Args:
        values: the document of the diagnosis.
    """
    names = []
    for m in values["missing"]:
        # Those that explain the data as well, without those that would not be seen beside it.
        similar = [key for key in m["not_separable_from"] if key not in m["not_seen_beside"]]
        names.append(" or ".join([m["effect"], *(similar if len(similar) <= MOST_RIVALS_NAMED else ["others"])]))
    missing = ", ".join(names)
    if values["verdict"] == "missing":
        return [Figure("missing", missing)]
    return [
        Figure("verdict", NOTHING if values["verdict"] == "complete" else values["verdict"]),
        Figure("found", missing or None),
    ]


def _ladder(d: Diagnosis, values: Values, steps: Any) -> Section:
    """Return the section with the error after each missing effect, from the model as it came down to the noise.

    Args:
        values: the document. steps: returns ``steps_data``, from which the page draws; beside the bars stand the
            effects' curves, or the strongest curve.
    """
    kind, floor = d.base.observed, values[d.base.observed.key("floor")]
    rungs = [Bar(BASE_LABEL, 1e3 * d.base.held_out_rms)]
    rungs += [Bar(f"+ {m.key}", 1e3 * m.held_out_after, place(m.label)) for m in d.missing]
    names = [BASE_LABEL, *(rung.name for rung in rungs[1:][-1:])]
    if d.regions is not None:
        note = f"{IN_REGIONS}; without it {1e3 * rms(d.regions.before):.3f}"
        rungs.append(Bar("+ what was found, without a name", 1e3 * rms(d.regions.after), note))
    rungs.append(Bar(SMOOTH_FUNCTIONS, 1e3 * d.bound))
    bars = Bars(rungs, floor, SMOOTH_FUNCTIONS, kind.unit, names if len(names) > 1 else ())

    def without_laws() -> list[str]:
        """Return the chart of the strongest curve, if no effect's curve can be drawn in its place."""
        laws = any(step["laws"] for step in steps()["steps"])
        return [] if laws else [suspect_chart(d.searched, s, d.floor) for s in d.remaining[:1]]

    return Section(
        f"The error on rows that the fit has not seen, {kind.unit} per {kind.each}",
        [bars, View("evidence"), Chart(without_laws, 320)],
        f"{NOISE if floor else ''}{GREY_NOTE}",
    )


def _missing_section(d: Diagnosis) -> Section:
    """Return the section with a row for each missing effect (form, p value, held-out error) and its parameters."""
    kind = d.base.observed
    rows = [(m.key, title(d, m), place(m.label), p_text(m.p_value), mm(m.held_out_after)) for m in d.missing]
    columns = ("effect", "what it is", "form", "p", f"held out with it [{kind.unit}]")
    tables = (
        DataTable("missing effects", columns, rows, decimals=decimals_of(d.floor * 1e3 if d.floor else 0.0)),
        parameter_table(d.model, [m.key for m in d.missing]),
    )
    extremes = []
    # Of a smooth correction: where each joint's curve is lowest and highest, and the median of its deviation.
    for curve in (c for m in d.missing if _kind_values(d, m.key)["is"] != "cause" for c in curves(d.model, m.key)):
        ends = sorted((int(np.argmin(curve.turn)), int(np.argmax(curve.turn))))
        knots = ", ".join(f"{1e3 * curve.turn[k]:.2f} mrad near {shown(curve.channel, curve.at[k])}" for k in ends)
        sigma = 1e3 * np.median(curve.sigma)
        extremes.append(f"joint {curve.joint} along {curve.channel}: {knots}, \N{PLUS-MINUS SIGN} {sigma:.2f}")
    return Section("What is missing", [*tables, *extremes], "`postproc add` writes the model that has it.")


def suspect_table(suspects: Sequence[Any]) -> DataTable:
    """Return a table with a row for each curve at a place, and all channels that show it.

    Args:
        suspects: values with ``where``, ``pattern``, ``share`` and ``channel``.
    """
    channels = grouped(((s.where, s.pattern, s.share), s.channel) for s in suspects)
    rows = [(where, joined(some), pattern, percent(share)) for (where, pattern, share), some in channels.items()]
    return DataTable("suspects", ("where", "channel", "pattern", "explains"), rows)


def _ranking(d: Diagnosis, values: Values) -> Section:
    """Return the folded section that ranks all effects, each added alone to the model as it came.

    Args:
        values: the document of the diagnosis.
    """
    kind = d.base.observed
    after = f"{kind.key('rms')}_after"
    rows = [
        (c["effect"], c[after], p_text(c["p_value"]), c["evidence"], place(c["form"]), c["why_not"] or "")
        for c in values["candidates"]
    ]
    digits = [None, decimals_of(values[kind.key("floor")] or 0.0), None, 1, None, None]
    columns = ("effect", f"rms after [{kind.unit}]", "p", "evidence", "form", "not testable because")
    heading = f"Ranking, each effect alone on the model as it came: rms per {kind.each} on the fitted rows"
    return Section(
        heading,
        [DataTable("ranking", columns, rows, brief_ranking(d.candidates), decimals=digits)],
        RANKED,
        folded=True,
    )


def brief_ranking(ranked: Sequence[Candidate]) -> list[int]:
    """Return the indices of candidates that a terminal prints: three to eight with p below 0.05, and the user's own.

    Args:
        ranked: the best first.
    """
    first = max(FEWEST, sum(c.p_value < TELLING_CHANCE for c in ranked[:MOST]))
    return [i for i, c in enumerate(ranked) if i < first or c.key not in LIBRARY]
