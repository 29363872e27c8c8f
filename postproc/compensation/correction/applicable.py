"""The part of a model that holds for a program: no instrument, no tool that is not mounted, nothing it cannot tell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from shlex import quote

import numpy as np

from postproc.channels.state import State
from postproc.compensation.options import Options
from postproc.diagnostics import Diagnostic, Matter, Source
from postproc.effects.base import FILLED_BY_MODEL, Effect
from postproc.effects.roles import Role
from postproc.model.arm import Model
from postproc.model.controller import STIFFNESS, UNREAD, corrected_by_controller
from postproc.model.doubts import contradicted, doubts
from postproc.model.equilibrium import equilibrium
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.motions.units import tool_matrix
from postproc.robot.catalogue import no_masses
from postproc.robot.pose import displace

# What a program tells of the arm's state, and what the model fills in.
KNOWN_FROM_PROGRAM = frozenset({"q", "v", "a", "approach", "time", "payload", "wrench", *FILLED_BY_MODEL})
SAME_TOOL = 0.005  # [m]: a TCP is calibrated to a few millimetres at worst; farther apart it is another tool


def applicable_model(model: Model, events: Sequence[MotionEvent], options: Options) -> tuple[Model, list[Diagnostic]]:
    """The part of a model that holds for a program, with the calibration error of the measured tool carried over.

    Left out are effects on the measured data or on the instrument's frame, and effects that read channels which neither
    a program nor the options state. The measured TCP is the model's nominal tool moved by ``tool_frame``: a program
    whose TCP is within ``SAME_TOOL`` of it is taken to use that tool; any other tool is taken as calibrated.

    Args:
        events: all of the program, at least one.
        options: of these the channels, the process force and what the controller corrects by itself count.

    Returns:
        The model, and findings: CMP011 what was done about the measured tool, CMP014 in which axes an arm whose base is
        turned is programmed, CMP016 what is left out for a channel, MOD005 implausible parameters, MOD015 a fit that
        contradicts itself, KIN010 an arm without masses, KIN018 compliances from the controller, MOD006 a model in
        which nothing yields to a load.

    Raises:
        PostprocError: MOD012, the controller cannot correct by itself what the options say.
    """
    kept: list[Effect] = []
    stated = {name for name, _ in options.channels}
    joints = {} if model.station is None else model.station.joints
    known = KNOWN_FROM_PROGRAM | {c.name for e in model.effects for c in e.ordered_channels}
    known |= {"external_axes", *(f"eax_{axis}" for axis in joints)} if joints else set()
    source = events[0].statement.source
    findings = [*(d for _, _, d in doubts(model)), *contradicted(model, source)]
    findings += [*_without_load(model, options, source), *_turned(model, events), *_of_controller(model, source)]
    for name in sorted(stated - {n for e in model.effects for n in e.reads if n not in known}):
        text, help_ = f"no effect of the model waits for a channel `{name}`", "check its spelling, or leave it out"
        findings.append(Diagnostic("CMP016", "error", text, source, None, help_, Matter.OMITTED))
    for effect in model.effects:
        if effect.about_data or _moves_instrument(model, effect):
            continue
        if unknown := [axis for axis in effect.external_axes if axis not in joints]:
            names = " and ".join(f"`eax_{axis}`" for axis in unknown)
            text = f"`{effect.key}` speaks of {names}, and nobody says what carries the arm or its work there"
            help_ = "describe the axis in `[[external_axes]]` of the model or with `--cell` (docs/my-cell.md)"
            finding = Diagnostic("CMP016", "warning", f"{text}: it is left out", source, None, help_, Matter.OMITTED)
            findings.append(finding)
            if len(unknown) == len(effect.external_axes):
                continue
        if untold := [name for name in effect.reads if name not in known and name not in stated]:
            names = " and ".join(f"`{name}`" for name in untold)
            text = f"`{effect.key}` is left out: it reads {names}, which a program does not tell"
            flags = " ".join(f"--channel {quote(name)}=NUMBER" for name in untold)
            help_ = f"what it does to the arm stays in the path; say {flags}"
            findings.append(Diagnostic("CMP016", "warning", text, source, None, help_, Matter.OMITTED))
            continue
        if effect.role is Role.TOOL_FRAME:
            carried, finding = _carry_tool(model, effect, events)
            findings.append(finding)
            if carried is None:
                continue
            effect = carried
        kept.append(effect)
    real = corrected_by_controller(model.with_effects(*kept), options.already)
    return replace(real, surest=_surest(model, kept, events)), findings


def _surest(model: Model, kept: Sequence[Effect], events: Sequence[MotionEvent]) -> Model | None:
    """Return the model for away from the measured rows, with those of its effects that are kept; None without any."""
    if model.surest is None:
        return None
    keys = {effect.key for effect in kept}
    sure = [e for e in model.surest.effects if e.key in keys]
    tools = (_carry_tool(model, e, events)[0] if e.role is Role.TOOL_FRAME else e for e in sure)
    return model.surest.with_effects(*filter(None, tools))


def _without_load(model: Model, options: Options, source: Source) -> Iterator[Diagnostic]:
    """MOD006 if no effect of the model reads the load, KIN010 if effects do but the arm has no masses.

    MOD006 is an error if the model has no effects or the options state a force; both say that loads bend nothing.
    """
    if not any("load" in effect.reads for effect in model.effects):
        lost = not model.effects or any((*options.force, *options.moment))
        text = f"nothing in the model of `{model.robot.name}` yields to a load: weight and force bend nothing"
        help_ = "fit a model with `joint_compliance`, or state one (zeros for joints that are rigid)"
        yield Diagnostic("MOD006", "error" if lost else "warning", text, source, None, help_)
    elif not model.robot.mass.any() and not any(type(e).load is not Effect.load for e in model.effects):
        yield no_masses(model.robot, "error")


def _of_controller(model: Model, source: Source) -> Iterator[Diagnostic]:
    """KIN018 if the joint compliances come from the controller's configuration, with its entries that were not read.

    It is a warning if there are such entries, else an info.
    """
    if UNREAD not in model.robot.sources:
        return
    text, unread = f"the joint compliances are those of {model.robot.sources[STIFFNESS]}", model.robot.sources[UNREAD]
    if not unread:
        yield Diagnostic("KIN018", "info", text, source, matter=Matter.CONTROLLER)
        return
    text += f"; not read, for their axes and frames are not published: {unread}"
    help_ = "what these would correct stays in the path: `postproc fit` with measurements finds it"
    yield Diagnostic("KIN018", "warning", text, source, None, help_, Matter.CONTROLLER)


def _turned(model: Model, events: Sequence[MotionEvent]) -> Iterator[Diagnostic]:
    """CMP014: an error where model and cell state different directions of gravity in the base.

    Without a cell it is a warning for an arm whose base is turned: its work objects are read in axes of the base.
    """
    source, station = events[0].statement.source, model.station
    if station is not None:
        stated = station.gravity(np.zeros((1, 6)))
        if stated is not None and not np.allclose(model.gravity, stated[0], atol=0.01):
            text = "the cell (a controller's configuration, or `--cell`) hangs the arm otherwise than the model"
            help_ = "state the same `[mounting]` `rpy_deg` in both files: gravity pulls along it"
            yield Diagnostic("CMP014", "error", text, source, None, help_)
    elif not np.allclose(model.R_world_base, np.eye(3), atol=1e-3):
        text = "the arm's base is turned ([mounting]), and the program's work objects are read in axes of that base"
        help_ = "right where the controller's base frame is zero; else convert with work objects given in base axes"
        yield Diagnostic("CMP014", "warning", text, source, None, help_)


def _carry_tool(model: Model, effect: Effect, events: Sequence[MotionEvent]) -> tuple[Effect | None, Diagnostic]:
    """The effect ``tool_frame`` restated for the program's tool, and finding CMP011 that says so.

    Its position becomes that of the measured TCP in the axes of the program's tool; its rotation becomes zero. None in
    place of the effect if the program uses another tool than the measured one, or none.
    """
    measured = model.T_flange_tcp @ displace(effect.vector())
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
    return effect.with_vector(np.concatenate([shift, np.zeros(3)])), finding


def _moves_instrument(model: Model, effect: Effect) -> bool:
    """Whether an effect displaces the frame of the measuring instrument (found by evaluating it at one pose)."""
    one = np.zeros(1)
    probe = State(
        q=0.1 * np.ones((1, 6)), v=np.zeros((1, 6)), a=np.zeros((1, 6)), approach=np.ones((1, 6)), payload_mass=one,
        payload_center=np.zeros((1, 3)), wrench=np.zeros((1, 6)), temperature=one + 20.0, time=one, session=one,
    )  # fmt: skip
    return equilibrium(model.with_effects(effect), probe).deflection.instrument is not None
