"""The part of a model that holds for a program: not the instrument that measured it, nor a tool that is not mounted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from postproc.diagnostics import Diagnostic
from postproc.effects.base import Effect
from postproc.effects.contract import State
from postproc.effects.tool_frame import ToolFrame
from postproc.model.arm import Model
from postproc.model.doubts import doubts
from postproc.model.equilibrium import equilibrium
from postproc.rapid.events import MotionEvent
from postproc.rapid.records import Pose
from postproc.rapid.units import pose_matrix, tool_matrix
from postproc.robot.pose import displace

SAME_TOOL = 0.005  # [m]: a TCP is calibrated to a few millimetres at worst; farther apart it is another tool


def applicable_model(
    model: Model, events: Sequence[MotionEvent], base: Pose = Pose()
) -> tuple[Model, list[Diagnostic]]:
    """Leave out what moves the instrument's frame; carry the calibration error of the measured tool to the program's.

    The measured TCP is the model's nominal tool moved by ``tool_frame``. A program whose tool has its TCP within
    ``SAME_TOOL`` of that uses the measured tool; any other is taken as calibrated.

    Returns:
        The model, and findings: CMP011 says what was done about the measured tool, CMP014 in which axes an arm whose
        base is turned is programmed, MOD005 what no arm can be.
    """
    kept: list[Effect] = []
    findings = [*doubts(model), *_turned(model, events, base)]
    for effect in model.effects:
        if _moves_instrument(model, effect):
            continue
        if isinstance(effect, ToolFrame):
            carried, finding = _carry_tool(model, effect, events)
            findings.append(finding)
            if carried is None:
                continue
            effect = carried
        kept.append(effect)
    return model.with_effects(*kept), findings


def _turned(model: Model, events: Sequence[MotionEvent], base: Pose) -> Iterator[Diagnostic]:
    source = events[0].statement.source
    if base != Pose():
        up = pose_matrix(base.trans, base.rot)[2, :3]  # the world's z axis in the base
        if not np.allclose(model.R_world_base[2], up, atol=1e-3):
            text = "the controller's base frame tilts the arm, and the model's [mounting] does not hang it that way"
            help_ = "give [mounting] rpy_deg in the model: gravity pulls along it"
            yield Diagnostic("CMP014", "error", text, source, None, help_)
    elif not np.allclose(model.R_world_base, np.eye(3), atol=1e-3):
        text = "the arm's base is turned ([mounting]), and the program's work objects are read in axes of that base"
        help_ = "right where the controller's base frame is zero; else convert with work objects given in base axes"
        yield Diagnostic("CMP014", "warning", text, source, None, help_)


def _carry_tool(model: Model, effect: ToolFrame, events: Sequence[MotionEvent]) -> tuple[ToolFrame | None, Diagnostic]:
    """The error of the measured tool as the error of the program's tool, None where the program has another."""
    measured = model.T_flange_tcp @ displace(np.concatenate([effect.shift_m, effect.turn_rad]))
    source = events[0].statement.source
    used = {e.tool.name: e.tool for e in events if e.reason is None}
    tools = {name: tool_matrix(tool) for name, tool in used.items()}
    far = {n: float(np.linalg.norm(T[:3, 3] - measured[:3, 3])) for n, T in tools.items()}
    far |= {name: np.inf for name, tool in used.items() if not tool.robhold}  # it was not on the flange
    other = next((name for name, distance in far.items() if distance > SAME_TOOL), None)
    if other is not None or not tools:
        text = f"the calibration error of the measured tool is left out: the program uses `{other or 'no tool'}`"
        return None, Diagnostic("CMP011", "info", text, source, None, "its TCP is taken as calibrated")
    name, T_flange_tcp = next(iter(tools.items()))
    shift = T_flange_tcp[:3, :3].T @ (measured[:3, 3] - T_flange_tcp[:3, 3])
    text = (
        f"`{name}` is taken for the tool that was measured: its TCP stands {1e3 * far[name]:.2f} mm from its tooldata"
    )
    finding = Diagnostic("CMP011", "info", text, source, None, "calibrate the tool anew and this correction vanishes")
    return replace(effect, shift_m=shift, turn_rad=np.zeros(3)), finding


def _moves_instrument(model: Model, effect: Effect) -> bool:
    """Whether an effect says where the instrument is (its frame, its drift), asked of one pose."""
    one = np.zeros(1)
    probe = State(
        q=0.1 * np.ones((1, 6)), v=np.zeros((1, 6)), a=np.zeros((1, 6)), approach=np.ones((1, 6)), payload_mass=one,
        payload_center=np.zeros((1, 3)), wrench=np.zeros((1, 6)), temperature=one + 20.0, time=one, session=one,
    )  # fmt: skip
    return equilibrium(model.with_effects(effect), probe).deflection.instrument is not None
