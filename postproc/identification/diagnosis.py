"""What a diagnosis found: the verdict, and the fits and figures behind it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic
from postproc.estimation.fitted import Fit
from postproc.estimation.held_out import contiguous_blocks, hold_out
from postproc.identification.screen.candidate import Candidate
from postproc.identification.screen.suspects import Suspect
from postproc.measure.errors import rms

Verdict = Literal["complete", "missing", "unknown"]


@dataclass(frozen=True)
class Diagnosis:
    """What a model lacks on measurements, with the fits behind it.

    Args:
        base: the model as it came, fitted again; final: with the missing effects.
        model: the fit that gives the parameters of what is missing: final, or with the curves that remain.
        screened, searched: base and final on the rows that were searched, every k-th pose of many.
        missing: effects in the order of selection; candidates: every effect of the library on the base, best first.
        untestable: effects whose channels the data lacks, with the reason; blind: those that it could not have shown.
        remaining: curves that the remaining structure follows; further: others, once the first is in the model.
        exceeds_noise: whether more remains than the noise, None where the noise is not known.
        floor: noise per axis [m], None where it is not known; bound: held-out rms that any smooth function of the
            channels reaches [m].
    """

    verdict: Verdict
    base: Fit
    final: Fit
    model: Fit
    screened: Fit
    searched: Fit
    missing: tuple[Candidate, ...]
    candidates: tuple[Candidate, ...]
    untestable: Mapping[str, str]
    blind: Mapping[str, str]
    remaining: tuple[Suspect, ...]
    further: tuple[Suspect, ...]
    exceeds_noise: bool | None
    floor: float | None
    bound: float
    diagnostics: tuple[Diagnostic, ...] = field(default=(), repr=False)

    @cached_property
    def unnamed(self) -> float | None:
        """Rms [m], [rad] of the searched rows with the suspected patterns, their numbers held out; None without any.

        Their form was chosen on all these rows: new rows are predicted no better, and often worse.
        """
        if not self.remaining:
            return None
        fit = self.searched
        columns = [s.columns(fit.problem) for s in (self.remaining[0], *self.further)]
        known = fit.linear.extended(np.hstack(columns))
        out = hold_out(known.residual, known.nuisance, contiguous_blocks(fit.data.repeats)[known.row])
        return rms(fit.problem.weights.measured(out)[:, fit.observed.columns])

    @property
    def untold(self) -> bool:
        """Whether nothing was found and the noise is not known, so that the residual may be noise or not."""
        return self.exceeds_noise is None and not self.missing and not self.remaining

    @property
    def misleading(self) -> bool:
        """Whether held-out rows are predicted worse with the suspected patterns than without them."""
        return self.unnamed is not None and self.unnamed > self.searched.held_out_rms


def suspect_size(fit: Fit, suspect: Suspect) -> Array:
    """Return the (m,) sizes of a suspect that best fit the residual, beside all parameters of the fit."""
    columns = fit.linear.project(suspect.columns(fit.problem))
    return np.asarray(np.linalg.lstsq(columns, fit.linear.projected_residual, rcond=None)[0])


def law_of_suspect(fit: Fit, suspect: Suspect) -> list[str]:
    """Return a suspect's law in symbols, with the sizes that best fit the residual."""
    return list(suspect.effect(fit.problem.site, suspect_size(fit, suspect)).symbols())


def too_few(fit: Fit) -> bool:
    """Return whether there are fewer than three measured numbers per parameter: a fit then hides what is missing."""
    return fit.freedom < 2 * len(fit.parameters)
