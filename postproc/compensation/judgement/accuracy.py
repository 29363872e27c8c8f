"""How near the corrected program can be expected to come, from what the fit of the model knows about its own errors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import State
from postproc.compensation.correction.curve import Exact
from postproc.compensation.correction.deviation import away_from_curves
from postproc.compensation.judgement.type_scatter import GAUGE_SETUPS, PULL_N, type_scatter
from postproc.compensation.path.motion import Motion
from postproc.diagnostics import Diagnostic, Source
from postproc.model.arm import Model
from postproc.model.controller import unknown_loads
from postproc.model.uncertainty.prediction import beyond_range, position_covariance, read_uncertainty, sigma_parts
from postproc.model.uncertainty.scatter import QUANTILES, Scatter, normal_draws
from postproc.model.uncertainty.undetermined import Undetermined, undetermined_under_load
from postproc.motion.values import Flags
from postproc.numbers import mm, percent_range
from postproc.robot.pose import rpy_degrees

WITHIN_95 = 2.796  # 95 % of a three-dimensional normal error lie within so many standard deviations per axis
HALF = 0.5
TOUCHES = 30  # of a tip, where set-ups of a dial gauge tell too little
WORTH = 0.9  # of the upper share of the deflection: readings that leave more than that of it are not advised
_MOST_TARGETS_JUDGED = 500  # targets that are asked


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Expected position error at the targets [m].

    Args:
        sigma: standard deviation per axis, root mean square over all targets.
        within_95: distance that holds 95 % of the errors, at the worst target.
        at_work: the same at the worst target of those that weld, if any does.
        parts: of ``sigma`` by the parameters, and by what no effect explains; their squares add up to its square.
        interval: 95 % of the errors are between these distances, at the worst target of those that weld, if any does.
        interval_in_air: the same at the worst target of all.
        by_weights: the part of ``within_95`` by the weights of the links, which are estimates for most arms.
        undetermined: the part of it by parameters that no row determines, None where the rows determine all.
        beyond: clauses on channels in which targets leave the measured range, where all of this is a guess.
    """

    sigma: float
    within_95: float
    at_work: float
    parts: tuple[float, float]
    interval: tuple[float, float]
    interval_in_air: tuple[float, float]
    by_weights: float = 0.0
    undetermined: Undetermined | None = None
    beyond: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Expected:
    """What is expected to remain on the arm once a program is corrected.

    Args:
        accuracy: of a fitted model, else None.
        scatter: of arms of the type, where the stiffness is that of the type, else None.
        distance: one figure of both [m]; 0 where nothing is known of the model's errors.
    """

    accuracy: Accuracy | None = None
    scatter: Scatter | None = None
    distance: float = 0.0


def expect_on_arm(model: Model, motion: Motion, exact: Exact, source: Source) -> tuple[Expected, list[Diagnostic]]:
    """What is expected to remain on the arm, and the findings CMP010 and CMP027 about it.

    The distance is that which holds 95 % of the errors of a fitted model; with the stiffness of the type it is the
    largest deviation where it welds (without welds, along lines and arcs) times the middle share sqrt(low high), a
    fifth below the median of arms of the type. Of both it is the larger.
    """
    samples, wanted = motion.samples, motion.wanted
    (at_targets, at_welds), space = judged_targets(motion), ~samples.curves.joint[samples.move]
    scatter = type_scatter(*unknown_loads(model, at_targets))
    fitted = model if scatter is None else without_link_masses(model)  # arms of the type differ in them, too
    accuracy, findings = _expect_accuracy(fitted, at_targets, at_welds, source)
    lit = space & np.array([move.welding for move in samples.moves])[samples.move]
    rows = np.flatnonzero(lit if lit.any() else space)
    uncorrected = 2 * wanted.T_work_tcp[rows, :3, 3] - exact.T_work_tcp[rows, :3, 3]  # about where the arm goes
    away, _ = away_from_curves(wanted.curves, samples.move[rows], uncorrected)
    deviation = float(np.linalg.norm(away, axis=1).max(initial=0.0))
    share = 0.0 if scatter is None else math.sqrt(math.prod(scatter.remaining))
    distance = max(0.0 if accuracy is None else accuracy.within_95, share * deviation)
    if scatter is not None and scatter.remaining[1] >= 1.0:
        text = f"the correction may not help: {percent_range(scatter.remaining)} of the deflection may remain"
        text += ", as the stiffness of this arm is not measured"
        arm = arm_words(model.robot.name, rpy_degrees(model.R_world_base))
        command, _ = _first_plan(arm, scatter.remaining, scatter.after_gauge, scatter.gauge_load)
        help_ = f"measure this arm, and fit a model of it: {command}"
        findings.append(Diagnostic("CMP027", "warning", text, source, help=help_, size=scatter.remaining[1]))
    return Expected(accuracy, scatter, distance), findings


