"""Corrections too large to be believed: a model in other units, or of another arm."""

from __future__ import annotations

import numpy as np

from postproc.compensate.plan import Plan
from postproc.diagnostics import Diagnostic, Severity
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.motion.findings import at_move

# [m]: industrial arms are off by a few millimetres where they are neither calibrated nor loaded beyond what they carry.
DOUBTFUL, IMPOSSIBLE = 0.01, 0.05


def doubt_corrections(model: Model, plan: Plan) -> list[Diagnostic]:
    """CMP015 at the target that moves farthest, where no arm is that far off: a warning, from 50 mm on an error."""
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
