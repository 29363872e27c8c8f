"""Where effects come from: the library, installed packages (entry points ``postproc.effects``), the user's files."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import inspect
import sys
import traceback
from collections.abc import Iterable, Mapping
from contextlib import redirect_stdout
from dataclasses import replace
from difflib import get_close_matches
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from itertools import chain
from pathlib import Path
from types import ModuleType
from typing import Any

from postproc.diagnostics import Diagnostic, PostprocError, Source, Span
from postproc.effects.arm_load import ArmLoad
from postproc.effects.backlash import Backlash
from postproc.effects.base import Effect
from postproc.effects.base_compliance import BaseCompliance
from postproc.effects.bearing_tilt import BearingTilt
from postproc.effects.dress_pack import DressPack
from postproc.effects.frame_drift import FrameDrift
from postproc.effects.gravity_compensator import GravityCompensator
from postproc.effects.instrument_frame import InstrumentFrame
from postproc.effects.joint_compliance import JointCompliance
from postproc.effects.joint_error_map import JointErrorMap
from postproc.effects.joint_offset import JointOffset
from postproc.effects.link_compliance import LinkCompliance
from postproc.effects.link_geometry import LinkGeometry
from postproc.effects.nonlinear_compliance import NonlinearCompliance
from postproc.effects.outlier import Outlier
from postproc.effects.payload_error import PayloadError
from postproc.effects.servo_lag import ServoLag
from postproc.effects.session import Session
from postproc.effects.thermal_growth import ThermalGrowth
from postproc.effects.thermal_joint_drift import ThermalJointDrift
from postproc.effects.tool_frame import ToolFrame
from postproc.effects.transmission_error import TransmissionError
from postproc.effects.wrist_coupling import WristCoupling

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
    Session,
    Outlier,
)


def effect_library(files: Iterable[str | Path] = ()) -> dict[str, type[Effect]]:
    """All effects by key: the library, installed packages, then the user's files.

    Raises:
        PostprocError: a file is wrong, or two effects claim one key (EFF007 names both places).
    """
    every = [*BUILT_IN, *installed_effects()[0]]
    for file in dict.fromkeys(Path(f).resolve() for f in files):
        every += load_effect_file(file)
    if found := keys_taken_twice(every):
        raise PostprocError(found)
    return {cls.key: cls for cls in every}


def keys_taken_twice(classes: Iterable[type[Effect]]) -> list[Diagnostic]:
    """EFF007 for every effect whose key another one before it has."""
    library: dict[str, type[Effect]] = {}
    found: list[Diagnostic] = []
    for cls in classes:
        first = library.setdefault(cls.key, cls)
        if first is not cls:
            message = f"the key `{cls.key}` is taken twice: {origin(first)} and {origin(cls)}"
            help = 'give the class another name, or another key: class Name(Effect, key="...")'
            found.append(finding("EFF007", message, cls, help=help))
    return found


def find_effect(key: str, library: Library) -> type[Effect]:
    """The effect of that key.

    Raises:
        PostprocError: EFF020, with the nearest keys.
    """
    if key in library:
        return library[key]
    close = get_close_matches(key, list(library), n=3, cutoff=0.5)
    hint = "did you mean " + " or ".join(f"`{c}`" for c in close) + "?" if close else "known: " + ", ".join(library)
    broken = installed_effects()[1]
    hint = f"a package of effects is broken, as told below; {hint}" if broken else hint
    raise PostprocError([Diagnostic("EFF020", "error", f"there is no effect `{key}`", help=hint), *broken])


def installed_effects() -> tuple[list[type[Effect]], list[Diagnostic]]:
    """Effects of installed packages, and what is wrong with those that are left out.

    An entry point names a class, or a module whose effects are all taken. One that does not load (EFF001), whose key is
    taken (EFF007) or that fails a check is a warning, for who asks for it: most commands need none of them.
    """
    found: list[type[Effect]] = []
    wrong: list[Diagnostic] = []
    for entry in entry_points(group=GROUP):
        classes, problems = _installed(entry)
        wrong += [replace(d, severity="warning") for d in problems]
        for cls in classes:
            taken = keys_taken_twice([*BUILT_IN, *found, cls])
            found += [] if taken else [cls]
            wrong += [replace(d, severity="warning") for d in taken]
    return found, wrong


@cache
def _installed(entry: EntryPoint) -> tuple[tuple[type[Effect], ...], tuple[Diagnostic, ...]]:
    """Effects of one entry point, and what is wrong with it."""
    try:
        with redirect_stdout(sys.stderr):  # stdout is for results
            loaded = entry.load()
    except (Exception, SystemExit) as error:
        message = f"the entry point `{entry.name}` ({entry.value}) does not load: {describe(error)}"
        return (), (Diagnostic("EFF001", "error", message, help="repair or remove that package"),)
    classes = tuple(effects_of(loaded)) if isinstance(loaded, ModuleType) else (loaded,)
    problems = [_problems((cls,)) for cls in classes]
    sound = tuple(cls for cls, found in zip(classes, problems, strict=True) if not found)
    return sound, tuple(chain.from_iterable(problems))


def _problems(classes: Iterable[type[Effect]]) -> tuple[Diagnostic, ...]:
    """Errors that the conformance kit finds."""
    from postproc.effects.conformance import check_effect

    return tuple(d for cls in classes for d in check_effect(cls) if d.severity == "error")


def load_effect_file(path: str | Path, check: bool = True) -> tuple[type[Effect], ...]:
    """Run a Python file of the user and take the effects it defines, through the conformance kit unless told not to.

    Raises:
        PostprocError: the file does not run (EFF001), has no effect (EFF008) or two classes of one name (EFF007), or an
            effect fails a check.
    """
    path = Path(path).resolve()
    try:
        data = path.read_bytes()
    except OSError as error:
        message, help_ = f"the effect file cannot be read: {error.strerror}", "check the spelling and the folder"
        raise PostprocError(Diagnostic("EFF001", "error", message, Source(str(path), b""), help=help_)) from error
    # The name changes with the content, so that an edited file is loaded afresh and an unchanged one is not.
    name = f"effects_in_{path.stem}_{hashlib.sha256(str(path).encode() + data).hexdigest()[:12]}"
    if name not in sys.modules:
        _run(name, path, data)
    classes = tuple(effects_of(sys.modules[name]))
    if not classes:
        help = "define a class derived from `Effect` (postproc.effects.base)"
        message = "the file defines no effect"
        raise PostprocError(Diagnostic("EFF008", "error", message, Source(str(path), data), help=help))
    _check_names(Source(str(path), data))
    if check and (found := _problems(classes)):
        raise PostprocError(found)
    return classes


def effects_of(module: ModuleType) -> list[type[Effect]]:
    """Effects that a module defines itself, in the order of the file; imported ones are not its own."""
    return [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Effect) and value.__module__ == module.__name__
    ]


def origin(cls: type[Effect]) -> str:
    """``file:line`` where an effect is defined."""
    return finding("", "", cls).place.rpartition(":")[0] or cls.__module__


def finding(
    code: str, message: str, cls: type[Effect], *, member: str = "", line: int = 0, help: str = "", warn: bool = False
) -> Diagnostic:
    """A diagnostic at an effect's class, at one of its members, or at a line of its file."""
    source, span = None, None
    try:
        lines, start = inspect.getsourcelines(cls)
        path = inspect.getsourcefile(cls) or ""
        source = Source(path, Path(path).read_bytes())
        marks = (f"{member}:", f"{member} =", f"def {member}(")
        at = next((i for i, text in enumerate(lines) if member and text.lstrip().startswith(marks)), 0)
        span = line_span(source, line or start + at)
    except (OSError, TypeError):
        pass  # A class made at a prompt has no source; the message still names it.
    return Diagnostic(code, "warning" if warn else "error", message, source, span, help)


