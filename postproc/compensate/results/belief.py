"""Corrections too large to be believed: a model in other units, or of another arm."""

from __future__ import annotations

import numpy as np

from postproc.compensate.plan import Plan
from postproc.diagnostics import Diagnostic, Severity
from postproc.model.arm import Model
from postproc.model.doubts import flange_mass
from postproc.model.equilibrium import predict
from postproc.motion.findings import at_move

# [m]: industrial arms are off by a few millimetres where they are neither calibrated nor loaded beyond what they carry.
DOUBTFUL, IMPOSSIBLE = 0.01, 0.05


def doubt_weights(model: Model, plan: Plan) -> list[Diagnostic]:
    """MOD005 at the move on which flange and tool weigh least, where that is less than nothing."""
    samples = plan.motion.samples
    mass = flange_mass(model, plan.motion.at(samples.goal))
    lightest = int(np.argmin(mass))
    if mass[lightest] >= 0:
        return []
    text = f"with what the model adds, flange and tool weigh {mass[lightest]:.3g} kg: no tool has that"
    help_ = (
        "check the sign of `mass_kg` and `fraction` (`postproc effects show payload_error`), and the program's tooldata"
    )
    return [at_move(plan.motion.moves[lightest], "MOD005", "error", text, help_)]


def doubt_corrections(model: Model, plan: Plan) -> list[Diagnostic]:
    """CMP015 at the target with the largest correction: a warning above 10 mm, an error above 50 mm.

    It names the effect that does most of it.

    """
    samples = plan.motion.samples
    wanted = samples.T_work_tcp[samples.goal, :3, 3]
    moved = np.linalg.norm(samples.curves.mounts.work(plan.exact.T_base_flange)[:, :3, 3] - wanted, axis=1)
    worst = int(np.argmax(moved))
    if moved[worst] <= DOUBTFUL:
        return []
    state = plan.motion.at(samples.goal[[worst]])
    rigid = predict(model.with_effects(), state)[0, :3, 3]
    alone = {e.key: np.linalg.norm(predict(model.with_effects(e), state)[0, :3, 3] - rigid) for e in model.effects}
    key = max(alone, key=lambda k: float(alone[k]))
    severity: Severity = "error" if moved[worst] > IMPOSSIBLE else "warning"
    text = (
        f"the model moves this target by {1e3 * moved[worst]:.1f} mm, most of it by `{key}` ({1e3 * alone[key]:.1f} mm)"
    )
    help_ = "no arm is that far off: look at the numbers of this effect (rad, m, kg) and at the loads of the program"
    return [at_move(plan.motion.moves[worst], "CMP015", severity, text, help_)]
