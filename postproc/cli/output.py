"""Writing results: whole files or nothing, and never over the input."""

from __future__ import annotations

import errno
import os
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.run import SPACE
from postproc.diagnostics import PostprocError

if TYPE_CHECKING:
    from postproc.model.arm import Model


def check_outputs(inputs: Iterable[str | Path | None], *outputs: Path | None) -> None:
    """Refuse outputs before anything is done.

    Args:
        inputs: names of the files that are read; None and stdin are none.
        outputs: files that will be written; None is none.

    Raises:
        PostprocError: an output is an input or another output (CLI007), or cannot be written (CLI008).
    """
    taken = {Path(name).resolve(): f"the input `{name}`" for name in inputs if name is not None}
    for output in outputs:
        if output is None:
            continue
        if output.is_dir():
            raise PostprocError.of("CLI008", f"cannot write `{output}`: it is a folder", help="name a file")
        there = next(folder for folder in output.absolute().parents if folder.exists())
        if not there.is_dir():
            raise PostprocError.of(
                "CLI008", f"cannot write `{output}`: `{there}` is no folder", help="name another folder"
            )
        if output.resolve() in taken:
            text = f"the output `{output}` is {taken[output.resolve()]}"
            raise PostprocError.of("CLI007", text, help="choose another name")
        taken[output.resolve()] = "another output too"


def write(path: Path | None, data: bytes) -> None:
    """Write under a temporary name in the same folder, then rename: readers see the old file or the whole new one.

    Folders that are not there are made.

    Raises:
        PostprocError: the file cannot be written (CLI008).
    """
    if path is None:
        sys.stdout.flush()
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
        return
    target = path.resolve()  # a link stays a link
    temporary = ""
    try:
        if path.exists() and not path.is_file():  # a device, a pipe: nothing may take its place
            path.write_bytes(data)
            return
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(temporary, target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask())
        os.replace(temporary, target)
    except OSError as error:
        if temporary:
            Path(temporary).unlink(missing_ok=True)
        help_ = SPACE if error.errno == errno.ENOSPC else "check the folder and its rights"
        raise PostprocError.of("CLI008", f"cannot write `{path}`: {error.strerror}", help=help_) from None


def write_model(target: Path | None, model: Model, like: Path | None = None, silent: bool = False) -> None:
    """Write a model file; comments of the file it is derived from (``like``, else the one it replaces) survive.

    Args:
        target: None for stdout, where it goes unless stdout is taken (``silent``).
    """
    from postproc.model.rewrite import render_model
    from postproc.tomlfile import parse_toml, read_source

    if target is None and silent:
        return
    origin = like or target
    before = ""
    if origin is not None and origin.is_file():
        source = read_source(origin, "MOD001")
        parse_toml(source, "MOD001")
        before = source.data.decode("utf-8-sig")
    write(target, render_model(model, before).encode())


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
