"""The part of a model that holds for a program: not the instrument that measured it, nor a tool that is not mounted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.diagnostics import Diagnostic
from postproc.effects.base import Effect
from postproc.effects.contract import State
from postproc.model.arm import Model
from postproc.model.equilibrium import equilibrium
from postproc.rapid.events import MotionEvent
from postproc.rapid.units import tool_matrix

_SAME_TOOL = 1e-6  # [m], and of a rotation matrix


def applicable_model(model: Model, events: Sequence[MotionEvent]) -> tuple[Model, list[Diagnostic]]:
    """Leave out what moves the instrument's frame, and the error of the measured tool where the program has another.

    Returns:
        The model, and CMP011 where the measured tool's error was left out.
    """
    kept, findings = [], []
    tools = {id(e.tool): e.tool for e in events if e.reason is None}
    other = next(
        (t.name for t in tools.values() if np.abs(tool_matrix(t) - model.T_flange_tcp).max() > _SAME_TOOL), None
    )
    for effect in model.effects:
        if _moves_instrument(model, effect):
            continue
        if effect.key == "tool_frame" and other is not None:
            text = f"the error of the measured tool is left out: the program uses `{other}`, which is not that tool"
            help_ = "give the measured tool as [tool] of the model where it is the same one"
            findings.append(Diagnostic("CMP011", "info", text, events[0].statement.source, None, help_))
            continue
        kept.append(effect)
    return model.with_effects(*kept), findings


def _moves_instrument(model: Model, effect: Effect) -> bool:
    """Whether an effect says where the instrument is (its frame, its drift), asked of one pose."""
    one = np.zeros(1)
    probe = State(
        q=0.1 * np.ones((1, 6)), v=np.zeros((1, 6)), a=np.zeros((1, 6)), approach=np.ones((1, 6)), payload_mass=one,
        payload_center=np.zeros((1, 3)), wrench=np.zeros((1, 6)), temperature=one + 20.0, time=one, session=one,
    )  # fmt: skip
    return equilibrium(model.with_effects(effect), probe).deflection.instrument is not None
