"""Which physics is missing: a verdict with its evidence."""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from postproc.diagnostics import Diagnostic
from postproc.effects.base import Effect
from postproc.effects.joint_error_map import JointErrorMap
from postproc.effects.registry import effect_library
from postproc.fit.channels import channels
from postproc.fit.findings import MANY, data_findings, larger_noise, standing_out
from postproc.fit.fitted import Fit, rms
from postproc.fit.held_out import contiguous_blocks, hold_out
from postproc.fit.least_squares import fit_model
from postproc.fit.leftover import smooth_bound
from postproc.fit.rounding import rounded
from postproc.fit.watch import Watch, unwatched
from postproc.identify.backward import check_backward
from postproc.identify.candidate import Candidate
from postproc.identify.contest import contested, formed_beside
from postproc.identify.interventions import Intervention
from postproc.identify.lines import lines_or_map, perhaps_a_map
from postproc.identify.ranking import Search, ranking
from postproc.identify.refits import refit_all, thinned, without
from postproc.identify.search import select_forward
from postproc.identify.unnamed import clear
from postproc.identify.verdict import too_few
from postproc.identify.whole import Missing
from postproc.measure.columns import columns_of
from postproc.measure.measurements import Measurements
from postproc.model.arm import Model
from postproc.patterns.every import patterns
from postproc.patterns.sight import Sight
from postproc.patterns.suspects import Suspect, by_channel

Verdict = Literal["complete", "missing", "unknown"]
COLLECT = 100_000
"""New objects after which the collector looks for cycles among them."""
HIDDEN = ("outlier",)
"""Effects that are findings about rows, not candidates."""


@dataclass(frozen=True)
class Diagnosis:
    """The verdict.

    Args:
        base: the model as it came, fitted again; final: with the missing effects.
        screened, searched: the same on the rows that were searched, every k-th pose of many: those of the candidates
            and of the suspects.
        missing: in the order of selection; candidates: every effect of the library on the base, best first.
        suspects: what the remaining structure follows; beside: further patterns, found once the first is taken.
        blind: effects that this data could not have shown, with the reason.
        hold_out: what was found, asked for levels of a channel that no fit has seen; None where nobody asked.
        told: the fit that tells the parameters of what is missing: final, or with the patterns beside it.
        floor: noise per axis [m], None where nothing tells it; bound: held-out rms that any function of the channels
            reaches [m].
    """

    verdict: Verdict
    base: Fit
    final: Fit
    told: Fit
    screened: Fit
    searched: Fit
    missing: tuple[Missing, ...]
    candidates: tuple[Candidate, ...]
    untestable: Mapping[str, str]
    blind: Mapping[str, str]
    suspects: tuple[Suspect, ...]
    beside: tuple[Suspect, ...]
    floor: float | None
    bound: float
    hold_out: Intervention | None = None
    diagnostics: tuple[Diagnostic, ...] = field(default=(), repr=False)

    @cached_property
    def unnamed(self) -> float | None:
        """Held-out rms [m] of the searched rows with the patterns that remain without a name; None where none does."""
        if not self.suspects:
            return None
        fit = self.searched
        told = [s.columns(fit.problem) for s in (self.suspects[0], *self.beside)]
        known = fit.linear.extended(np.hstack(told))
        out = hold_out(known.residual, known.nuisance, contiguous_blocks(fit.data.repeats)[known.row])
        return rms(fit.problem.weights.measured(out)[:, fit.observed.columns])

    @property
    def misleading(self) -> bool:
        """Whether rows that the fit has not seen are predicted worse with the patterns that remain than without."""
        return self.unnamed is not None and self.unnamed > self.searched.held_out_rms

    def as_json(self) -> dict[str, Any]:
        from postproc.identify.report import diagnosis_json

        return diagnosis_json(self)

    def text(self) -> str:
        from postproc.identify.report import diagnosis_text

        return diagnosis_text(self)


def diagnose(
    model: Model,
    data: Measurements,
    extra_effects: Iterable[type[Effect]] = (),
    *,
    noise: float | None = None,
    watch: Watch = unwatched,
) -> Diagnosis:
    """Find which effects a model lacks on measurements, or what the remaining structure follows.

    Forward selection by marginal likelihood with a full refit of every effect that is taken, a backward check, and free
    patterns of the channels as rivals: where a pattern without a name explains clearly more than the whole library, the
    verdict is "unknown".

    Args:
        extra_effects: classes beside the library's. noise: standard deviation per axis [m] stated by the user.
        watch: is told what is done, and which share of the work is.
    """
    library = effect_library()
    library.update({cls.key: cls for cls in extra_effects})
    data = data.in_order
    with _cycles_are_rare():
        found = _diagnosed(model, data, library, noise, watch)
        told = found.final.data.rounded
        if told is None or told == rounded(found.final):
            return found
        # What was missing looked like rounded angles, or hid them.
        return _diagnosed(model, replace(data, rounded=not told), library, noise, watch)


@contextmanager
def _cycles_are_rare() -> Iterator[None]:
    """A search keeps many thousand small objects, which are no garbage: looking for it takes a tenth of the time."""
    often = gc.get_threshold()
    gc.set_threshold(max(often[0], COLLECT), *often[1:])
    try:
        yield
    finally:
        gc.set_threshold(*often)