def judged_targets(motion: Motion) -> tuple[State, Flags]:
    """Return states (n,) at the targets of a program, of many some along it, and (n,) which of them weld."""
    targets = motion.samples.goal
    if len(targets) > _MOST_TARGETS_JUDGED:
        targets = targets[np.linspace(0, len(targets) - 1, _MOST_TARGETS_JUDGED).round().astype(int)]
    welding = np.array([move.welding for move in motion.samples.moves])
    return motion.at(targets), welding[motion.samples.move[targets]]


def remaining_deflection(values: Mapping[str, Any]) -> tuple[str, str]:
    """Clauses on the deflection that remains with the stiffness of the type, and on the cheapest way to less; or empty.

    Args:
        values: entries of a document: ``robot``, ``mounting_deg``, ``expected_remaining_fraction``, the same
            ``_after_gauge``, and ``gauge_load_kg``.
    """
    remaining, after = (values.get(f"expected_remaining_fraction{when}") for when in ("", "_after_gauge"))
    if remaining is None:
        return "", ""
    text = "the stiffness of this arm is not measured: with that of its type "
    text += f"{percent_range(remaining)} of its own deflection remain"
    arm = arm_words(values["robot"], values["mounting_deg"])
    command, tells = _first_plan(arm, remaining, after, values["gauge_load_kg"])
    if not tells or after is None:
        return text, f"{command} says what to measure"
    return text, f"six set-ups of a dial gauge leave about {percent_range(after)} of it: {command}"


def arm_words(robot: str, mounting: Iterable[float]) -> str:
    """Return an arm of the library as `plan` takes it: its name, and how its base is mounted where it does not stand.

    Args:
        mounting: roll, pitch, yaw [deg].
    """
    angles = [f"{angle:.6g}" for angle in mounting]
    return robot if set(angles) == {"0"} else f"{robot} --mounting {','.join(angles)}"


def _first_plan(
    arm: str, remaining: Sequence[float], after: Sequence[float] | None, load: float | None
) -> tuple[str, bool]:
    """Return the command that plans what to measure first, and whether set-ups of a dial gauge are worth it.

    Args:
        arm: as `arm_words` has it. remaining, after: share of the deflection before and after such set-ups.
        load: rated payload [kg], None where it is not known.
    """
    if after is None or after[1] > WORTH * remaining[1]:
        return f"`postproc plan {arm} -n {TOUCHES} --kind tip -o tip.csv`", False
    loads = f"--load {load:g} --pull {PULL_N:g}"
    return f"`postproc plan {arm} -n {GAUGE_SETUPS} --kind gauge {loads} -o gauge.csv`", True


