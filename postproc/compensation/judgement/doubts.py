"""What makes a correction doubtful: its size, the limits of the joints, targets that were not drawn but taught."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil

import numpy as np

from postproc.channels.state import State
from postproc.compensation.correction.rigid_shift import WORLD, RigidShift
from postproc.compensation.options import Options
from postproc.compensation.path.motion import Motion
from postproc.compensation.plan import CorrectionPlan
from postproc.diagnostics import Diagnostic, Severity, Source, joined
from postproc.model.arm import Model
from postproc.model.doubts import flange_mass
from postproc.model.equilibrium import predict
from postproc.model.uncertainty.prediction import derivatives, parameter_name, read_uncertainty
from postproc.model.uncertainty.undetermined import full_covariance
from postproc.motion.findings import at_move, place
from postproc.motion.timing.jerk_limited import LimitReport, check_limits, join_reports
from postproc.motion.values import Move
from postproc.rapid.syntax.spans import literal
from postproc.robot.arm import Robot
from postproc.robot.pose import pose_error

DOUBTFUL_M = 0.01  # [m]: most arms are off by less, calibrated or not
PENDANT = 2  # decimals [mm] with which a pendant stores a position; zeros at the end are left out
FEWEST_TARGETS = 3  # different targets: of one or two that is chance
LIMIT_KINDS = ("speed", "acceleration", "jerk")
UNSURE = 0.2  # share of a parameter's value that its deviation is, from which the rows hardly tell it
_LONGER = 1.002  # factor on the cycle time worth a word
_SLOW = 3600.0  # [s] that no single motion is meant to take


def doubt_flange_mass(model: Model, motion: Motion) -> list[Diagnostic]:
    """MOD005, an error at the move with the least mass of flange and tool, if that mass is negative.

    It counts what effects of the model add to the mass.
    """
    mass = flange_mass(model, motion.at(motion.samples.goal))
    lightest = int(np.argmin(mass))
    if mass[lightest] >= 0:
        return []
    text = f"with what the model adds, flange and tool weigh {mass[lightest]:.3g} kg: no tool has that"
    help_ = (
        "check the sign of `mass_kg` and `fraction` (`postproc effects show payload_error`), and the program's tooldata"
    )
    return [at_move(motion.moves[lightest], "MOD005", "error", text, help_)]


def doubt_corrections(model: Model, plan: CorrectionPlan) -> list[Diagnostic]:
    """CMP015 at the target with the largest correction: a warning above 10 mm, an error beyond the options' limit.

    It names the effect of the model that contributes most.
    """
    samples = plan.motion.samples
    wanted = samples.T_work_tcp[samples.goal, :3, 3]
    moved = np.linalg.norm(samples.curves.mounts.work(plan.exact.T_base_flange)[:, :3, 3] - wanted, axis=1)
    worst = int(np.argmax(moved))
    allowed = plan.motion.options.largest_correction_m
    if moved[worst] <= min(DOUBTFUL_M, allowed):
        return []
    state = plan.motion.at(samples.goal[[worst]])
    rigid = predict(model.with_effects(), state)[0, :3, 3]
    alone = {e.key: np.linalg.norm(predict(model.with_effects(e), state)[0, :3, 3] - rigid) for e in model.effects}
    key = max(alone, key=lambda k: float(alone[k]))
    severity: Severity = "error" if moved[worst] > allowed else "warning"
    text = (
        f"the model moves this target by {1e3 * moved[worst]:.1f} mm, most of it by `{key}` ({1e3 * alone[key]:.1f} mm)"
    )
    unsure = _unsure_parameter(model, key, state)
    help_ = unsure or "look at the numbers of this effect (rad, m, kg) and at the loads of the program"
    if severity == "error":
        text += f"; more than {1e3 * allowed:g} mm is not written"
        help_ += f"; if it is meant, `--largest-correction {ceil(1e3 * moved[worst])}`"
    finding = at_move(plan.motion.moves[worst], "CMP015", severity, text, help_)
    return [replace(finding, size=1e3 * float(moved[worst]))]


def _unsure_parameter(model: Model, key: str, state: State) -> str:
    """Return what to do about the parameter of an effect that moves the TCP most, if its fit left it open; else "".

    Args:
        key: of the effect; state: one row.
    """
    known, effect = read_uncertainty(model), model.effect(key)
    some = [] if known is None else [k for k, name in enumerate(known.all_parameters) if name[0] == key]
    if known is None or effect is None or not some:
        return ""
    names, x = [known.all_parameters[k] for k in some], effect.vector()
    moved = np.linalg.norm(derivatives(model, state, names)[0][0] * x[[i for _, i in names]], axis=0)
    most = int(np.argmax(moved))
    value, sigma = x[names[most][1]], float(np.sqrt(full_covariance(known)[some[most], some[most]]))
    if sigma < UNSURE * abs(value):
        return ""
    name = parameter_name(model, *names[most])
    return (
        f"`{name}` is {value:.2g} ± {sigma:.1g}: the rows of the fit hardly tell it; state what is known of it under "
        f"`[priors]` of the model, and fit again with `postproc add MODEL {key}`"
    )


def doubt_drawn(shifts: Sequence[RigidShift], moves: Sequence[Move], options: Options) -> list[Diagnostic]:
    """CMP024, a warning, where all targets of work objects are written with two decimals, as a pendant stores them.

    Work objects whose rigid shift is left out, or that calibration routines set, are known to be taught.

    Args:
        shifts: of the work objects, with their moves.
    """
    stated = {name.lower() for name in options.taught}
    jogged: dict[str, list[Move]] = {}
    for shift in shifts:
        of_shift = [moves[i] for i in shift.moves.tolist()]
        if not shift.omitted and shift.wobj.lower() not in stated and _as_stored(of_shift):
            jogged.setdefault(shift.wobj, of_shift)
    if not jogged:
        return []
    names, first = list(jogged), next(iter(jogged.values()))[0]
    text = (
        f"all targets in {joined([f'`{name}`' for name in names])} have the two decimals of a pendant: if they were"
        " jogged onto the work with this arm, they hold its error already, and are corrected twice"
    )
    taught = [name for name in names if name.lower() != WORLD]
    so = f"leave it out: `--wobj-taught {','.join(taught)}`" if taught else "weld with the program as it is"
    help_ = f"if so, {so}; if they were drawn, all is well"
    return [Diagnostic("CMP024", "warning", text, *place(first.event), help_)]


def _as_stored(moves: Sequence[Move]) -> bool:
    """Whether the targets of moves are numbers with two decimals, and at least ``FEWEST_TARGETS`` of them."""
    written = set[tuple[str, tuple[int, int]]]()
    for move in moves:
        spans = move.event.target_origin.base.spans
        match = None if spans is None else literal(spans.source.data, *spans.span)
        if spans is None or match is None:
            return False
        # Decimals of x, y and z as they are written, without zeros at the end.
        fractions = [number.partition(b".")[2] for number in match.group(1, 2, 3)]
        if max((len(f.rstrip(b"0")) for f in fractions if f.isdigit()), default=0) != PENDANT:
            return False
        written.add((spans.source.path, spans.span))
    return len(written) >= FEWEST_TARGETS


def check_corrected(robot: Robot, plan: CorrectionPlan, source: Source) -> tuple[LimitReport, list[Diagnostic]]:
    """Use of the speed, acceleration and jerk limits by the corrected joint motion, timed like the programmed one.

    Returns:
        The report; CMP025 (warning) at the slowest motion if it takes more than an hour as it is programmed, and CMP012
        (info) if the motion has to take longer by more than 0.2 %.
    """
    samples, timeline = plan.motion.samples, plan.motion.timeline
    shift = plan.exact.q - samples.q
    for t in plan.transitions:
        rows = np.arange(samples.start[t.move], samples.goal[t.move] + 1)
        wanted = samples.T_work_tcp[rows]
        joints_by_shift = samples.mounts_at(rows).joints_by_shift(robot, samples.q[rows], wanted)
        shift[rows] = (joints_by_shift @ pose_error(wanted, plan.curve[rows])[:, :, None])[:, :, 0]
    place, first = np.unique(samples.move + samples.u, return_index=True)
    reports = []
    for part, profile in timeline.legs:
        shifts = [np.interp(timeline.place[part], place, column[first]) for column in shift.T]
        reports.append(check_limits(robot, profile, timeline.q[part] + np.stack(shifts, axis=1)))
    report = join_reports(reports)
    slow = _slowest(plan)
    if report.slower <= _LONGER * report.cycle_time:
        return report, slow
    kind, joint = np.unravel_index(int(np.argmax(report.use)), report.use.shape)
    text = (
        f"the corrected motion asks for {100 * report.use.max():.0f} % of the {LIMIT_KINDS[kind]} "
        f"limit of joint {joint + 1}:"
        f" the controller will slow down, by at most {report.slower - report.cycle_time:.1f} s over the program"
    )
    return report, [*slow, Diagnostic("CMP012", "info", text, source)]


def _slowest(plan: CorrectionPlan) -> list[Diagnostic]:
    """CMP025, a warning, at the motion that takes longest as it is programmed, if that is more than an hour."""
    motion, samples = plan.motion, plan.motion.samples
    ends = motion.timeline.at(motion.timeline.t, np.stack([motion.place[samples.start], motion.place[samples.goal]]))
    taken = ends[1] - ends[0]
    slowest = int(np.argmax(taken))
    if taken[slowest] <= _SLOW:
        return []
    move = plan.motion.moves[slowest]
    text = f"this motion alone takes more than an hour, programmed at {1e3 * move.speed:g} mm/s"
    help_ = "check its speeddata, all four numbers of it: the cycle time of the program counts it"
    return [at_move(move, "CMP025", "warning", text, help_)]
