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
from postproc.identification.candidates.candidate import Candidate
from postproc.measure.errors import rms
from postproc.patterns.suspects import Suspect

Verdict = Literal["complete", "missing", "unknown"]


@dataclass(frozen=True)
class Diagnosis:
    """What a model lacks on measurements, with the fits behind it.

    Args:
        base: the model as it came, fitted again; final: with the missing effects.
        told: the fit that gives the parameters of what is missing: final, or with the patterns beside it.
        screened, searched: base and final on the rows that were searched, every k-th pose of many.
        missing: effects in the order of selection; candidates: every effect of the library on the base, best first.
        untestable: effects whose channels the data lacks, with the reason; blind: those that it could not have shown.
        suspects: patterns that the remaining structure follows; beside: further ones, found once the first is taken.
        lacking: whether more is left than the noise, None where the noise is not known.
        floor: noise per axis [m], None where it is not known; bound: held-out rms that any smooth function of the
            channels reaches [m].
    """

    verdict: Verdict
    base: Fit
    final: Fit
    told: Fit
    screened: Fit
    searched: Fit
    missing: tuple[Candidate, ...]
    candidates: tuple[Candidate, ...]
    untestable: Mapping[str, str]
    blind: Mapping[str, str]
    suspects: tuple[Suspect, ...]
    beside: tuple[Suspect, ...]
    lacking: bool | None
    floor: float | None
    bound: float
    diagnostics: tuple[Diagnostic, ...] = field(default=(), repr=False)

    @cached_property
    def unnamed(self) -> float | None:
        """Rms [m], [rad] of the searched rows with the suspected patterns, their numbers held out; None without any.

        Their form was chosen on all these rows: new rows are predicted no better, and often worse.
        """
        if not self.suspects:
            return None
        fit = self.searched
        told = [s.columns(fit.problem) for s in (self.suspects[0], *self.beside)]
        known = fit.linear.extended(np.hstack(told))
        out = hold_out(known.residual, known.nuisance, contiguous_blocks(fit.data.repeats)[known.row])
        return rms(fit.problem.weights.measured(out)[:, fit.observed.columns])

    @property
    def untold(self) -> bool:
        """Whether nothing was found and the noise is not known, so that the residual may be noise or not."""
        return self.lacking is None and not self.missing and not self.suspects

    @property
    def misleading(self) -> bool:
        """Whether held-out rows are predicted worse with the suspected patterns than without them."""
        return self.unnamed is not None and self.unnamed > self.searched.held_out_rms


def suspect_size(fit: Fit, suspect: Suspect) -> Array:
    """Return the (m,) sizes of a suspect that best fit the residual, beside all parameters of the fit."""
    columns = fit.linear.project(suspect.columns(fit.problem))
    return np.asarray(np.linalg.lstsq(columns, fit.linear.projected_residual, rcond=None)[0])


def too_few(fit: Fit) -> bool:
    """Return whether there are fewer than three measured numbers per parameter: a fit then hides what is missing."""
    return fit.freedom < 2 * len(fit.parameters)
