"""A fit: its error, its parameters, and what to know before relying on it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain

import numpy as np

from postproc.diagnostics import Diagnostic, joined
from postproc.effects.roles import Role
from postproc.estimation.contradictions import contradictions
from postproc.estimation.findings import MOST_ROWS_NAMED, cautions
from postproc.estimation.fitted import Fit
from postproc.estimation.recorded import beyond_sigma, expected_remaining, pose_error_sigma, undetermined
from postproc.grouping import grouped
from postproc.identification.add import FitFigures
from postproc.measure.errors import distances
from postproc.model.uncertainty.prediction import parameter_name
from postproc.numbers import mm, mm_or_none, percent_range
from postproc.report.blocks import Chart, DataTable, Document, Figure, Section, Values
from postproc.report.drawing.parameters import correlated_pairs, correlation_map, drawn_parameters, parameter_chart
from postproc.report.drawing.residuals import channel_sections
from postproc.results.wording import known_values, named_values, parameter_rows, parameters_text

PRIOR_NOTE = (
    "Dot and bar: estimate and 95 % interval; grey: 95 % interval of the prior. The axis counts standard deviations of "
    "the prior from its value, of springs in logarithms. Hollow: these rows say less than half, the prior stays."
)
CORRELATED = (
    "Correlations of the estimates: coloured together, dark against each other. Rows that move the one without the "
    "other tell them apart (`postproc plan`)."
)
LEAST_SHOWN = 5e-7
"""Part of the noise [m], [rad] below which it reads 0.000."""
PAIR_COLUMNS = ("parameter", "with", "correlation", "what these rows tell")
AT_BOUND = (
    "That is noise, and nothing is to be done, where `postproc diagnose` finds nothing missing; else what is missing "
    "acts there"
)
REMAINING = (
    "Of the deflection under these loads {} was expected to remain after a correction with the stiffness of the arm's "
    "type; with this model it is {}. Of that by the loads alone, without the weight of the links, it was {} and is {}. "
    "That holds for loads that acted where the table says"
)
NO_PROMISE = "The measurements contradict each other, or the arm: how much a correction leaves is not known"


def fit_document(name: str, fit: Fit) -> Document:
    """Describe a fit, for terminal and page.

    Args:
        name: of the tables, for the title.
    """
    unit, each, level, scatter = fit.observed.unit, fit.observed.each, fit.parts.level, fit.parts.repeatability or 0.0
    noise = "unknown" if level is None else f"{1e3 * level:.3f} {unit} ({fit.parts.origin})"
    if level is not None and scatter >= LEAST_SHOWN:
        what = "what no column explains, as no pose was repeated"
        if fit.noise.sigma is not None:
            alone = "more than the instrument scatters by itself"
            what = alone if fit.data.readings is not None else "how well the arm repeats a pose"
        noise += f", of which {1e3 * scatter:.3f} {unit} is {what}"
    keys = [e.key for e in fit.model.effects if e.role is not Role.SETUPS]
    unseen = f"{1e3 * fit.held_out_rms:.3f} {unit} on rows that the fit has not seen"
    if fit.unnamed:
        unseen = (
            "all of which the form of its curve was chosen on: what it is worth, rows of another table tell (`compare`)"
        )
    return Document(
        title=f"postproc fit {name}",
        values=fit_values(fit),
        sentence=f"The model misses {1e3 * fit.rms:.3f} {unit} per {each}, {unseen}; the noise is {noise}.",
        figures=[
            Figure("error in the fit", mm(fit.rms), unit=unit),
            Figure("error on other rows", mm_or_none(fit.unseen_rms), unit=unit),
            Figure("noise", mm_or_none(level), unit=unit),
        ],
        sections=[
            Section("Parameters", [parameter_table(fit, keys)]),
            Section("What to know of this fit", known_of(fit)),
            *parameter_sections(fit, ()),
            *channel_sections(fit, "What the residual follows"),
        ],
    )


def laws_in_symbols(fit: Fit) -> list[str]:
    """Return sentences with the laws of a model that have no name, in symbols."""
    return [f"`{e.key}`: {'; '.join(law)}" for e in fit.model.effects if (law := list(e.symbols()))]


def known_of(fit: Fit) -> list[str]:
    """Return sentences on undetermined parameters, rows left out, and what to know before relying on the fit."""
    lines = [*undetermined_sentences(fit), *excluded_rows(fit), *map(sentence_of, cautions(fit))]
    if against := contradictions(fit):
        codes = joined(list(dict.fromkeys(finding.code for finding in against)))
        return [f"{NO_PROMISE} ({codes}).", *lines]
    if (shares := expected_remaining(fit)) is None:
        return lines
    return [REMAINING.format(*map(percent_range, chain(*shares))), *lines]


def sentence_of(finding: Diagnostic) -> str:
    """Return a finding as one sentence: its message and what to do."""
    return f"{finding.message[0].upper()}{finding.message[1:]}; {finding.help}."


def undetermined_sentences(fit: Fit) -> list[str]:
    """Return sentences on parameters at their priors, on those that are held, and on those that stopped at a bound."""
    lines, open_ = [], undetermined(fit)
    if open_:
        shown = {(key, i): text for key in {key for key, _ in open_} for i, text in known_values(fit, key)}
        sources = dict(zip((*fit.posterior.names, *fit.posterior.unidentifiable), fit.posterior.sources, strict=True))
        by_source = grouped((sources[name], shown[name]) for name in open_ if name in shown)
        for source, texts in by_source.items():
            lines.append(
                f"The rows say little of {'; of '.join(texts)}, drawn towards what was known before ({source})"
            )
    fixed = [name for name in not_identifiable(fit) if name not in open_]
    if fixed:
        lines.append(f"Not determined by this data and held: {parameters_text(fit, fixed)}")
    if fit.at_bound:
        values = {(key, i): text for key in {key for key, _ in fit.at_bound} for i, text in known_values(fit, key)}
        stopped = joined([values.get(name) or parameters_text(fit, [name]) for name in fit.at_bound])
        lines.append(f"At the end of the range, beyond which the rows alone would go: {stopped}. {AT_BOUND}")
    return lines


def excluded_rows(fit: Fit) -> list[str]:
    """Return a sentence for each row that the fit leaves out, or one with their number where they are many."""
    off, unit, data = 1e3 * distances(fit.observed_error), fit.observed.unit, fit.data
    lines = [
        f"R{data.name(i)[1:]} was left out: it lies {off[i]:.1f} {unit} off, far from everything else."
        for i in fit.excluded
    ]
    rows = set(zip(data.file or (0,) * len(data), data.row, strict=False))
    for file, row in sorted(data.wrong - rows):
        of = f" of {data.sources[file].path}" if data.file else ""
        lines.append(f"Row {row}{of} was left out: it cannot have been measured as it stands.")
    if len(lines) > MOST_ROWS_NAMED:
        lines = [f"{len(lines)} rows were left out: they lie far from everything else."]
    return lines


def parameter_table(fit: Fit, keys: Iterable[str], brief: bool = False) -> DataTable:
    """Return a table of the fitted parameters of some effects [mm, mrad]; of an effect with many, only their number.

    Args:
        keys: of the effects. brief: a terminal prints the table only where all rows are asked for.
    """
    rows = [row for key in keys for row in parameter_rows(fit, key)]
    return DataTable("parameters", ("effect", "parameter", "value ± 1 σ", "unit"), rows, () if brief else None)


def parameter_sections(fit: Fit, first: Sequence[str]) -> list[Section]:
    """Return the sections of a page with the parameters of a fit beside their priors, and their correlations.

    Args:
        first: keys of effects that come before the others.
    """
    keys = [*first, *(e.key for e in fit.model.effects if e.key not in first and e.role is not Role.SETUPS)]
    words = named_values(fit, keys)
    chart = Chart(lambda: [parameter_chart(drawn_parameters(fit, words))])
    pairs = DataTable("correlations", PAIR_COLUMNS, correlated_pairs(fit, words, first), brief=())
    return [
        Section("Parameters, beside what was known before", [chart], PRIOR_NOTE),
        Section("Parameters that go together", [Chart(lambda: [correlation_map(fit, words)]), pairs], CORRELATED),
    ]


def fit_values(fit: Fit, before: Values | None = None) -> Values:
    """Return the ``postproc/fit/1`` document; keys of figures end in the unit of what was observed.

    Args:
        before: ``error_values`` of the model to which effects were added, None for a first fit.
    """
    shares, effects = expected_remaining(fit), {e.key: effect_values(fit, e.key) for e in fit.model.effects}
    return {
        "schema": "postproc/fit/1",
        "observed": fit.observed.name,
        **error_values(fit),
        **(
            {"rms_3d_mm": mm(fit.rms * np.sqrt(3))}
            if fit.observed.name == "position" and fit.data.readings is None
            else {}
        ),
        **noise_values(fit),
        "rows": len(fit.data) + len(fit.data.wrong),
        "set_aside_rows": [row for _, row in fit.excluded_rows],
        **(
            {"set_aside_files": [fit.data.sources[file].path for file, _ in fit.excluded_rows]} if fit.data.file else {}
        ),
        "before": before,
        "parameters": {key: values["parameters"] for key, values in effects.items()},
        "structure": {key: values["structure"] for key, values in effects.items() if values["structure"]},
        "undetermined": undetermined_values(fit),
        "not_identifiable": [parameter_name(fit.model, key, i) for key, i in not_identifiable(fit)],
        "expected_remaining_fraction": shares and [round(x, 3) for x in shares[0][1]],
        "expected_remaining_fraction_before": shares and [round(x, 3) for x in shares[0][0]],
        "at_bound": [parameter_name(fit.model, key, i) for key, i in fit.at_bound],
        "unexplained_mm": mm(pose_error_sigma(fit)),
        "beyond_mm": mm_or_none(beyond_sigma(fit)),
        "diagnostics": [d.as_json() for d in (*fit.data.diagnostics, *cautions(fit))],
    }


def error_values(fit: Fit | FitFigures) -> dict[str, float | None]:
    """Return the rms of a fit on its rows and on held-out rows, with keys that end in the unit.

    The latter is None for a model with a law without a name of which nobody asked how it does without part of the rows.
    """
    key = fit.observed.key
    return {key("rms"): mm(fit.rms), key("held_out_rms"): mm_or_none(fit.unseen_rms)}


def noise_values(fit: Fit) -> Values:
    """Return entries of a document: the noise of one measured number, the arm's repeatability in it, and their origin.

    Noise and repeatability are in mm or mrad, as their keys say, and None where they are not known.
    """
    key = fit.observed.key
    return {
        key("noise"): mm_or_none(fit.parts.level),
        key("noise_repeatability"): mm_or_none(fit.parts.repeatability),
        "noise_from": fit.parts.origin,
    }


def effect_values(fit: Fit, key: str) -> dict[str, Values]:
    """Return ``parameters`` and ``structure`` of an effect, both empty where the model has no such effect.

    Each parameter has its entries as [value, standard deviation], in SI units; the latter is None for an entry that was
    not fitted. Structural choices are searched and not fitted: a joint, a harmonic order.

    Args:
        key: of the effect.
    """
    effect = fit.model.effect(key)
    if effect is None:
        return {"parameters": {}, "structure": {}}
    known = [fit.sigma.get((key, i)) for i in range(len(effect.vector()))]
    pairs = iter(zip(effect.vector().tolist(), known, strict=True))
    entries = {n: [list(next(pairs)) for _ in range(int(np.prod(effect.shape(n))))] for n in effect.parameters()}
    return {"parameters": entries, "structure": {k: v for k, v in effect.to_file().items() if k in effect.structures()}}


def not_identifiable(fit: Fit) -> list[tuple[str, int]]:
    """Return the parameters (effect key, index) that these rows cannot determine beside the others."""
    return list(dict.fromkeys([*fit.unidentifiable, *fit.posterior.unidentifiable]))


def undetermined_values(fit: Fit) -> list[Values]:
    """Return the parameters that stand at their priors, with value, standard deviation and source, in SI units."""
    after = fit.posterior
    names = (*after.names, *after.unidentifiable)
    return [
        {
            "parameter": parameter_name(fit.model, *names[k]),
            "value": float(after.mean[k]),
            "sigma": float(after.deviations[k]),
            "source": after.sources[k],
        }
        for k in after.undetermined
    ]
