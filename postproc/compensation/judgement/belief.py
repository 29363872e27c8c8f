"""Corrections too large to be believed: a model in other units, or of another arm."""

from __future__ import annotations

from dataclasses import replace
from math import ceil

import numpy as np

from postproc.compensation.path.motion import Motion
from postproc.compensation.plan import CorrectionPlan
from postproc.diagnostics import Diagnostic, Severity
from postproc.model.arm import Model
from postproc.model.doubts import flange_mass
from postproc.model.equilibrium import predict
from postproc.motion.findings import at_move

DOUBTFUL_M = 0.01  # [m]: most arms are off by less, calibrated or not


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
    help_ = "look at the numbers of this effect (rad, m, kg) and at the loads of the program"
    if severity == "error":
        text += f"; more than {1e3 * allowed:g} mm is not written"
        help_ += f"; if it is meant, `--largest-correction {ceil(1e3 * moved[worst])}`"
    finding = at_move(plan.motion.moves[worst], "CMP015", severity, text, help_)
    return [replace(finding, length_mm=1e3 * float(moved[worst]))]