def line_span(source: Source, line: int) -> Span:
    """Byte offsets of a line's text, without its indentation."""
    raw = source.data[source.line_starts[line - 1] :].split(b"\n", 1)[0].rstrip()
    start = source.line_starts[line - 1] + len(raw) - len(raw.lstrip())
    return start, start + len(raw.strip())


def line_of(error: BaseException, path: str) -> int:
    """The last line of that file which an error went through; 0 where it did not."""
    if isinstance(error, SyntaxError) and error.filename == path:
        return error.lineno or 0
    frames = [f.lineno or 0 for f in traceback.extract_tb(error.__traceback__) if f.filename == path]
    return frames[-1] if frames else 0


def describe(error: BaseException) -> str:
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _run(name: str, path: Path, data: bytes) -> None:
    spec: Any = importlib.util.spec_from_file_location(name, path)
    source = Source(str(path), data)
    if spec is None:
        raise PostprocError(Diagnostic("EFF001", "error", "an effect file must end in `.py`", source))
    module = importlib.util.module_from_spec(spec)
    # Pickle and inspect look classes up by the module's name.
    sys.modules[name] = module
    try:
        with redirect_stdout(sys.stderr):  # stdout is for results
            spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        line = line_of(error, str(path))
        span = line_span(source, line) if line else None
        message = f"the effect file does not run: {describe(error)}"
        help = "run it with `python` to see the whole error"
        raise PostprocError(Diagnostic("EFF001", "error", message, source, span, help)) from error


def _check_names(source: Source) -> None:
    """The second of two classes of one name would silently take the place of the first."""
    seen: set[str] = set()
    for node in ast.parse(source.data).body:
        if isinstance(node, ast.ClassDef):
            if node.name in seen:
                message, help = f"the class `{node.name}` is defined twice", "give each effect a name of its own"
                span = line_span(source, node.lineno)
                raise PostprocError(Diagnostic("EFF007", "error", message, source, span, help))
            seen.add(node.name)
