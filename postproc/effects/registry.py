"""Where effects come from: the library, installed packages (entry points ``postproc.effects``), the user's files."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from contextlib import redirect_stdout
from dataclasses import replace
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from itertools import chain
from pathlib import Path
from types import ModuleType

from postproc.diagnostics import Diagnostic, PostprocError, did_you_mean
from postproc.effects.base import Effect
from postproc.effects.findings import describe, finding, origin
from postproc.effects.library.cell.external_axis_compliance import ExternalAxisCompliance
from postproc.effects.library.cell.external_axis_error import ExternalAxisError
from postproc.effects.library.cell.external_axis_frame import ExternalAxisFrame
from postproc.effects.library.curve import ChannelCurve
from postproc.effects.library.frames.frame_drift import FrameDrift
from postproc.effects.library.frames.instrument_frame import InstrumentFrame
from postproc.effects.library.frames.outlier import Outlier
from postproc.effects.library.frames.reflector import Reflector
from postproc.effects.library.frames.session import Session
from postproc.effects.library.frames.setup import Setup
from postproc.effects.library.frames.tool_frame import ToolFrame
from postproc.effects.library.frames.work_object import WorkObject
from postproc.effects.library.joints.backlash import Backlash
from postproc.effects.library.joints.joint_compliance import JointCompliance
from postproc.effects.library.joints.joint_error_map import JointErrorMap
from postproc.effects.library.joints.joint_offset import JointOffset
from postproc.effects.library.joints.nonlinear_compliance import NonlinearCompliance
from postproc.effects.library.joints.servo_lag import ServoLag
from postproc.effects.library.joints.thermal_joint_drift import ThermalJointDrift
from postproc.effects.library.joints.transmission_error import TransmissionError
from postproc.effects.library.joints.wrist_coupling import WristCoupling
from postproc.effects.library.loads.arm_load import ArmLoad
from postproc.effects.library.loads.dress_pack import DressPack
from postproc.effects.library.loads.gravity_compensator import GravityCompensator
from postproc.effects.library.loads.payload_error import PayloadError
from postproc.effects.library.structure.base_compliance import BaseCompliance
from postproc.effects.library.structure.bearing_tilt import BearingTilt
from postproc.effects.library.structure.link_compliance import LinkCompliance
from postproc.effects.library.structure.link_geometry import LinkGeometry
from postproc.effects.library.structure.thermal_growth import ThermalGrowth
from postproc.effects.loading import effects_of, load_effect_file, problems_of
from postproc.effects.roles import Role

Library = Mapping[str, type[Effect]]
GROUP = "postproc.effects"

BUILT_IN: tuple[type[Effect], ...] = (
    InstrumentFrame,
    ToolFrame,
    JointOffset,
    LinkGeometry,
    JointCompliance,
    NonlinearCompliance,
    Backlash,
    TransmissionError,
    JointErrorMap,
    ArmLoad,
    GravityCompensator,
    PayloadError,
    DressPack,
    ThermalGrowth,
    ThermalJointDrift,
    BaseCompliance,
    BearingTilt,
    LinkCompliance,
    ServoLag,
    WristCoupling,
    FrameDrift,
    ExternalAxisFrame,
    ExternalAxisError,
    ExternalAxisCompliance,
    Session,
    WorkObject,
    Reflector,
    Setup,
    Outlier,
    ChannelCurve,
)


def effect_in_role(role: Role) -> type[Effect]:
    """Return the class of the shipped effect with this role."""
    return next(cls for cls in BUILT_IN if cls.role is role)


def effect_library(files: Iterable[str | Path] = ()) -> dict[str, type[Effect]]:
    """Return all effect classes by key: the library, installed packages, then the user's files.

    Raises:
        PostprocError: a file is wrong, or two effects claim one key (EFF007 names both places).
    """
    every = [*BUILT_IN, *installed_effects()[0]]
    for file in dict.fromkeys(Path(f).resolve() for f in files):
        every += load_effect_file(file)
    if taken := keys_taken_twice(every):
        raise PostprocError(taken)
    return {cls.key: cls for cls in every}


def keys_taken_twice(classes: Iterable[type[Effect]]) -> list[Diagnostic]:
    """Return EFF007 for every effect class whose key an earlier one has."""
    library: dict[str, type[Effect]] = {}
    taken: list[Diagnostic] = []
    for cls in classes:
        first = library.setdefault(cls.key, cls)
        if first is not cls:
            message = f"the key `{cls.key}` is taken twice: {origin(first)} and {origin(cls)}"
            help = 'give the class another name, or another key: class Name(Effect, key="...")'
            taken.append(finding("EFF007", message, cls, help=help))
    return taken


def find_effect(key: str, library: Library) -> type[Effect]:
    """Return the effect class with this key.

    Raises:
        PostprocError: EFF020, with the nearest keys.
    """
    if key in library:
        return library[key]
    other = "`postproc effects list` shows the library; one of your own is made known with `--effects FILE.py`"
    hint = did_you_mean(key, library, 3, 0.5) or other
    broken = installed_effects()[1]
    hint = f"a package of effects is broken, as told below; {hint}" if broken else hint
    raise PostprocError([Diagnostic("EFF020", "error", f"there is no effect `{key}`", help=hint), *broken])


def installed_effects() -> tuple[list[type[Effect]], list[Diagnostic]]:
    """Return the effects of installed packages, and warnings on those that are left out.

    An entry point names a class, or a module whose effects are all taken. Left out is one that does not load (EFF001),
    whose key is taken (EFF007) or that fails a check; this is no error, since most commands need none of them.
    """
    effects: list[type[Effect]] = []
    wrong: list[Diagnostic] = []
    for entry in entry_points(group=GROUP):
        classes, problems = _installed(entry)
        wrong += [replace(d, severity="warning") for d in problems]
        for cls in classes:
            taken = keys_taken_twice([*BUILT_IN, *effects, cls])
            effects += [] if taken else [cls]
            wrong += [replace(d, severity="warning") for d in taken]
    return effects, wrong


@cache
def _installed(entry: EntryPoint) -> tuple[tuple[type[Effect], ...], tuple[Diagnostic, ...]]:
    """Return the effects of one entry point that pass the conformance kit, and what is wrong with the others."""
    try:
        with redirect_stdout(sys.stderr):  # stdout is for results
            loaded = entry.load()
    except (Exception, SystemExit) as error:
        message = f"the entry point `{entry.name}` ({entry.value}) does not load: {describe(error)}"
        return (), (Diagnostic("EFF001", "error", message, help="repair or remove that package"),)
    classes = tuple(effects_of(loaded)) if isinstance(loaded, ModuleType) else (loaded,)
    problems = [problems_of((cls,)) for cls in classes]
    sound = tuple(cls for cls, wrong in zip(classes, problems, strict=True) if not wrong)
    return sound, tuple(chain.from_iterable(problems))