def _expect_accuracy(
    model: Model, at_goals: State, welding: Flags, source: Source
) -> tuple[Accuracy | None, list[Diagnostic]]:
    """Expected accuracy at the targets (None if the model was not fitted), and CMP010 outside the measured range.

    Args:
        at_goals: n states at the targets. welding: (n,) whether these weld.
    """
    text = "the program leaves the range in which the model was measured: "
    help_ = "measure poses there too (`postproc plan`), or take the expected accuracy as a guess"
    spans = beyond_range(model, at_goals)
    findings = [Diagnostic("CMP010", "warning", text + s.text, source, help=help_, size=s.share) for s in spans]
    findings += _local_effects(model, at_goals, source)
    parts = np.array(sigma_parts(model, at_goals, instrument=False))
    sigma, known = np.hypot(*parts), read_uncertainty(model)
    if known is None or np.isnan(sigma).any():
        return None, findings
    undetermined = undetermined_under_load(model, at_goals, WITHIN_95)
    most = np.array([np.argmax(sigma)])
    stated, _ = sigma_parts(without_link_masses(model), at_goals.rows(most), instrument=False)
    by_weights = WITHIN_95 * math.sqrt(max(float(parts[0, most[0]] ** 2 - stated[0] ** 2), 0.0))
    by_parameters, unexplained = np.sqrt(np.mean(parts**2, axis=1)).tolist()
    sizes = math.hypot(by_parameters, unexplained), float(WITHIN_95 * sigma.max())
    worst = np.array([np.argmax(np.where(mask, sigma, 0.0)) for mask in (welding | ~welding.any(), True)])
    covariance = position_covariance(model, at_goals.rows(worst), known, instrument=False)
    welding_interval, air_interval = map(length_interval, covariance + parts[1, worst, None, None] ** 2 * np.eye(3))
    at_work, beyond = float(WITHIN_95 * sigma[worst[0]]), tuple(span.text for span in spans)
    parts_of = by_parameters, unexplained
    return Accuracy(
        *sizes, at_work, parts_of, welding_interval, air_interval, by_weights, undetermined, beyond
    ), findings


def length_interval(covariance: Array) -> tuple[float, float]:
    """Return the interval [m] that holds 95 % of the lengths of a normal error with a covariance (3, 3) [m^2]."""
    square = np.maximum(np.linalg.eigvalsh(covariance), 0.0)
    low, high = np.quantile(np.sqrt(normal_draws(3) ** 2 @ square), QUANTILES).tolist()
    return low, high


def on_arm_mm(remaining: float, before: float, shares: tuple[float, float], errors: tuple[float, float]) -> list[float]:
    """Return the 95 % interval of the largest deviation on the arm [mm], both ends sqrt(r^2 + (s d)^2 + e^2).

    Args:
        remaining, before: r of the corrected program and d of the original, in the model [m].
        shares: interval of s, the share of d that the stiffness of the type leaves (`Scatter.of_estimate`).
        errors: interval of e, the error of a fitted model [m].
    """
    return [mm(math.hypot(remaining, s * before, e), 3) for s, e in zip(shares, errors, strict=True)]


def without_link_masses(model: Model) -> Model:
    """Return the model as if the masses of its links were exact."""
    return replace(model, fit={key: value for key, value in model.fit.items() if key != "link_mass"})


def _local_effects(model: Model, at_goals: State, source: Source) -> Iterator[Diagnostic]:
    """CMP010 where effects that hold near the measured rows alone are left out of the correction by half or more."""
    if model.surest is None or model.measured is None:
        return
    known = model.measured.known(at_goals)
    if not (far := int(np.sum(known < HALF))):
        return
    local = " and ".join(f"`{key}`" for key in model.fit.get("local", ()))
    text = f"{local} holds near the measured rows alone, and {far} of {len(known)} targets are away from them: there "
    share = f"{100 * (1 - known.min()):.0f} % of what it adds"
    text += f"the correction falls back to the rest of the model, by {share} at the farthest"
    help_ = "measure poses there too (`postproc plan`), and `postproc add` it anew"
    yield Diagnostic("CMP010", "warning", text, source, help=help_, size=float(1 - known.min()))
