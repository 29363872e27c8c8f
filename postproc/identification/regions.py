"""Regions of the joint space left out one after another, what was chosen by the rows chosen anew without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from postproc.effects.roles import Role
from postproc.estimation.fitted import Fit
from postproc.estimation.least_squares import fit_model
from postproc.estimation.linear import Linear
from postproc.estimation.solving.settle import settled
from postproc.estimation.solving.solve import ROUGHLY, Terms
from postproc.estimation.validation.lacking import lacking_field
from postproc.estimation.validation.regions import HeldOutRegion, judged_by_regions, parts_of_range
from postproc.identification.curves.families import curve_forms
from postproc.identification.search import with_curves_anew
from postproc.identification.state import SearchState
from postproc.model.ordered import with_ordered_channels

FIXED_REGIONS, SEARCHED_REGIONS = 12, 4
"""Regions that are left out at most: of a fit whose form is fixed, and where curves are searched anew each time."""
NUMBERS_SEARCHED = 900
"""Measured numbers that are searched anew at most: the search is repeated for every region."""


def with_regions(fit: Fit, before: Fit, searched: int = 0) -> Fit:
    """Return a fit with what it is worth in regions that neither its parameters nor its choice of curves came from.

    What predicts them worse than the fit before holds near the measured rows alone. The fit is returned as it is where
    there are too few rows (`lacking_field`). Laws that follow the rows' order are judged by quarters of the table.

    Args:
        before: the fit without what was added.
        searched: how many of its curves were searched on these rows: as many are searched anew without each region.
    """
    lacking = lacking_field(before)
    if lacking is None:
        return fit
    state, regions = fit.data.state, []
    ordered = any(e.ordered_channels for e in fit.model.effects)
    if ordered:
        # What follows the rows' order needs the rows before it.
        parts = np.arange(len(state)) * SEARCHED_REGIONS // len(state)
        masks = [parts == part for part in range(SEARCHED_REGIONS)]
    else:
        masks = parts_of_range(lacking[0], state, SEARCHED_REGIONS if searched else FIXED_REGIONS)
    for mask in masks:
        after = (before, _chosen_anew(before, mask, ordered, searched)) if searched else (fit, fit.linear)
        regions.append(HeldOutRegion.of(before, after, mask, fit.variance))
    result = judged_by_regions(fit, lacking, regions)
    if searched and not result.helps:
        result = replace(result, surest=settled(before).model)
    return replace(fit, regions=result)


def _chosen_anew(before: Fit, region: NDArray[np.bool_], ordered: bool, most: int) -> Linear:
    """Return a fit to all rows, beside whose parameters stand curves that were searched without some of the rows.

    Args:
        before: the fit without curves; region: (n,) mask of the rows that the search does not see.
        ordered: whether something follows the order of the rows, so that none may be left out between others.
        most: how many curves are searched.
    """
    kept = ~region
    if not ordered:
        kept &= before.problem.subsample(NUMBERS_SEARCHED)
    kept[list(before.excluded)] = False
    terms = Terms(before.free, before.strength, closely=ROUGHLY)
    fit = fit_model(before.model, before.data.rows(kept), noise=before.noise.stated, terms=terms)
    forms = curve_forms(fit.problem.sensitivity.state, fit.problem.site)
    curve = with_curves_anew(SearchState(fit, fit, {}, forms), most).fit.model.in_role(Role.CURVE)
    if curve is None:
        return before.linear
    problem = before.problem
    if curve.ordered_channels:
        state = with_ordered_channels(problem.model, problem.data.state, [curve])
        problem = replace(problem, data=replace(problem.data, state=state))
    return before.linear.extended(problem.columns(curve, curve.amplitudes()))
