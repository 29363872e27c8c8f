"""What a diagnosis found: the verdict, and the fits and figures behind it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from postproc.diagnostics import Diagnostic
from postproc.fit.errors import rms
from postproc.fit.fitted import Fit
from postproc.fit.held_out import contiguous_blocks, hold_out
from postproc.identify.candidates.candidate import Candidate
from postproc.identify.levels import Intervention
from postproc.identify.state import SelectedEffect
from postproc.patterns.suspects import Suspect

Verdict = Literal["complete", "missing", "unknown"]


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
    missing: tuple[SelectedEffect, ...]
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
