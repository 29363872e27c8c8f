"""What a fit brings to light: rows that stand out, a noise that cannot be, what to know before relying on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from postproc.diagnostics import Diagnostic, joined
from postproc.effects.asking import of_parameters
from postproc.effects.roles import Role
from postproc.effects.similarity import ordinary_sizes
from postproc.estimation.contradictions import unphysical
from postproc.estimation.fitted import Fit
from postproc.estimation.posterior import anywhere
from postproc.estimation.priors import ORDINARY, UNDETERMINED_SHARE, is_placed
from postproc.estimation.recorded import recorded_model
from postproc.measure.checks.repeats import Noise, estimate_noise
from postproc.measure.errors import CHANCE, DOUBTFUL_CHANCE, chance_of_excess, distances
from postproc.measure.measurements import Measurements
from postproc.measure.trajectory import is_record
from postproc.model.arm import Model
from postproc.model.uncertainty.prediction import parameter_name, predict_sigma
from postproc.numbers import mm

SCARCE = 3.0
"""So many times the error where it was measured that elsewhere may be before poses are too few."""
TOO_LOUD, FEW = 5.0, 20
"""No noise is so many times the residual of a fit with so many degrees of freedom."""
FAR = 4.0
"""Ordinary sizes beyond which a value that the rows hardly tell from another is said."""
MOST_ROWS_NAMED = 9
"""Rows that are named after the one that stands out most."""


def data_findings(fit: Fit) -> list[Diagnostic]:
    """Return findings on the data of a fit: an impossible noise, excluded rows, rows far off the fitted model ..

    They are DAT013, DAT014, DAT025, DAT027, DAT032 and DAT037.
    """
    findings = [
        *subsample_findings(fit.data),
        *derived_sides(fit.model, fit.data),
        *impossible_noise(fit),
        *one_path(fit),
    ]
    noise, stated, unit = larger_noise(fit), fit.noise, fit.observed.unit
    if noise is not stated and chance_of_excess(_ratio(noise, stated), noise.dof, np.inf) < DOUBTFUL_CHANCE:
        message = f"the repeats scatter by {1e3 * (noise.sigma or 0):.3f} {unit} per {fit.observed.each}, more than "
        message += f"the stated noise of {1e3 * (stated.sigma or 0):.3f} {unit}"
        findings.append(Diagnostic("DAT027", "warning", message, fit.data.source, help="leave the stated noise out"))
    size = 1e3 * distances(fit.observed_error)
    for i in fit.excluded:
        message = f"{fit.data.name(i)} lies {size[i]:.2f} {unit} from the fitted model, far more than any other"
        message += "; it is left out"
        help_ = "measure the row again; if it repeats, it shows something that the model lacks"
        findings.append(Diagnostic("DAT013", "warning", message, *fit.data.where(i), help_))
    if rows := sorted(outlying_rows(fit).tolist(), key=lambda i: -size[i]):
        message = f"{fit.data.name(rows[0])} lies {size[rows[0]]:.2f} {unit} from the fitted model, more than noise "
        message += "explains"
        if others := [fit.data.name(i) for i in rows[1:]]:
            counted = [f"{len(others) - MOST_ROWS_NAMED} more"] if len(others) > MOST_ROWS_NAMED else []
            message += f"; so do {joined([*others[:MOST_ROWS_NAMED], *counted])}"
        help_ = "measure the row again; it may be a bad reading, or the one that shows a missing effect"
        findings.append(Diagnostic("DAT025", "warning", message, *fit.data.where(rows[0]), help_))
    return findings


def subsample_findings(data: Measurements) -> list[Diagnostic]:
    """Return DAT037 where only some rows of a large table are used for the fit; an empty list otherwise."""
    if not data.sampled_from:
        return []
    message = f"of {data.sampled_from} rows {len(data)} are used, taken from all over the table"
    return [Diagnostic("DAT037", "info", message, data.source, help="so many leave nothing uncertain")]


def derived_sides(model: Model, data: Measurements) -> list[Diagnostic]:
    """Return DAT014 where the model follows sides of approach that no column states; an empty list otherwise."""
    users = [f"`{e.key}`" for e in model.effects if "approach" in e.reads and not e.is_null]
    if not (data.sides_from and users):
        return []
    message = f"{joined(users)} takes the side from which a joint came from the pose before, by {data.sides_from}"
    help_ = "where the arm went elsewhere in between, record the sides in columns dir1 .. dir6"
    return [Diagnostic("DAT014", "info", message, data.source, help=help_)]


def impossible_noise(fit: Fit) -> list[Diagnostic]:
    """Return DAT027 where the stated noise is over five times the residual rms, thus impossible; else an empty list."""
    stated, unit = (fit.noise.sigma if fit.noise.origin == "user" else fit.noise.instrument) or 0.0, fit.observed.unit
    if not stated or fit.freedom < FEW or stated < TOO_LOUD * fit.rms:
        return []
    message = f"the stated noise of {1e3 * stated:.3f} {unit} cannot be: the fit leaves {1e3 * fit.rms:.3f} {unit} per "
    message += f"{fit.observed.each}"
    help_ = f"is it in {'micrometres' if unit == 'mm' else 'another unit'}? It counts in {unit}"
    return [Diagnostic("DAT027", "warning", message, fit.data.source, help=help_)]


def one_path(fit: Fit) -> list[Diagnostic]:
    """Return DAT032 where the fit of a moving arm's record predicts poses off its path over 3 times worse than on it.

    Off the path are random poses inside the range of the measured joint angles. The list is empty otherwise.
    """
    state = fit.data.state
    if not is_record(state) or fit.observed.name != "position":
        return []
    between = anywhere(state, np.nanmin(state.q, axis=0), np.nanmax(state.q, axis=0))
    away = float(np.sqrt(np.mean(predict_sigma(recorded_model(fit), between) ** 2)))
    if away < SCARCE * fit.held_out_rms:
        return []
    message = f"the rows follow one path: elsewhere among their joint angles a prediction is good to {1e3 * away:.2f} "
    message += f"mm per axis, not to the {1e3 * fit.held_out_rms:.3f} mm of rows of this path"
    help_ = "measure single poses all over the workspace (`postproc plan`), or further paths"
    return [Diagnostic("DAT032", "warning", message, fit.data.source, help=help_)]


def larger_noise(fit: Fit) -> Noise:
    """Return the noise of a fit, or that of its repeats where these scatter more than the user's figure."""
    repeats = estimate_noise(fit.data, fit.model.robot, error=fit.observed_error)
    stated = fit.noise.origin == "user" and repeats.origin == "repeats"
    return repeats if stated and _ratio(repeats, fit.noise) > 1 else fit.noise


