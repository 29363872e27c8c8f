"""What a diagnosis found: the verdict with the fits behind it, and whether a fit leaves more than the noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic
from postproc.effects.roles import Role
from postproc.estimation.findings import larger_noise, outlying_rows
from postproc.estimation.fitted import Fit
from postproc.estimation.problem import weighed_by
from postproc.estimation.validation.regions import Regions
from postproc.identification.screen.candidate import Candidate
from postproc.identification.screen.suspects import Suspect
from postproc.measure.checks.repeats import scatters
from postproc.measure.errors import CHANCE, chance_of_excess
from postproc.measure.kinds.observed import kind_of

Verdict = Literal["complete", "missing", "unknown"]


MATTERING_RATIO = 1.5
"""Residual variance over that of the noise below which nobody would notice that more is left."""
FEWEST_DEGREES = 3
"""Degrees of freedom of a scatter that is looked at: what few of them say, F allows for."""


def lacks_fit(fit: Fit) -> bool | None:
    """Return whether a fit leaves more than the noise; None where the noise is not known.

    The scatter of repeats in one visit, and that of all repeats, do not depend on the model; the latter contains drift
    as well, so that the noise is at most that. The residual variance is tested against each of them (F test, and a
    margin that matters); a noise stated by the user counts in their place, unless repeats scatter more. Without repeats
    or a stated noise, what is left is within the noise where it is no more than the instrument and the arm's data sheet
    say; where it is more, it counts as more than noise only if both are known.
    """
    if fit.freedom <= 0:
        return None
    stated = larger_noise(fit)
    if fit.noise.origin == "user":
        known = [(float(stated.sigma or 0.0), stated.dof)]
    else:
        rounding = fit.noise.rounding
        some = scatters(fit.data, fit.observed_error, fit.model.robot)
        some = [(square, dof) for square, dof in some if dof >= FEWEST_DEGREES and square > 0]
        known = [(float(np.hypot(np.sqrt(square), rounding)), dof) for square, dof in some]
    if known:
        return any(_exceeds(fit, sigma, dof, CHANCE / len(known)) for sigma, dof in known)
    # RP of ISO 9283 is a distance in space: over the root of 3 it bounds the deviation per axis, of worn arms, too.
    instrument, stated_rp = fit.noise.instrument, fit.model.robot.repeatability
    arm = None if stated_rp is None or fit.observed.name != "position" else stated_rp / np.sqrt(3)
    most = float(np.hypot(instrument or 0.0, arm or 0.0))
    if most > 0 and not _exceeds(fit, most, np.inf, CHANCE):
        return False
    return None if instrument is None or arm is None else True


def _exceeds(fit: Fit, sigma: float, dof: float, chance: float) -> bool:
    """Return whether the residual variance is significantly above that of a noise; a few rows far off are left out.

    Args:
        sigma: of the noise [m], [rad]; dof: degrees of freedom from which it is known.
        chance: probability of a false alarm.
    """
    single = outlying_rows(fit)
    alone = np.isin(fit.linear.row, single if len(single) <= max(1, len(fit.data) // 20) else [])
    freedom = max(fit.freedom - int(alone.sum()), 1.0)
    square = fit.variance * fit.freedom - float(np.sum(fit.linear.projected_residual[alone] ** 2))
    ratio = square / freedom * (weighed_by(fit.noise) / sigma) ** 2
    return bool(ratio > MATTERING_RATIO and chance_of_excess(ratio, freedom, dof) < chance)


@dataclass(frozen=True)
class Diagnosis:
    """What a model lacks on measurements, with the fits behind it.

    Args:
        base: the model as it came, fitted again; final: with the missing effects; both settled with their priors.
        model: the fit that gives the parameters of what is missing: final, or with the curves that remain.
        screened, searched: base and final on the rows that were searched, every k-th pose of many.
        missing: effects in the order of selection; candidates: every effect of the library on the base, best first.
        untestable: effects whose channels the data lacks, with the reason; blind: those that it could not have shown.
        remaining: curves that the remaining structure follows; further: others, once the first is in the model.
        exceeds_noise: whether more remains than the noise, None where the noise is not known.
        floor: noise per axis [m], None where it is not known; bound: held-out rms that smooth functions of the
            channels reach without physics [m].
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

    @property
    def untold(self) -> bool:
        """Whether nothing was found and the noise is not known, so that the residual may be noise or not."""
        return self.exceeds_noise is None and not self.missing and not self.remaining

    @property
    def regions(self) -> Regions | None:
        """What the curves that remain are worth in regions that their search has not seen; None without such curves."""
        return self.model.regions

    @property
    def misleading(self) -> bool:
        """Whether curves remain that rows which their search has not seen do not confirm."""
        return bool(self.remaining) and (self.regions is None or not self.regions.helps)


def suspect_size(fit: Fit, suspect: Suspect) -> Array:
    """Return the (m,) sizes of a suspect that best fit the residual, beside all parameters of the fit."""
    columns = fit.linear.project(suspect.columns(fit.problem))
    return np.asarray(np.linalg.lstsq(columns, fit.linear.projected_residual, rcond=None)[0])


def law_of_suspect(fit: Fit, suspect: Suspect) -> list[str]:
    """Return a suspect's law in symbols, with the sizes that best fit the residual."""
    return list(suspect.effect(fit.problem.site, suspect_size(fit, suspect)).symbols())


@dataclass(frozen=True)
class Shortage:
    """What a table lacks before it could show that something is missing.

    Args:
        parameters: that are fitted, without the unknowns of set-ups.
        count: of further measurements. kind: of set-up that most rows have (`ReadingKind.column`), empty for poses.
        item: what is to be measured, in the plural.
    """

    parameters: int
    count: int
    kind: str = ""
    item: str = "poses"


def shortage(fit: Fit) -> Shortage | None:
    """Return what is lacking where there are fewer than three measured numbers per parameter; else None.

    A fit then hides what is missing. The unknowns of set-ups are no parameters, and take as many numbers: of a gauge
    every set-up has a zero of its own. Readings of one state that are repeated are one number.
    """
    parameters = sum(not ((e := fit.model.effect(key)) and e.role is Role.SETUPS) for key, _ in fit.parameters)
    state = fit.data.state
    read = np.zeros(0, dtype=int) if fit.data.readings is None else fit.data.repeats[np.asarray(state.setup) >= 0]
    again = len(read) - len(np.unique(read))
    if fit.freedom - again >= 2 * parameters:
        return None
    lacking = max(3 * parameters - (len(fit.problem.residual) - again - len(fit.parameters) + parameters), 1)
    kinds = [kind_of(name) for name in state.setup_of_rows.tolist() if name]
    if not kinds:
        return Shortage(parameters, int(np.ceil(lacking / 3)))
    kind = max(kinds, key=kinds.count)
    return Shortage(parameters, int(np.ceil(lacking / kind.each)), kind.column, kind.item)
