"""A fit as JSON, and what a user should know of it before relying on it."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from postproc.diagnostics import Diagnostic
from postproc.effects.roles import Role
from postproc.estimation.errors import mm
from postproc.estimation.fitted import Fit
from postproc.estimation.recorded import left_of_pose
from postproc.estimation.unseen import unseen
from postproc.estimation.words.findings import one_path, some_of_many, too_loud
from postproc.measure.observations import Observation

SCARCE = 3.0
"""So many times the error on a fit's own rows that on others may be before poses are too few."""


class HasErrors(Protocol):
    """What has an error on its rows and on rows that it has not seen."""

    @property
    def rms(self) -> float: ...
    @property
    def held_out_rms(self) -> float: ...
    @property
    def observed(self) -> Observation: ...


def cautions(fit: Fit) -> list[Diagnostic]:
    """What a user should know of a fit before relying on it: DAT016, DAT021, DAT026, DAT027, DAT032 and DAT037."""
    return [*some_of_many(fit.data), *_unread(fit), *_scarce(fit), *_unphysical(fit), *too_loud(fit), *one_path(fit)]


def _unread(fit: Fit) -> list[Diagnostic]:
    """DAT021 where an effect of the model reads a channel that was not measured: nothing of it can be fitted."""
    found = []
    for effect in fit.model.effects:
        missing = effect.missing(fit.problem.sensitivity.state)
        if missing:
            message = f"`{effect.key}` reads {', '.join(missing)}: the measurements have no such column, it is held"
            help_ = "measure with that channel, or leave the effect out"
            found.append(Diagnostic("DAT021", "warning", message, fit.data.source, help=help_))
    return found


def _scarce(fit: Fit) -> list[Diagnostic]:
    """DAT016 where the fit is far better on its own rows than on others: it took on what it cannot know."""
    poses = int(fit.data.repeats.max()) + 1
    if fit.held_out_rms < SCARCE * fit.rms or not fit.parameters:
        return []
    unit = fit.observed.unit
    message = (
        f"{poses} poses tell too little for {len(fit.parameters)} parameters: the error is {mm(fit.rms):.3f} {unit} on "
        f"rows of the fit, {mm(fit.held_out_rms):.3f} {unit} on rows that it has not seen"
    )
    help_ = "measure more poses (`postproc plan` says which), or fit fewer effects"
    return [Diagnostic("DAT016", "warning", message, fit.data.source, help=help_)]


def _unphysical(fit: Fit) -> list[Diagnostic]:
    """DAT026 where the fit makes joints yield against their load, by more than the interval."""
    effect = fit.model.in_role(Role.JOINT_SPRINGS)
    if effect is None:
        return []
    x, width = effect.vector().copy(), fit.intervals[effect.key]
    for j in (i for key, i in fit.at_bound if key == effect.key):
        # What stopped at a bound is judged by where it would have gone.
        alone = np.arange(len(x)) == j
        column = fit.linear.project(fit.problem.slopes(effect, alone))
        told = float(np.sum(column**2))
        x[j] += float(column[:, 0] @ fit.linear.residual) / max(told, 1e-300)
        width[j] = 1.96 * np.sqrt(fit.variance / max(told, 1e-300))
    sure = np.nan_to_num(width, nan=np.inf)
    joints = [str(j + 1) for j in np.flatnonzero(x + sure < 0)]
    if not joints:
        return []
    which = f"joint {joints[0]}" if len(joints) == 1 else f"joints {', '.join(joints[:-1])} and {joints[-1]}"
    message = f"the fitted compliance of {which} is negative: no gear yields against its load"
    help_ = "a load is missing that works against gravity there (balancer, arm load, payload): ask `postproc diagnose`"
    if len(joints) > 1 and not (x > sure).any():
        help_ = "gravity pulls the other way: where the arm hangs, `postproc fit --mounting 180,0,0` says so"
    return [Diagnostic("DAT026", "warning", message, fit.data.source, help=help_)]


def fit_json(fit: Fit, before: dict[str, Any] | None = None) -> dict[str, Any]:
    """``postproc/fit/1``; its figures are those of what was observed, and their keys end in its unit."""
    return {
        "schema": "postproc/fit/1",
        "observed": fit.observed.name,
        **figures_json(fit),
        **({"rms_3d_mm": mm(fit.rms * np.sqrt(3))} if fit.observed.name == "position" else {}),
        **noise_json(fit),
        "rows": len(fit.data) + len(fit.data.wrong),
        "set_aside_rows": [row for _, row in fit.left_out],
        **({"set_aside_files": [fit.data.sources[file].path for file, _ in fit.left_out]} if fit.data.file else {}),
        "before": before,
        "parameters": {e.key: parameters_json(fit, e.key) for e in fit.model.effects},
        "structure": {e.key: structure_json(fit, e.key) for e in fit.model.effects if e.structures()},
        "not_identifiable": not_identifiable(fit),
        "at_bound": [parameter_name(fit, key, i) for key, i in fit.at_bound],
        "unexplained_mm": mm(left_of_pose(fit)),
        "diagnostics": [d.as_json() for d in (*fit.data.diagnostics, *cautions(fit))],
    }


def figures_json(fit: HasErrors) -> dict[str, float]:
    """The errors of a fit on its rows and on rows that it has not seen."""
    key = fit.observed.key
    return {key("rms"): mm(fit.rms), key("held_out_rms"): mm(fit.held_out_rms)}


def noise_json(fit: Fit) -> dict[str, Any]:
    """The noise of one measured number, where it is known from, and what of it is the arm's repeatability."""
    key, noise = fit.observed.key, fit.parts.level
    return {
        key("noise"): None if noise is None else mm(noise),
        key("noise_repeatability"): None if fit.parts.repeatability is None else mm(fit.parts.repeatability),
        "noise_from": fit.parts.origin,
    }


def parameters_json(fit: Fit, key: str) -> dict[str, list[list[float | None]]]:
    """[value, standard deviation] of every parameter of an effect; no deviation where it was not fitted."""
    effect = fit.model.effect(key)
    if effect is None:
        return {}
    known = [fit.sigma.get((key, i)) for i in range(len(effect.vector()))]
    pairs = iter(zip(effect.vector().tolist(), known, strict=True))
    return {n: [list(next(pairs)) for _ in range(int(np.prod(effect.shape(n))))] for n in effect.parameters()}


def structure_json(fit: Fit, key: str) -> dict[str, Any]:
    """What was searched and not fitted of an effect: the joint, the harmonic order, the law."""
    effect = fit.model.effect(key)
    return {} if effect is None else {k: v for k, v in effect.to_file().items() if k in effect.structures()}


def not_identifiable(fit: Fit) -> list[str]:
    """Parameters that this data cannot determine, ``joint_offset.offset_rad[1]``."""
    return [parameter_name(fit, key, i) for key, i in unseen(fit)[0]]


def parameter_name(fit: Fit, key: str, index: int) -> str:
    """A parameter as model files and documents call it, ``joint_offset.offset_rad[1]``."""
    effect = fit.model.effect(key)
    assert effect is not None
    return f"{key}.{effect.names()[index]}"
