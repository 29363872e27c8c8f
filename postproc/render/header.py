"""The comment at the head of a corrected module: what was done to it, and how near it comes."""

from __future__ import annotations

from typing import Any

from postproc import __version__
from postproc.compensate.figures import Figures
from postproc.compensate.options import Options
from postproc.compensate.plan import Plan
from postproc.model.arm import Model


def header_values(model: Model, plan: Plan, figures: Figures, left: int, doubtful: int) -> dict[str, Any]:
    """What ``header.j2`` gets.

    Args:
        left: motion statements that stay as they are; doubtful: corrected ones that also run where nothing is proved.
    """
    beyond = {
        name: f"{1e3 * value:.3f}" if value > plan.motion.options.tolerance_m else ""
        for name, value in (("transient_mm", figures.transient), ("transition_mm", figures.transition))
    }
    return {
        "version": __version__,
        "robot": model.robot.name,
        "effects": ", ".join(e.key for e in model.effects) or "rigid",
        "wrench": _wrench_text(plan.motion.options),
        "before_mm": f"{1e3 * figures.before:.3f}",
        "after_mm": f"{1e3 * figures.after:.3f}",
        **beyond,
        "added": len(plan.insertions),
        "left": left,
        "unproved": doubtful,
    }


def _wrench_text(options: Options) -> str:
    parts = [
        f"{name} {', '.join(f'{x:g}' for x in vector)} {unit}"
        for name, vector, unit in (("force", options.force, "N"), ("moment", options.moment, "N m"))
        if any(vector)
    ]
    where = {"all": "along the whole program", "arc": "while the arc burns"}[options.force_on]
    return f"{'; '.join(parts)}, {where}" if parts else ""
