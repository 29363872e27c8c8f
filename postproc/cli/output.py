"""Writing results: whole files or nothing, and never over what is read."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from os.path import isfile  # unlike Path.is_file it takes any text for a name
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.printing import VERBOSE, print_document, print_lines
from postproc.diagnostics import PostprocError, visible
from postproc.files import check_writes, read_source, real, why, write_atomically
from postproc.report.terminal import render_lines

if TYPE_CHECKING:
    from postproc.model.arm import Model
    from postproc.report.blocks import Document


def check_outputs(inputs: Iterable[str | Path | None], *outputs: Path | None) -> None:
    """Refuse outputs that are inputs before anything is done; the robot file beside a model counts as an input.

    Args:
        inputs, outputs: files; None is skipped.

    Raises:
        PostprocError: as `check_writes`.
    """
    named = [Path(name) for name in inputs if name is not None]
    check_writes([*named, *map(_arm_file, named)], *outputs)


def _arm_file(model: Path) -> Path | None:
    """Return the robot file beside a model that the model names; None without one or if the model is unreadable."""
    from postproc.tomlfile import parse_toml

    try:
        robot = parse_toml(read_source(model), "MOD001").get("robot") if model.suffix == ".toml" else None
        return model.parent / robot if isinstance(robot, str) and isfile(model.parent / robot) else None
    except PostprocError:
        return None


def write(path: Path | None, data: bytes | str) -> None:
    """Write a whole file or nothing; None is stdout, where a terminal gets control characters escaped.

    Raises:
        PostprocError: the file cannot be written (CLI008).
    """
    # A file name that is not Unicode is no reason to lose the page that tells of it.
    data = data.encode("utf-8", "replace") if isinstance(data, str) else data
    if path is None:
        sys.stdout.flush()
        shown = visible(data.decode("utf-8", "replace")).encode() if sys.stdout.isatty() else data
        sys.stdout.buffer.write(shown)
        sys.stdout.buffer.flush()
        return
    try:
        if path.exists() and not path.is_file():  # a device, a pipe: nothing may take its place
            path.write_bytes(data)
        else:
            write_atomically(real(path), data)  # a link stays a link
    except OSError as error:
        reason, help_ = why(error)
        raise PostprocError.of("CLI008", f"cannot write `{path}`: {reason}", help=help_) from None


def present(
    document: Document,
    report: Path | None = None,
    *,
    json: bool = False,
    form: str | None = None,
    text: bool = False,
    on_stderr: bool = False,
    root: Path = Path(),
) -> None:
    """Print a result on stdout, as text or as JSON, and write its page where ``report`` names one.

    Args:
        json: print the document as JSON. form: the same as a word, ``json``, or ``sarif`` for findings and welds alone.
        text: with a document on stdout, also print the text on stderr.
        on_stderr: stdout is taken, the text goes there. root: folder at which the paths of findings start.
    """
    if report is not None:
        from postproc.report.page import render_page

        write(report, render_page(document))
    form = "json" if json else form
    if form is not None:
        print_document(document.values, form, root)
    if text or form is None:
        stream = sys.stderr if form is not None or on_stderr else sys.stdout
        print_lines(render_lines(document, VERBOSE.get()), stream)


def write_together(files: Sequence[tuple[Path | None, bytes]]) -> None:
    """Write several files, or none of them: if one fails, those before are restored.

    Args:
        files: path (None for stdout) and bytes of each.

    Raises:
        PostprocError: as ``write``.
    """
    done: list[tuple[Path, bytes | None]] = []
    try:
        for path, data in files:
            was = path.read_bytes() if path is not None and path.is_file() else None
            write(path, data)
            done += [(path, was)] if path is not None else []
    except PostprocError:
        for path, was in done:
            if was is None:
                path.unlink()
            else:
                write(path, was)
        raise


def write_model(target: Path | None, model: Model, like: Path | None = None, silent: bool = False) -> None:
    """Write a model file; comments of an older file survive.

    Args:
        target: None for stdout, where it goes unless stdout is taken (``silent``).
        like: the file whose comments are kept; None for the one that is replaced.
    """
    from postproc.model.rewrite import render_model
    from postproc.tomlfile import parse_toml

    if target is None and silent:
        return
    origin = like or target
    before = ""
    if origin is not None and origin.is_file():
        source = read_source(origin, "MOD001")
        parse_toml(source, "MOD001")
        before = source.data.decode("utf-8-sig")
    write(target, render_model(model, before))
