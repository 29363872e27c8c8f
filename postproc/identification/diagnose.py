"""Which physics is missing: a verdict with its evidence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from postproc.effects.base import Effect
from postproc.effects.registry import effect_library
from postproc.estimation.findings import data_findings
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.priors import with_earlier_fit
from postproc.estimation.solving.rounding import with_judged_rounding
from postproc.estimation.solving.settle import settled
from postproc.identification.curves.families import curve_forms
from postproc.identification.diagnosis import Diagnosis, Verdict, lacks_fit, shortage
from postproc.identification.forecast import Forecast
from postproc.identification.refits import refit_all, thinned, with_channels_of, without
from postproc.identification.regions import SEARCHED_REGIONS, with_regions
from postproc.identification.screen.candidate import Candidate
from postproc.identification.screen.suspects import Suspect, by_channel
from postproc.identification.search import search, with_curves_anew, without_redundant_names
from postproc.identification.state import SearchState
from postproc.measure.measurements import Measurements
from postproc.measure.read.columns import columns_of
from postproc.model.arm import Model
from postproc.watch import Watch, unwatched

VISIBLE = 5.0
"""Standard deviations of the noise by which all rows together must change where an effect of ordinary size shows."""


def diagnose(
    model: Model,
    data: Measurements,
    extra_effects: Iterable[type[Effect]] = (),
    *,
    noise: float | None = None,
    watch: Watch = unwatched,
) -> Diagnosis:
    """Find which effects a model lacks on measurements, or what the remaining structure depends on.

    Forward selection by marginal likelihood with a full refit of every effect that is added, a backward check, and
    curves of the channels as rivals: where a curve without a name explains clearly more than the whole library, the
    verdict is "unknown".

    Args:
        extra_effects: classes beside the library's.
        noise: standard deviation per axis [m] stated by the user; that of repeats or ``sigma_mm`` by default.
        watch: is called with what is being done and the share of the work that is done.
    """
    library = effect_library()
    library.update({cls.key: cls for cls in extra_effects})
    data = with_channels_of(library.values(), model, data.in_order)
    model = with_earlier_fit(model, data)
    watch("the model as it came", 0.0)
    forecast = Forecast(watch)
    return with_judged_rounding(
        lambda rows: _diagnosed(model, rows, library, noise, forecast), data, lambda diagnosis: diagnosis.final
    )


def _diagnosed(
    model: Model, data: Measurements, library: Mapping[str, type[Effect]], noise: float | None, forecast: Forecast
) -> Diagnosis:
    """Return the diagnosis with joint angles taken as rounded or not as ``data.rounded`` says.

    Args:
        library: classes of all effects by key; noise: as in `diagnose`; forecast: is told how far the work is.
    """
    base = fit_model(model, data, noise=noise)
    measured = base.problem.sensitivity.state
    carried = model.station is not None and bool(model.station.joints)
    library = {k: c for k, c in library.items() if c.unlikely < np.inf and (carried or "external_axes" not in c.reads)}
    untestable = {k: _why_untestable(c, base) for k, c in library.items() if c.null().missing(measured)}
    classes = {k: c for k, c in library.items() if k not in untestable}
    start = thinned(base)
    forms = curve_forms(start.problem.sensitivity.state, start.problem.site)
    forecast.first("every effect alone", len(base.problem.residual) / len(start.problem.residual))
    begin = SearchState(start, start, classes, forms, forecast=forecast)
    first = begin.ranked
    searched = without_redundant_names(with_curves_anew(search(begin))).without_forms()
    del begin
    forecast.last("all of it on all rows", SEARCHED_REGIONS if searched.curves else 0)
    named = searched.with_curves(())
    final = named.fit if start is base else refit_all(base, named.fit, named.keys)
    exceeds_noise = lacks_fit(final)
    # What is reported is what `fit` and `add` write: with what was known before the rows.
    last = settled(final)
    missing = _validated(named.missing, final, last)
    curves = tuple(c.curve for c in searched.curves if c.curve is not None)
    # A few numbers for each parameter follow anything.
    remaining = () if shortage(base) and not missing else _remaining(named, curves, bool(exceeds_noise))
    quiet: Verdict = "complete" if exceeds_noise is False else "unknown"
    verdict: Verdict = "unknown" if remaining or exceeds_noise else "missing" if missing else quiet
    blind = {c.key: _why_blind(c) for c in first if c.visible < VISIBLE} | untestable
    in_model = {e.key for e in (*final.model.effects, *base.model.effects)}
    return Diagnosis(
        verdict=verdict,
        base=last if final is base else settled(base),
        final=last,
        model=with_regions(settled(searched.fit), named.fit, searched=len(curves)) if curves else last,
        screened=start,
        searched=named.fit,
        missing=missing,
        candidates=tuple(first),
        untestable=untestable,
        blind={key: why for key, why in blind.items() if key not in in_model},
        remaining=remaining,
        further=curves[1:] if remaining else (),
        exceeds_noise=exceeds_noise,
        floor=last.parts.level,
        bound=base.smooth_bound,
        diagnostics=(*base.data.diagnostics, *data_findings(last)),
    )


def _validated(missing: Sequence[Candidate], final: Fit, last: Fit) -> tuple[Candidate, ...]:
    """Return the missing effects, each with the held-out rms of the fit with it and those before it (`without`).

    Args:
        missing: in the order in which they were added; final: the fit with all of them, which also gives their final
            labels; last: the same, settled.
    """
    effects = [(final.model.effect(c.key), c) for c in missing]
    labelled = [replace(c, label=e.label) if e is not None and e.label else c for e, c in effects]
    fits = [settled(without(final, [c.key for c in missing[k:]])) for k in range(1, len(missing))]
    return tuple(replace(c, held_out_after=fit.held_out_rms) for c, fit in zip(labelled, [*fits, last], strict=False))


def _remaining(named: SearchState, curves: Sequence[Suspect], exceeds_noise: bool) -> tuple[Suspect, ...]:
    """Return curves that the remaining structure follows, one per channel; empty where it is hardly above noise.

    Args:
        named: the search with the named effects alone; curves: those that were added to it.
        exceeds_noise: whether more remains than the noise.
    """
    first = [c.curve for c in named.ranked_curves() if c.curve is not None]
    if not (curves or exceeds_noise or first):
        return ()
    if curves and curves[0].pattern not in [s.pattern for s in first[:1]]:
        first = curves[0].seen_by(named.fit.problem, named.fit.linear)
    others = [s for s in named.curve_screen.suspects() if not any(s is one for one in first)]
    return tuple(by_channel([*first, *others], curves[1:]))


def _why_untestable(cls: type[Effect], fit: Fit) -> str:
    """Return in words which channels an effect needs and the table lacks."""
    missing = cls.null().missing(fit.problem.sensitivity.state)
    derived = "; rows in the order of measuring tell them (`--rows-in-order`)" if "approach" in missing else ""
    return f"the table has no {' and no '.join(map(columns_of, missing))}{derived}"


def _why_blind(candidate: Candidate) -> str:
    """Return in words why this data could not have shown an effect."""
    if candidate.visible < 0.05:
        return "these poses do not move it, or the fitted parameters can do exactly the same"
    deviations = f"{candidate.visible:.1f} standard deviations of the noise, {VISIBLE:.0f} are needed"
    return f"an effect of ordinary size changes all rows together by {deviations}"