def _diagnosed(
    model: Model, data: Measurements, library: Mapping[str, type[Effect]], noise: float | None, watch: Watch
) -> Diagnosis:
    watch("the model as it came", 0.0)
    base = fit_model(model, data, noise=noise)
    measured = base.problem.sensitivity.state
    untestable = {k: _why_untestable(c, base) for k, c in library.items() if k not in HIDDEN and c.missing(measured)}
    classes = {k: c for k, c in library.items() if k not in HIDDEN and k not in untestable}
    start = thinned(base, noise)
    state, position = start.problem.sensitivity.state, start.problem.rest.T_base_tcp[:, :3, 3]
    seen = channels(state, position)
    watch("every effect alone", 0.1)
    search = Search(start, classes, patterns(seen, state, position, Sight.of(start.problem.rest)), [])
    first = ranking(search)
    watch("effects one after another", 0.3)
    missing = lines_or_map(search, select_forward(search, first), noise)
    watch("what was found, looked at again", 0.6)
    missing = contested(search, start, check_backward(search, start, missing))
    missing = formed_beside(search, start, missing)
    missing = perhaps_a_map(search, missing, noise)
    watch("all of it on all rows", 0.8)
    named = search.beside([])
    final = named.fit if start is base else refit_all(base, named.fit, [m.candidate for m in missing], noise)
    missing = _steps(missing, final)
    lacking = _lack_of_fit(final)
    # A few numbers for each parameter follow anything.
    suspects = () if too_few(base) and not missing else _suspects(named, search.outside, lacking)
    verdict: Verdict = "unknown" if suspects or lacking else "missing" if missing else "complete"
    blind = {c.key: _why_blind(c) for c in first if c.visible < 5.0} | untestable
    held = {e.key for e in final.model.effects} | {e.key for e in base.model.effects}
    return Diagnosis(
        verdict=verdict,
        base=base,
        final=final,
        told=search.fit if search.outside else final,
        screened=start,
        searched=named.fit,
        missing=tuple(missing),
        candidates=tuple(first),
        untestable=untestable,
        blind={key: why for key, why in blind.items() if key not in held},
        suspects=suspects,
        beside=tuple(search.outside[1:]) if suspects else (),
        floor=final.parts.level,
        bound=smooth_bound(base),
        diagnostics=(*base.data.diagnostics, *data_findings(final)),
    )


def _steps(missing: list[Missing], final: Fit) -> list[Missing]:
    """What is missing with the held-out error of each step on the way (`without`); a map is called what it is at last.

    Args:
        final: with all that is missing.
    """
    some = [m.candidate for m in missing]
    last = [(final.model.effect(c.key), c) for c in some]
    told = [replace(c, label=e.label) if isinstance(e, JointErrorMap) else c for e, c in last]
    fits = [without(final, [c.key for c in some[k:]]) for k in range(1, len(some))]
    steps = zip(missing, told, [*fits, final], strict=False)
    return [replace(m, candidate=c, held_out_after=fit.held_out_rms) for m, c, fit in steps]


def _suspects(named: Search, outside: list[Suspect], lacking: bool) -> tuple[Suspect, ...]:
    """What the remaining structure follows; empty where nothing is clearly above the noise.

    Args:
        named: the search with the named effects alone; outside: the patterns beside them. lacking: whether more is left
            than the noise.
    """
    first = clear(named)
    if not (outside or lacking or first):
        return ()
    if outside and outside[0].pattern not in [s.pattern for s in first[:1]]:
        first = outside[0].seen_by(named.fit.problem, named.fit.linear)
    others = [s for s in named.suspects(named.fit.linear) if not any(s is one for one in first)]
    return tuple(by_channel([*first, *others], outside[1:]))


def _lack_of_fit(fit: Fit) -> bool:
    """Whether more is left than the noise.

    Residual variance against that of the repeats (F test), and by a margin that matters. A few rows that stand out by
    themselves are findings about those rows.
    """
    noise, stated = larger_noise(fit), fit.noise
    if noise.sigma is None or stated.sigma is None or fit.freedom <= 0:
        return False
    from scipy.special import fdtrc

    single = standing_out(fit)
    alone = np.isin(fit.linear.row, single if len(single) <= max(1, len(fit.data) // 20) else [])
    freedom = fit.freedom - int(alone.sum())
    square = fit.variance * fit.freedom - float(np.sum(fit.linear.rest[alone] ** 2))
    ratio = square / max(freedom, 1) * (stated.sigma / noise.sigma) ** 2
    return bool(ratio > 1.5 and fdtrc(freedom, min(noise.dof, MANY), ratio) < 1e-6)


def _why_untestable(cls: type[Effect], fit: Fit) -> str:
    missing = cls.missing(fit.problem.sensitivity.state)
    return f"the table has no {' and no '.join(map(columns_of, missing))}"


def _why_blind(candidate: Candidate) -> str:
    if candidate.visible < 0.05:
        return "these poses do not move it, or the fitted parameters can do exactly the same"
    return f"an effect of ordinary size would stand out by only {candidate.visible:.1f} standard deviations in all"
