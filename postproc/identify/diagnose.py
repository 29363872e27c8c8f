"""Which physics is missing: a verdict with its evidence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from postproc.diagnostics import Diagnostic
from postproc.effects.base import Effect
from postproc.effects.registry import effect_library
from postproc.identify.bound import nonparametric_bound
from postproc.identify.channels import channels
from postproc.identify.findings import data_findings
from postproc.identify.fit import Fit, fit_model
from postproc.identify.linear import Linear, f_test
from postproc.identify.forms import Form, as_rows, schwarz
from postproc.identify.selection import (
    SIGNIFICANT,
    Candidate,
    Screen,
    compose,
    confusable,
    convincing,
    judged,
    refit,
    MATERIAL,
)
from postproc.identify.suspects import ODDS, Pattern, Suspect, by_channel, find_suspects, patterns
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model

Verdict = Literal["complete", "missing", "unknown"]
MOST = 6
"""Effects that are added one after another at most."""
ENOUGH = 3000
"""Measured numbers beyond which the search takes every second, third .. pose."""
HIDDEN = ("outlier",)
"""Effects that are findings about rows, not candidates."""


@dataclass(frozen=True)
class Missing:
    """An effect that the model lacks.

    Args:
        candidate: what it is; held_out_after: held-out rms once it and those before it are in [m].
        not_separable: effects that explain this data nearly as well.
    """

    candidate: Candidate
    held_out_after: float
    not_separable: tuple[str, ...]


@dataclass(frozen=True)
class Diagnosis:
    """The verdict.

    Args:
        base: the model as it came, fitted again; final: with the missing effects.
        missing: in the order of selection; candidates: every effect of the library on the base, best first.
        suspects: what the remaining structure follows; blind: effects that this data could not have shown, with the reason.
        floor: noise per axis [m], None where nothing tells it; bound: held-out rms that any function of the channels reaches [m].
    """

    verdict: Verdict
    base: Fit
    final: Fit
    missing: tuple[Missing, ...]
    candidates: tuple[Candidate, ...]
    untestable: Mapping[str, str]
    blind: Mapping[str, str]
    suspects: tuple[Suspect, ...]
    floor: float | None
    bound: float
    diagnostics: tuple[Diagnostic, ...] = field(default=(), repr=False)

    def as_json(self) -> dict[str, Any]:
        from postproc.identify.report import diagnosis_json

        return diagnosis_json(self)

    def text(self) -> str:
        from postproc.identify.report import diagnosis_text

        return diagnosis_text(self)


@dataclass
class _Search:
    """The state of the search: the fit so far, what was added, and patterns outside the library."""

    fit: Fit
    classes: Mapping[str, type[Effect]]
    patterns: list[Pattern]
    outside: list[Suspect]
    cache: dict[bytes, dict[str, list[Form]]] = field(default_factory=dict)

    def screen(self) -> Screen:
        """Forms are made once for the whole search: refits move their columns by no more than a few parts in a thousand."""
        used = self.fit.problem.weights.used.tobytes()
        made = self.cache.setdefault(used, {})
        fresh = {k: forms for k, forms in made.items() if self.fit.model.effect(k) is None}
        screen = Screen(self.fit.problem, self.classes, fresh)
        return screen

    def remember(self, screen: Screen) -> None:
        made = self.cache.setdefault(self.fit.problem.weights.used.tobytes(), {})
        made.update({k: forms for k, forms in screen.first.items() if self.fit.model.effect(k) is None})

    def linear(self) -> Linear:
        linear = self.fit.linear
        for suspect in self.outside:
            linear = linear.extended(as_rows(linear, suspect.columns))
        return linear


def diagnose(
    model: Model,
    data: Measurements,
    extra_effects: Iterable[type[Effect]] = (),
    *,
    noise: float | None = None,
) -> Diagnosis:
    """Find which effects a model lacks on measurements, or what the remaining structure follows.

    Forward selection by marginal likelihood with a full refit of every effect that is taken, a backward check, and free patterns of
    the channels as rivals: where a pattern without a name explains clearly more than the whole library, the verdict is "unknown".

    Args:
        extra_effects: classes beside the library's. noise: standard deviation per axis [m] stated by the user.
    """
    library = effect_library()
    library.update({cls.key: cls for cls in extra_effects})
    base = fit_model(model, data, noise=noise)
    state = base.problem.sensitivity.state
    untestable = {k: _why_untestable(c, base) for k, c in library.items() if k not in HIDDEN and c.missing(state)}
    classes = {k: c for k, c in library.items() if k not in HIDDEN and k not in untestable}
    start = _thinned(base, noise)
    named = channels(start.problem.sensitivity.state, start.problem.rest.T_base_tcp[:, :3, 3])
    search = _Search(start, classes, patterns(named), [])
    first = ranking(search)
    missing = _forward(search, first)
    missing = _backward(search, start, missing, noise)
    bound = min(nonparametric_bound(search.fit, named), search.fit.held_out_rms)
    final = search.fit if start is base else _refit_all(base, search.fit, [m.candidate for m in missing], noise)
    if missing and start is not base:
        missing[-1] = replace(missing[-1], held_out_after=final.held_out_rms)
    return _conclude(search, base, final, first, missing, untestable, bound)


def _thinned(base: Fit, noise: float | None) -> Fit:
    """The base on every k-th pose where there are more than the search needs; the full data then gives the final fit."""
    step = int(base.problem.weights.used.sum() // ENOUGH)
    if step < 2:
        return base
    groups = base.data.repeats
    kept = (groups % step == 0) & ~np.isin(np.arange(len(groups)), base.set_aside)
    return fit_model(base.model, base.data.rows(kept), free=base.free, noise=noise, penalty=base.strength)


def ranking(search: _Search) -> list[Candidate]:
    """Every testable effect at its best on the present fit, best first; those with forming parameters after a full refit."""
    screen, linear = search.screen(), search.linear()
    found = [c for key in search.classes if (c := compose(screen, linear, key)) is not None]
    search.remember(screen)
    found.sort(key=lambda c: -c.evidence)
    best = found[0].evidence if found else 0.0
    for i, candidate in enumerate(found):
        if candidate.starts and candidate.evidence > max(0.0, 0.2 * best) and not search.outside:
            fitted = [(s, f) for s in candidate.starts if (f := refit(search.fit, screen, linear, s)) is not None]
            if fitted:
                found[i] = max((judged(search.fit, f, s) for s, f in fitted), key=lambda c: c.evidence)
    return sorted(found, key=lambda c: -c.evidence)


def _forward(search: _Search, first: list[Candidate]) -> list[Missing]:
    """Effects of the library one after another; patterns without a name where they explain the data better than that.

    Where a pattern beat a named effect on the way, the search is run once more with the pattern taken, and the whole that is
    worth more is kept: early on, a pattern may only look better because other effects are still missing.
    """
    named = replace(search, outside=[])
    missing, worth, contested = _select(named, first, False)
    if contested:
        free = replace(search, outside=[])
        other, value, _ = _select(free, first, True)
        if value > worth:
            named, missing = free, other
    search.fit, search.outside, search.classes = named.fit, named.outside, named.classes
    return missing


def _select(search: _Search, first: list[Candidate], rivals: bool) -> tuple[list[Missing], float, bool]:
    missing: list[Missing] = []
    ranked, worth, contested = first, 0.0, False
    for _ in range(MOST):
        best = next((c for c in ranked if convincing(c, search.fit, len(search.classes))), None)
        suspects = find_suspects(search.fit.problem, search.linear(), search.patterns)
        outside = suspects[0] if suspects and _clear(suspects[0], search.linear()) else None
        beaten = best is not None and outside is not None and outside.evidence > best.evidence
        contested |= beaten
        if best is not None and not (beaten and rivals):
            taken = _take(search, best, ranked)
            if taken is None:
                search.classes = {k: c for k, c in search.classes.items() if k != best.key}
            else:
                missing = [m for m in missing if m.candidate.key != best.key] + [taken]
                worth += best.evidence
        elif outside is not None and len(search.outside) < 3:
            search.outside = [*search.outside, outside]
            worth += outside.evidence
        else:
            break
        ranked = ranking(search)
    return missing, worth, contested


def _take(search: _Search, best: Candidate, ranked: list[Candidate]) -> Missing | None:
    """The effect in the model, everything refitted; None where rows that the fit has not seen are not predicted better."""
    screen = search.screen()
    after = refit(search.fit, screen, search.linear(), best)
    if after is None or after.held_out_rms >= search.fit.held_out_rms:
        return None
    before, search.fit = search.fit, after
    return Missing(judged(before, after, best), after.held_out_rms, confusable(ranked, best))


def _clear(suspect: Suspect, linear: Linear) -> bool:
    before = float(linear.rest @ linear.rest)
    return suspect.evidence > 0 and suspect.fall > 3 * MATERIAL * before


def _backward(search: _Search, base: Fit, missing: list[Missing], noise: float | None) -> list[Missing]:
    """Each effect that was added must still be needed beside the others, and be the best for its part."""
    at = 0
    while len(missing) > 1 and at < len(missing):
        one = missing[at].candidate
        others = [m.candidate for m in missing if m.candidate.key != one.key]
        without = _refit_all(base, search.fit, others, noise)
        trial = replace(search, fit=without)
        ranked = ranking(trial)
        mine = next((c for c in ranked if c.key == one.key), None)
        taken = {c.key for c in others}
        rivals = [c for c in ranked if c.key not in taken]
        if mine is None or not convincing(mine, without, len(search.classes)):
            missing = [m for m in missing if m.candidate.key != one.key]
            search.fit, at = without, 0
            continue
        better = rivals[0]
        if better.key != one.key and better.evidence > mine.evidence + 6.0 and at < len(missing) - 1:
            after = refit(without, trial.screen(), trial.linear(), better)
            if after is not None and after.held_out_rms < search.fit.held_out_rms:
                new = Missing(judged(without, after, better), after.held_out_rms, confusable(rivals, better))
                missing = [*missing[:at], new, *missing[at + 1 :]]
                search.fit = after
                at += 1
                continue
        missing[at] = replace(missing[at], not_separable=confusable(rivals, mine))
        at += 1
    return missing


def _refit_all(base: Fit, fitted: Fit, candidates: list[Candidate], noise: float | None) -> Fit:
    keys = {c.key for c in candidates}
    effects = [e for e in fitted.model.effects if e.key in keys]
    free = {**base.free, **{c.key: fitted.free[c.key] for c in candidates}}
    strength = {k: v for k, v in fitted.strength.items() if base.model.effect(k) is not None or k in keys}
    return fit_model(base.model, base.data, effects, free=free, noise=noise, penalty=strength)


def _conclude(
    search: _Search,
    base: Fit,
    final: Fit,
    first: list[Candidate],
    missing: list[Missing],
    untestable: Mapping[str, str],
    bound: float,
) -> Diagnosis:
    linear = search.fit.linear
    still = [s for s in search.outside if _still(s, linear)]
    strongest = find_suspects(search.fit.problem, linear, search.patterns)
    lacking = _lack_of_fit(final)
    shown: list[Suspect] = []
    verdict: Verdict = "missing" if missing else "complete"
    if still or lacking or (strongest and _clear(strongest[0], linear)):
        verdict = "unknown"
        shown = by_channel(strongest)
    blind = {c.key: _why_blind(c) for c in first if c.visible < 5.0}
    blind.update(untestable)
    blind = {
        k: why
        for k, why in blind.items()
        if base.model.effect(k) is None and k not in {m.candidate.key for m in missing}
    }
    found = (*base.data.diagnostics, *data_findings(final))
    return Diagnosis(
        verdict,
        base,
        final,
        tuple(missing),
        tuple(first),
        untestable,
        blind,
        tuple(shown),
        base.noise.position,
        bound,
        found,
    )


def _still(suspect: Suspect, linear: Linear) -> bool:
    if len(suspect.columns) > len(linear.residual):
        return True
    rest = float(linear.rest @ linear.rest)
    after = linear.extended(as_rows(linear, suspect.columns))
    fall = rest - float(after.rest @ after.rest)
    return schwarz(rest, fall, suspect.columns.shape[1], linear.freedom, 1e4) - ODDS > 0 and fall > 3 * MATERIAL * rest


def _lack_of_fit(fit: Fit) -> bool:
    """Whether more is left than the noise: residual variance against that of the repeats (F test), and by a margin that matters."""
    noise = fit.noise
    if noise.position is None or fit.freedom <= 0:
        return False
    from scipy.special import fdtrc

    ratio = fit.variance
    dof = noise.dof if np.isfinite(noise.dof) else 1e6
    return bool(ratio > 1.5 and fdtrc(fit.freedom, dof, ratio) < 1e-6)


def _why_untestable(cls: type[Effect], fit: Fit) -> str:
    missing = cls.missing(fit.problem.sensitivity.state)
    names = {
        "v": "joint speed",
        "a": "acceleration",
        "approach": "approach side (dir1 .. dir6)",
        "wrench": "external force",
    }
    return f"no {' or '.join(names.get(m, m) for m in missing)} channel"


def _why_blind(candidate: Candidate) -> str:
    if candidate.visible < 0.05:
        return "these poses do not move it, or the fitted parameters can do exactly the same"
    return f"an effect of ordinary size would stand out by only {candidate.visible:.1f} standard deviations in all of this data"


__all__ = ["Diagnosis", "Missing", "diagnose", "f_test", "SIGNIFICANT"]
