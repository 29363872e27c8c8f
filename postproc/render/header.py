"""The comment at the head of a corrected module: what was done to it, and how near it comes."""

from __future__ import annotations

from typing import Any

from postproc import __version__
from postproc.compensation.conversion import JudgedProgram
from postproc.compensation.judgement.accuracy import estimated_stiffness
from postproc.compensation.options import Options
from postproc.model.arm import Model
from postproc.numbers import mm


def header_values(model: Model, judged: JudgedProgram) -> dict[str, Any]:
    """The values for the template ``header.j2``.

    Errors in transients and transitions are empty if they are within the tolerance.
    """
    options, figures = judged.options, judged.figures
    tolerance = mm(options.tolerance_m, 5)
    beyond = {
        f"{name}_mm": _mm(size) if mm(size, 5) > tolerance else ""
        for name, size in (("transient", figures.transient), ("transition", figures.transition))
    }
    return {
        "version": __version__,
        "robot": model.robot.name,
        "effects": ", ".join(e.key for e in model.effects) or "rigid",
        "wrench": _wrench_text(options),
        "already": ", ".join(options.already),
        "before_mm": _mm(figures.before),
        "after_mm": _mm(figures.after),
        "arc_before_mm": _mm(figures.arc_before),
        "arc_mm": _mm(figures.arc),
        **beyond,
        "stiffness": estimated_stiffness(judged.remaining, mm(figures.before, 5)),
        "added": judged.added,
        "left": judged.left,
        "run_time": judged.run_time,
        "measured": judged.lines - judged.unmeasured,
        "unmeasured": judged.unmeasured,
        "unproved": judged.unproved,
    }


def _mm(value: float | None) -> str:
    """Metres as millimetres with three decimals; empty for None."""
    return "" if value is None else f"{mm(value, 5):.3f}"


def _wrench_text(options: Options) -> str:
    """Process force and moment of the options as text, with where they act; empty if both are zero."""
    parts = [
        f"{name} {', '.join(f'{x:g}' for x in vector)} {unit}"
        for name, vector, unit in (("force", options.force, "N"), ("moment", options.moment, "N m"))
        if any(vector)
    ]
    where = {"all": "along the whole program", "arc": "while the arc burns"}[options.force_on]
    return f"{'; '.join(parts)}, {where}" if parts else ""