def _ratio(noise: Noise, stated: Noise) -> float:
    """Return the ratio of the variance of a noise to that of the stated one."""
    return ((noise.sigma or 0.0) / max(stated.sigma or 0.0, 1e-300)) ** 2


def outlying_rows(fit: Fit) -> NDArray[np.int_]:
    """Return the indices of used rows that lie farther off than noise explains.

    This is a chi-square test of each row, corrected for their number.
    """
    from scipy.special import chdtrc

    used = fit.problem.weights.used
    square = fit.problem.squares().sum(axis=1) / max(fit.variance, 1e-300)
    rare = chdtrc(np.maximum(used.sum(axis=1), 1), square) * len(square)
    return np.flatnonzero((rare < CHANCE) & used.any(axis=1))


def cautions(fit: Fit) -> list[Diagnostic]:
    """Return what a user should know before relying on a fit: DAT014, 16, 21, 26, 27, 32, 37 and 53."""
    return [
        *subsample_findings(fit.data),
        *derived_sides(fit.model, fit.data),
        *_unread(fit),
        *_scarce(fit),
        *unphysical(fit),
        *implausible(fit),
        *impossible_noise(fit),
        *one_path(fit),
    ]


def _unread(fit: Fit) -> Iterator[Diagnostic]:
    """Yield DAT021 for every effect that cannot be fitted, since it reads a channel that was not measured."""
    for effect in fit.model.effects:
        missing = effect.missing(fit.problem.sensitivity.state)
        if missing:
            message = f"`{effect.key}` reads {', '.join(missing)}: the measurements have no such column, it is held"
            help_ = "measure with that channel, or leave the effect out"
            yield Diagnostic("DAT021", "warning", message, fit.data.source, help=help_)


def _scarce(fit: Fit) -> list[Diagnostic]:
    """Return DAT016 where the held-out rms is at least three times the rms of the fitted rows: too few poses.

    Of a drafted effect no row is held out. Few readings are fitted with the priors, which hold what they do not tell.
    """
    poses = int(fit.data.repeats.max()) + 1
    if fit.unnamed or fit.problem.few or fit.held_out_rms < SCARCE * fit.rms or not fit.parameters:
        return []
    unit = fit.observed.unit
    message = (
        f"{poses} poses tell too little for {len(fit.parameters)} parameters: the error is {mm(fit.rms):.3f} {unit} on "
    )
    message += f"rows of the fit, {mm(fit.held_out_rms):.3f} {unit} on rows that it has not seen"
    help_ = "measure more poses (`postproc plan` says which), or fit fewer effects"
    return [Diagnostic("DAT016", "warning", message, fit.data.source, help=help_)]


def implausible(fit: Fit) -> list[Diagnostic]:
    """Return DAT053 for each amplitude of many ordinary sizes that rows hardly tell from another parameter.

    It is beyond `FAR` ordinary sizes, and its deviation is not clearly below one of them.
    """
    after = fit.posterior
    names = (*after.names, *after.unidentifiable)
    size = of_parameters(fit.model.effects, names, lambda e: ordinary_sizes(e, fit.model.robot))
    # A tracker's reflector may be anywhere on the tool; where rows have set-ups, the TCP itself is what they touch.
    judged = {e.key for e in fit.model.effects if not is_placed(e) or (fit.problem.few and e.role is Role.TOOL_FRAME)}
    amplitude = of_parameters(fit.model.effects, names, lambda e: e.amplitudes() * float(e.key in judged))
    ordinary = np.array([source == ORDINARY for source in after.sources], dtype=bool) & (amplitude > 0)
    far = (np.abs(after.mean) > FAR * size) & (after.deviations > UNDETERMINED_SHARE * size)
    count, covariance = len(after.names), after.directions.T @ after.directions
    covariance[:count, :count] += after.covariance
    findings, tool = [], getattr(fit.model.in_role(Role.TOOL_FRAME), "key", None)
    for k in np.flatnonzero(ordinary & far).tolist():
        tied = np.abs(covariance[k]) / np.maximum(after.deviations, 1e-300)
        tied[k] = -1.0
        name, other = (parameter_name(fit.model, *names[i]) for i in (k, int(np.argmax(tied))))
        times = f"{abs(after.mean[k]) / size[k]:.0f} times its ordinary size"
        message = f"`{name}` is {after.mean[k]:.2g} ± {after.deviations[k]:.1g}, {times}, and the rows hardly tell it "
        message += f"from `{other}`"
        help_ = f'state what is known of it under `[priors]` of the model, `"{name}" = [0, {size[k]:.1g}, "shop"]`'
        if names[k][0] == tool:
            help_ = "is a reading wrong? Where the TCP is known, state it, `--tool X,Y,Z`"
        findings.append(Diagnostic("DAT053", "warning", message, fit.data.source, help=f"{help_}, and fit again"))
    return findings
