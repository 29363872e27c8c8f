"""Every effect at its best on what a fit leaves, best first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.estimation.fitted import Fit
from postproc.estimation.solving.solve import ROUGHLY
from postproc.identification.acceptance import fitted_best
from postproc.identification.candidates.candidate import Candidate, Screen
from postproc.identification.candidates.composition import compose
from postproc.identification.candidates.nonlinear import refit_form
from postproc.identification.evidence import NEAR


def ranking(fit: Fit, screen: Screen) -> list[Candidate]:
    """Every testable effect at its best on what a fit leaves, best first.

    Those that a linear problem cannot judge after a full refit, and so all that come near the best.
    """
    linear = fit.linear
    found = [c for key in screen.classes if (c := compose(screen, linear, key)) is not None]
    if not found:
        return []

    def settled(candidate: Candidate) -> Candidate:
        best = fitted_best(fit, screen, candidate, ROUGHLY)
        return replace(candidate, evidence=-np.inf) if best is None else best[0]

    if exceeds_noise(fit):
        least = max(0.0, 0.5 * max(c.evidence for c in found))
        found = [refit_form(screen, linear, c, least) if c.far else c for c in found]
    near = max(0.0, NEAR * max(c.evidence for c in found))
    found = [settled(c) if c.forming and c.evidence > near else c for c in found]
    near = max(0.0, NEAR * max(c.evidence for c in found))
    rivals = [c for c in found if c.evidence > near]
    if len(rivals) > 1:
        found = [settled(c) if c in rivals and c.fit is None else c for c in found]
    return sorted((_nested(c, found) for c in found), key=lambda c: -c.evidence)


def exceeds_noise(fit: Fit) -> bool:
    """Whether more is left than the noise, as far as that is known."""
    rest, freedom = fit.linear.square, fit.linear.freedom
    return fit.noise.sigma is None or rest > freedom + 3 * np.sqrt(2 * max(freedom, 1))


def _nested(candidate: Candidate, found: list[Candidate]) -> Candidate:
    """What stands beside another effect that is missing as well is worth nothing before that one is in.

    Every arm winds up in its joints: what else bends, a model without those springs cannot tell.
    """
    beside = type(candidate.effect).beside
    first = any(c.key == beside and c.evidence > 0 for c in found)
    return replace(candidate, evidence=min(candidate.evidence, 0.0)) if first else candidate
