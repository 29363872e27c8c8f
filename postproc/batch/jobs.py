"""From tasks to jobs: models are read once, files when their turn comes, and a key says what the result depends on."""

from __future__ import annotations

import pickle
from collections.abc import Iterable, Mapping
from dataclasses import astuple, dataclass, fields, is_dataclass, replace
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from postproc.batch.nearby import read_nearby
from postproc.batch.values import Job, Task, page_of
from postproc.diagnostics import Source
from postproc.files import read_source, real, resource
from postproc.model.arm import Model
from postproc.rapid.program.read_along import ReadAlong
from postproc.rapid.program.shared_data import data_elsewhere, lent_values
from postproc.render.templates import environment
from postproc.robot.controller import read_quietly
from postproc.settings import Settings, made_with

LIBRARIES = ("numpy", "scipy", "toppra", "ruckig", "pin", "py-opw-kinematics", "jinja2")


@dataclass(frozen=True)
class Converter:
    """Settings with all files read, ready to be sent to workers.

    Args:
        model: pickled. robot: library name of its arm. settings: where all of it comes from.
        fingerprint: hash of model, options, templates, effect code and software. side_files: read-only modules.
    """

    model: bytes
    robot: str
    settings: Settings
    fingerprint: str
    side_files: tuple[Source, ...]


def read_converter(settings: Settings, model: Model) -> Converter:
    """Read effects, templates and side files of settings, and hash all that a result depends on beside its program.

    Raises:
        PostprocError: one of the files cannot be used.
    """
    code = [_read(path) for path in settings.effects]
    folder = settings.options.template_dir
    environment(folder)  # says whether the folder is there
    templates = {p.name: _read(p) for p in sorted(folder.glob("*.j2"))} if folder is not None else {}
    sides = tuple(Source(str(path), _read(path), read_only=True) for path in settings.side_files)
    stated = (_software(), _model_parts(model), replace(settings.options, template_dir=None), code, templates)
    return Converter(pickle.dumps(model), model.robot.name, settings, _digest(stated), sides)


def _software() -> tuple[Any, ...]:
    """Return the files of the package as bytes and the versions of libraries: all that may change a result.

    Code may change while its version does not.
    """
    files = sorted([*Path(__file__).parents[1].rglob("*.py"), *resource("templates").rglob("*.*")])
    return [path.read_bytes() for path in files], [_version(name) for name in LIBRARIES]


def _version(name: str) -> str:
    """Return the installed version of a package; empty where its name is not known."""
    try:
        return version(name)
    except PackageNotFoundError:  # conda names some of them differently
        return ""


def _model_parts(model: Model) -> tuple[Any, ...]:
    """Return the parts of a model that decide its predictions, without how it was fitted."""
    effects = [(type(e).__qualname__, e.key, e.to_file()) for e in model.effects]
    return model.robot, effects, model.R_world_base, model.T_flange_tcp, model.station


def read_job(root: Path, task: Task, converter: Converter, page: bool = False) -> Job:
    """Read the files of a task into a job.

    Args:
        root: folder of the batch; page: whether the task gets an HTML page.

    Raises:
        PostprocError: BAT002, one of them cannot be read.
    """
    own = [Source(name, _read(root / name)) for name in task.files]
    shared = [Source(name, _read(root / name), read_only=True) for name in task.shared]
    given = {real(root / name) for name in (*task.files, *task.shared)}
    shared += [s for s in converter.side_files if real(Path(s.path)) not in given]
    others = [tuple(Source(name, read_quietly(root / name)) for name in names) for names in task.beside]
    shared += lent_values([*own, *shared], lambda: chain.from_iterable(others))
    along = ReadAlong() if converter.settings.alone else read_nearby([*own, *shared], root)
    shared += along.sources
    elsewhere = replace(data_elsewhere([*own, *shared], others), read_along=along.written)
    content = [(s.path, s.data) for s in own], [(s.path, s.data) for s in shared]
    said = [d.message for d in along.findings]
    key = _digest((converter.fingerprint, content, *map(sorted, astuple(elsewhere)), said))
    options = replace(converter.settings.options, elsewhere=elsewhere)
    job = Job(task.name, key, (*own, *shared), converter.model, options, findings=along.findings)
    return replace(job, page=page_of(task.name), made=made_with(converter.settings)) if page else job


def _read(path: Path) -> bytes:
    """Return the bytes of a file.

    Raises:
        PostprocError: BAT002, it cannot be read.
    """
    return read_source(path, "BAT002").data


def _digest(value: object) -> str:
    """Return the SHA-256 of a nested value as hexadecimal text."""
    hash_ = sha256()
    for part in _parts(value):
        hash_.update(len(part).to_bytes(8, "big") + part)
    return hash_.hexdigest()


def _parts(value: Any) -> Iterable[bytes]:
    """Yield the bytes that stand for a nested value; arrays in full, since their text leaves out the middle."""
    if isinstance(value, bytes):
        yield value
    elif isinstance(value, np.ndarray):
        yield from (str((value.dtype, value.shape)).encode(), value.tobytes())
    elif isinstance(value, Mapping):
        yield from _parts(sorted(value.items()))
    elif isinstance(value, (list, tuple)):
        yield f"{len(value)} values".encode()
        for item in value:
            yield from _parts(item)
    elif is_dataclass(value):
        yield type(value).__qualname__.encode()
        for field in fields(value):
            yield from _parts(getattr(value, field.name))
    else:
        yield repr(value).encode()
