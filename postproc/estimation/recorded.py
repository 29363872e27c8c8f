"""What is written into a model file: the fitted model with its table [fit], unless the nominal arm is nearer."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import Any

import numpy as np

from postproc import __version__
from postproc.diagnostics import PostprocError
from postproc.effects.roles import FRAME_ROLES, Role
from postproc.estimation.contradictions import contradictions
from postproc.estimation.fitted import Fit
from postproc.estimation.link_mass import link_mass_directions
from postproc.estimation.priors import prior_of
from postproc.estimation.solving.setups import lasting
from postproc.measure.checks.readings import MISMATCH_M
from postproc.measure.consensus import agreement
from postproc.measure.errors import distances
from postproc.measure.kinds.observed import kind_of
from postproc.measure.measurements import FEWEST_ROWS_JUDGED, Measurements
from postproc.model.arm import Model
from postproc.model.uncertainty.prediction import Uncertainty, parameter_name, range_table, uncertainty_table
from postproc.model.uncertainty.scatter import scatter_covariance, scatter_of, spring_covariance
from postproc.numbers import mm

FARTHER, LEAST_M = 1.2, 5e-5
"""So many times as far as the nominal arm, and by so much [m]: least squares trade a little of most rows for a few."""


def recorded_model(fit: Fit) -> Model:
    """Return the fitted model with its table [fit]: data and its hash, figures, covariance, measured range, version."""
    data, after = fit.data, fit.posterior
    model, renamed = lasting(fit.model)
    known = known_errors(fit).renamed("setup", renamed)
    regions = fit.regions
    if regions is not None:
        known = replace(known, beyond=beyond_sigma(fit) or 0.0, measured=regions.field)
    key, noise = fit.observed.key, fit.parts.level
    table: dict[str, Any] = {
        "rows": int(len(data) - len(fit.excluded)),
        **({} if fit.observed.each == "axis" else {"each": fit.observed.each}),
        **({} if data.readings is None else {"kinds": kinds_read(data)}),
        key("rms"): mm(fit.rms),
        "set_aside": [_row_name(fit, *row) for row in fit.excluded_rows],
        **({} if fit.unseen_rms is None else {key("held_out_rms"): mm(fit.unseen_rms)}),
        **({} if fit.unnamed else {"held_out_blocks": fit.held_out_blocks}),
        "version": __version__,
        **uncertainty_table(model, known),
        "undetermined": [parameter_name(fit.model, *name) for name in undetermined(fit)],
        "range": range_table(data.state),
    }
    if against := contradictions(fit):
        table["contradicted"] = [finding.message for finding in against]
    if after.base:
        table["base"] = [parameter_name(model, *name) for name in after.base]
    if fit.parts.repeatability is not None:
        table[key("noise_repeatability")] = mm(fit.parts.repeatability)
    if noise is not None:
        table[key("noise")] = mm(noise)
        table["noise_from"] = fit.parts.origin
    elif fit.observed.unit == "mm":
        # What follows no channel: a measurement scatters by it whatever it is.
        table["noise_mm"] = mm(fit.parts.channel_independent)
        table["noise_from"] = "the residual"
    if data.sources:
        names = [source.path.replace("\\", "/").rsplit("/", 1)[-1] for source in data.sources]
        hashes = [hashlib.sha256(source.data).hexdigest() for source in data.sources]
        table["data"], table["data_sha256"] = (names, hashes) if names[1:] else (names[0], hashes[0])
    if data.touched_programs:
        table["touched_sha256"] = list(data.touched_programs)
    if regions is None or regions.surest is None:
        return replace(model, fit=table)
    surest, added = lasting(regions.surest)[0], model
    table["local"] = [e.key for e in added.effects if surest.effect(e.key) is None]
    table["surest"] = {e.key: [float(f"{x:.12g}") for x in e.vector()] for e in surest.effects}
    return replace(added, fit=table, surest=surest)


def kinds_read(data: Measurements) -> list[str]:
    """Return what the rows of a table read, each once: columns that name set-ups, and ``position`` beside them."""
    positions = ["position"] * bool(np.isfinite(data.position).any())
    return [*dict.fromkeys(kind_of(name).column for name in data.state.setup_names), *positions]


def _row_name(fit: Fit, file: int, row: int) -> str:
    """Return a row as ``cell.csv:12``, or ``12`` where the table has no name."""
    sources = fit.data.sources
    return f"{sources[file].path.replace(chr(92), '/').rsplit('/', 1)[-1]}:{row}" if sources else str(row)


def known_errors(fit: Fit) -> Uncertainty:
    """Return what a fit knows about its own errors near its rows."""
    after = fit.posterior
    return Uncertainty(
        after.names,
        after.covariance,
        pose_error_sigma(fit),
        after.unidentifiable,
        after.directions,
        link_mass_directions(fit),
    )


Share = tuple[float, float]
"""95 % interval of the share of a deflection that remains after a correction."""


def expected_remaining(fit: Fit) -> tuple[tuple[Share, Share], tuple[Share, Share]] | None:
    """Return what remains of the deflection under the loads of rows, and of that by these loads alone (`scatter_of`).

    First after a correction with the stiffness of the arm's type, then with the fitted one: no load on the tool tells
    how heavy the links are. None without joint springs that were fitted, without readings, or where nothing can be
    promised (`contradictions`).
    """
    spring = fit.model.in_role(Role.JOINT_SPRINGS)
    if (
        contradictions(fit)
        or spring is None
        or fit.data.readings is None
        or not np.any(fit.free.get(spring.key, False))
    ):
        return None
    usual = spring.with_vector(prior_of(spring.with_vector(spring.null_vector()), fit.model).value)
    typical = replace(fit.model.with_effects(*(usual if e is spring else e for e in fit.model.effects)), fit={})
    state = fit.data.state
    state = state if fit.data.tool_known else state.with_(T_flange_tcp=fit.model.T_flange_tcp)
    known = scatter_covariance(fit.model, spring_covariance(fit.model, known_errors(fit)))
    deflection, loads = (
        (scatter_of(typical, state, None, links).remaining, scatter_of(fit.model, state, known, links).remaining)
        for links in (True, False)
    )
    return deflection, loads


def pose_error_sigma(fit: Fit) -> float:
    """Return the standard deviation per axis [m] of the model's error of the true position.

    It contains what the residual shows near measured rows. Errors of joint angles and orientations are turned into
    displacements by their lever in the measured poses.
    """
    return _displaced(fit, fit.unexplained)


def beyond_sigma(fit: Fit) -> float | None:
    """Return the deviation per axis [m] of what else the model may leave where no measured row is near, if known."""
    return None if fit.regions is None else _displaced(fit, fit.regions.beyond)


def _displaced(fit: Fit, sigma: float) -> float:
    """Return a standard deviation [m], [rad] of angles, of what was observed as that of the position per axis [m]."""
    if fit.observed.name == "position":
        return sigma
    turns = fit.problem.lever[:, :3, :6] if fit.observed.name == "joint" else np.eye(3)[None]
    return sigma * float(np.sqrt(np.mean(np.sum(turns**2, axis=(1, 2))) / 3))


def undetermined(fit: Fit) -> list[tuple[str, int]]:
    """Return the parameters (effect key, index) that stand at their priors: the rows say less than half of them."""
    names = (*fit.posterior.names, *fit.posterior.unidentifiable)
    return sorted(names[k] for k in fit.posterior.undetermined)


def silent(fit: Fit) -> list[str]:
    """Return the keys of effects that stand at null because the rows say little of any of their parameters.

    They would leave predictions as they are, and make them less sure by what no row could show.
    """
    open_ = set(undetermined(fit))
    names = {*fit.posterior.names, *fit.posterior.unidentifiable}
    keys = []
    for effect in fit.model.effects:
        shown = {(effect.key, i) for i in range(len(effect.vector()))} & names
        null = not np.any(prior_of(effect, fit.model).value - effect.null_vector())
        if null and effect.amplitudes().all() and shown <= open_:
            keys.append(effect.key)
    return keys


def no_farther_than_nominal(fit: Fit) -> None:
    """Raise DAT039 where most rows are clearly farther from a fit than from the nominal arm, DAT009 over 50 mm.

    The medians of the position errors over the rows that agree on where the arm stands are compared: a fit led astray
    by wrong rows is far from most of the others. Nothing is compared for fits without positions, or for a model without
    frames (DAT030 reports that). Where rows do not show how far the nominal arm is, as of one coordinate, 50 mm in
    the median row is too far.

    Raises:
        PostprocError: DAT009, DAT039.
    """
    framed = all(fit.model.in_role(role) is not None for role in FRAME_ROLES)
    if fit.observed.name != "position" or not (framed or fit.data.readings):
        return
    agreed = agreement(fit.data, fit.model.robot)
    if len(agreed.rows) < FEWEST_ROWS_JUDGED or not agreed.near:
        missed = float(np.nanmedian(distances(fit.problem.error[:, :3])))
        if missed > MISMATCH_M:
            message = f"half of the rows lie over {1e3 * missed:.0f} mm from the fitted model: they are not this arm's"
            help_ = "check the robot's name, the unit, and that joints and points belong to the same rows"
            raise PostprocError.of("DAT009", message, fit.data.source, help=help_)
        return
    nominal = float(np.median(np.linalg.norm(agreed.error, axis=1)))
    fitted = float(np.median(distances(fit.problem.error[agreed.rows, :3])))
    if fitted < max(FARTHER * nominal, nominal + LEAST_M):
        return
    message = f"half of the rows lie over {1e3 * fitted:.3f} mm from the fitted model, and {1e3 * nominal:.3f} mm from "
    message += "the nominal arm: the model is worse than none and is not written"
    help_ = "some rows are not what the table says (DAT007, DAT013, DAT025 name the likely ones): correct or "
    help_ += "leave them out"
    raise PostprocError.of("DAT039", message, fit.data.source, help=help_, exit_code=1)
