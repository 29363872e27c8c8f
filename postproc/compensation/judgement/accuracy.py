"""How near the corrected program can be expected to come, from what the fit of the model knows about its own errors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from postproc.channels.state import State
from postproc.compensation.correction.curve import Exact
from postproc.compensation.correction.deviation import away_from_curves
from postproc.compensation.path.motion import Motion
from postproc.diagnostics import Diagnostic, Source
from postproc.model.arm import Model
from postproc.model.controller import unknown_loads
from postproc.model.scatter import remaining_fraction
from postproc.model.uncertainty import beyond_range, sigma_parts
from postproc.model.undetermined import Undetermined, undetermined_under_load
from postproc.motion.values import Index

WITHIN_95 = 2.796  # 95 % of a three-dimensional normal error lie within so many standard deviations per axis
HALF = 0.5
_MOST_TARGETS_JUDGED = 500  # targets that are asked


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Expected position error at the targets [m].

    Args:
        sigma: standard deviation per axis, root mean square over all targets.
        within_95: distance that holds 95 % of the errors, at the worst target.
        parts: standard deviations per axis there by the parameters, and by what no effect explains.
        undetermined: the part of it by parameters that no row determines, None where the rows determine all.
    """

    sigma: float
    within_95: float
    parts: tuple[float, float]
    undetermined: Undetermined | None = None


@dataclass(frozen=True, slots=True)
class Expected:
    """What is expected to remain on the arm once a program is corrected.

    Args:
        accuracy: of a fitted model, else None.
        remaining: lower and upper share of the deflection, where the stiffness is an estimate, else None.
        distance: one figure of both [m]; 0 where nothing is known of the model's errors.
    """

    accuracy: Accuracy | None = None
    remaining: tuple[float, float] | None = None
    distance: float = 0.0


def expect_on_arm(model: Model, motion: Motion, exact: Exact, source: Source) -> tuple[Expected, list[Diagnostic]]:
    """What is expected to remain on the arm, and the findings CMP010 and CMP027 about it.

    The distance is that which holds 95 % of the errors of a fitted model; with an estimated stiffness it is the largest
    deviation where it welds (without welds, along lines and arcs) times the middle share sqrt(low high), a fifth below
    the median of arms of the type. Of both it is the larger.
    """
    accuracy, findings = expect_accuracy(model, motion, source)
    remaining = None
    if model.stiffness_source == "estimated":
        low, high = remaining_fraction(*unknown_loads(model, motion.at(_targets(motion))))
        remaining = round(low, 3), round(high, 3)
    samples, space = motion.samples, ~motion.samples.curves.joint[motion.samples.move]
    lit = space & np.array([move.welding for move in samples.moves])[samples.move]
    rows, wanted = np.flatnonzero(lit if lit.any() else space), motion.wanted
    uncorrected = 2 * wanted.T_work_tcp[rows, :3, 3] - exact.T_work_tcp[rows, :3, 3]  # about where the arm goes
    away, _ = away_from_curves(wanted.curves, samples.move[rows], uncorrected)
    deviation = float(np.linalg.norm(away, axis=1).max(initial=0.0))
    share = 0.0 if remaining is None else math.sqrt(math.prod(remaining))
    distance = max(0.0 if accuracy is None else accuracy.within_95, share * deviation)
    return Expected(accuracy, remaining, distance), [*findings, *doubt_help(remaining, source)]


def doubt_help(remaining: tuple[float, float] | None, source: Source) -> list[Diagnostic]:
    """CMP027, a warning, where as much deflection as without a correction may remain, as the stiffness is estimated.

    Args:
        remaining: as of `Expected`.
    """
    if remaining is None or remaining[1] < 1.0:
        return []
    low, high = (f"{100 * x:.0f}" for x in remaining)
    text = f"the correction may not help: {low} to {high} % of the deflection may remain, as the stiffness is estimated"
    help_ = "measure this arm, and fit a model of it: `postproc plan` chooses the poses"
    return [Diagnostic("CMP027", "warning", text, source, help=help_)]


def estimated_stiffness(remaining: Sequence[float] | None, before_mm: float) -> str:
    """A clause that says how much deflection remains if the stiffness is estimated; empty if it is not.

    Args:
        remaining: as of `Expected`. before_mm: largest deviation of the original program.
    """
    if remaining is None:
        return ""
    low, high = (f"{100 * x:.0f}" for x in remaining)
    least, most = (f"{before_mm * x:.2f}" for x in remaining)
    return (
        f"the stiffness of this arm is estimated: {low} to {high} % of its deflection, {least} to {most} mm, is"
        " expected to remain, and `postproc fit` with measurements narrows that"
    )


def expect_accuracy(model: Model, motion: Motion, source: Source) -> tuple[Accuracy | None, list[Diagnostic]]:
    """Expected accuracy at the targets (None if the model was not fitted), and CMP010 outside the measured range."""
    at_goals = motion.at(_targets(motion))
    text = "the program leaves the range in which the model was measured: "
    help_ = "measure poses there too (`postproc plan`), or take the expected accuracy as a guess"
    findings = [
        Diagnostic("CMP010", "warning", text + b.text, source, help=help_) for b in beyond_range(model, at_goals)
    ]
    findings += _local_effects(model, at_goals, source)
    parts = np.array(sigma_parts(model, at_goals, instrument=False))
    sigma = np.hypot(*parts)
    if np.isnan(sigma).any():
        return None, findings
    undetermined = undetermined_under_load(model, at_goals, WITHIN_95)
    by_parameters, unexplained = parts[:, int(np.argmax(sigma))].tolist()
    within_95 = float(WITHIN_95 * sigma.max())
    return Accuracy(float(np.sqrt(np.mean(sigma**2))), within_95, (by_parameters, unexplained), undetermined), findings


def _local_effects(model: Model, at_goals: State, source: Source) -> Iterator[Diagnostic]:
    """CMP010 where effects that hold near the measured rows alone are left out of the correction by half or more."""
    if model.surest is None or model.measured is None:
        return
    known = model.measured.known(at_goals)
    far = int(np.sum(known < HALF))
    if not far:
        return
    local = " and ".join(f"`{key}`" for key in model.fit.get("local", ()))
    text = (
        f"{local} holds near the measured rows alone, and {far} of {len(known)} targets are away from them: there the "
        f"correction falls back to the rest of the model, by {100 * (1 - known.min()):.0f} % at the farthest"
    )
    help_ = "measure poses there too (`postproc plan`), and `postproc add` it anew"
    yield Diagnostic("CMP010", "warning", text, source, help=help_)


def _targets(motion: Motion) -> Index:
    """Indices of the samples at the targets, evenly reduced to at most 500."""
    rows = motion.samples.goal
    if len(rows) > _MOST_TARGETS_JUDGED:
        rows = rows[np.linspace(0, len(rows) - 1, _MOST_TARGETS_JUDGED).round().astype(int)]
    return rows
