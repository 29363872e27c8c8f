"""What a diagnosis found: the verdict, the fits and figures behind it, and what became of levels held out."""

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
BETTER = 0.98
"""Share of the error without an effect below which a level is predicted better with it."""


@dataclass(frozen=True)
class Level:
    """One level that was held out.

    Args:
        name: the level; rows: how many it has. before, after: rms of what was observed there, predicted by a fit
            without these rows [m], [rad] of angles: of the model as it came, and with all that was found.
        without: the same with all but one of the effects that were found, by its key. untold: effects of which the
            other levels determine nothing.
    """

    name: str
    rows: int
    before: float
    after: float
    without: Mapping[str, float]
    untold: tuple[str, ...] = ()

    def carries(self, key: str) -> bool | None:
        """Return whether an effect lowers the error of this level by over 2 %; None if other levels leave it open."""
        return None if key in self.untold else self.after < BETTER * self.without[key]


@dataclass(frozen=True)
class Intervention:
    """What was found, asked for each level of one channel that no fit has seen."""

    channel: str
    levels: tuple[Level, ...]
    unit: str

    def fails(self, key: str) -> list[str]:
        """Return the names of the levels that an effect, by its key, does not predict better."""
        return [level.name for level in self.levels if level.carries(key) is False]


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
        lacking: whether more is left than the noise, None where nothing tells how large that is.
        floor: noise per axis [m], None where nothing tells it; bound: held-out rms that any function of the channels
            reaches [m].
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
    hold_out: Intervention | None = None
    diagnostics: tuple[Diagnostic, ...] = field(default=(), repr=False)

    @cached_property
    def unnamed(self) -> float | None:
        """Held-out rms [m], [rad] of the searched rows with the remaining patterns fitted as well; None without any."""
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
        """Whether held-out rows are predicted worse with the remaining patterns than without them."""
        return self.unnamed is not None and self.unnamed > self.searched.held_out_rms


def suspect_size(fit: Fit, suspect: Suspect) -> Array:
    """Return (m,) sizes of a suspect that fit the residual best, beside all parameters of the fit."""
    columns = fit.linear.project(suspect.columns(fit.problem))
    return np.asarray(np.linalg.lstsq(columns, fit.linear.rest, rcond=None)[0])


def too_few(fit: Fit) -> bool:
    """Return whether there are fewer than three measured numbers per parameter: a fit then hides what is missing."""
    return fit.freedom < 2 * len(fit.parameters)
