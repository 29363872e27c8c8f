"""What commands do with a conversion: write it, show the difference, say whether anything would change; its pages."""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from postproc.cli.output import present, write, write_together
from postproc.cli.printing import say
from postproc.diagnostics import PostprocError, Source
from postproc.files import read_source

if TYPE_CHECKING:
    from postproc.compensation.conversion import Conversion
    from postproc.compensation.options import Options
    from postproc.report.blocks import Values
    from postproc.settings import Settings

LINE_PATTERN = rb"[^\n]*\n|[^\n]+"
"""A difference counts lines by LF alone."""


def module_file(options: Options, target: Path | None, nothing: bool) -> Path | None:
    """Return the file of the module that corrects targets at run time.

    None where there is none, or if nothing is written and no file is named.

    Args:
        target: where the program goes, None for stdout. nothing: no file will be written.

    Raises:
        PostprocError: CLI007, nothing says where, or what stands there is another file.
    """
    if options.run_time == "off":
        return None
    from postproc.compensation.text.marks import MODULE_MARKER
    from postproc.runtime.module import MODULE_NAME

    path = options.run_time_module or (target.parent / f"{MODULE_NAME}.sys" if target is not None else None)
    if path is None and not nothing:
        text = "`--run-time` writes a module beside the output, and the output goes to stdout"
        raise PostprocError.of("CLI007", text, help="name the output with `-o`, or the module with `--run-time-module`")
    if path is not None and path.is_file() and MODULE_MARKER.encode() not in path.read_bytes():
        text = f"`{path}` is there, and no module that postproc wrote"
        raise PostprocError.of("CLI007", text, help="name another file with `--run-time-module`")
    return path


def finish(
    before: bytes,
    after: bytes,
    names: tuple[str, str],
    target: Path | None,
    *,
    check: bool,
    diff: bool,
    silent: bool,
    module: tuple[Path, bytes] | None = None,
) -> bool:
    """Write a result, or with ``check`` or ``diff`` write nothing and return whether a file would change.

    Args:
        before, after: the input and the output.
        names: of both, for the head of the difference.
        target: where the output goes, None for stdout.
        check: write nothing, and say whether the output file (the input, without one) would change.
        diff: write nothing, and print the difference.
        module: a second file, written with the output or not at all.
        silent: stdout is taken (``--json``): neither the output nor the difference goes there.
    """
    files = [*([module] if module is not None else []), (target, after)]
    if diff and not silent:
        write(None, unified_diff(before, after, *names))
    if check:
        _say_changes(before, names[0], files)
    if check and target is not None:
        same = (path is None or (path.is_file() and path.read_bytes() == data) for path, data in files)
        return not all(same)
    if check or diff:
        return before != after
    if target is not None or not silent:
        write_together(files)
    return False


def _say_changes(before: bytes, name: str, files: Sequence[tuple[Path | None, bytes]]) -> None:
    """Say on stderr whether the output files, or without one the program, would change, and by how much.

    Args:
        before: the program. name: of it. files: path and bytes of what would be written, None for stdout.
    """
    from postproc.rapid.diff.difference import FileDiff
    from postproc.rapid.diff.files import compare_files
    from postproc.results.convert.difference import change_lines

    changes = []
    for target, after in files:
        path, new = str(target or name), target is not None and not target.is_file()
        now = Source(path, before if target is None or new else target.read_bytes())
        change = FileDiff(path, "added") if new else compare_files(path, now, Source(path, after), (0.0, 0.0))
        changes.append(FileDiff(path, "changed") if change.status == "equal" and now.data != after else change)
    for line in change_lines(changes):
        say(line)


def show_result(
    program: Path, result: Conversion, settings: Settings, report: Path | None, certificate: Path | None
) -> None:
    """Print the result on stderr, and write the report and the certificate where their paths are given.

    Args:
        program: its file.
    """
    from postproc.results.convert.conversion import conversion_document
    from postproc.settings import made_with

    made = made_with(settings, program.parent)
    present(conversion_document(program.name, result, made), report, on_stderr=True)
    if certificate is not None:
        from postproc.report.page import render_certificate
        from postproc.results.certificate import program_certificate

        files = [read_source(file) for file in settings.inputs if file is not None and Path(file).is_file()]
        write(certificate, render_certificate(program_certificate(program.name, result, made, files)))


def say_missed(require: str | None, programs: Mapping[str, Values]) -> bool:
    """Say on stderr of the worst program and weld that the required tolerance is not kept; return whether it is not.

    Args:
        require: ``model`` or ``arm``, None for nothing. programs: documents of conversions, or their entries in that of
            a batch, by name.
    """
    from postproc.results.convert.requirement import missed

    line = None if require is None else missed(require, programs)
    if line is not None:
        say(f"`--require {require}`: {line}")
    return line is not None


def unified_diff(before: bytes, after: bytes, name_before: str, name_after: str) -> bytes:
    """Return the textual difference as ``diff -u`` prints it, with the bytes of the files unchanged."""
    lines = difflib.diff_bytes(
        difflib.unified_diff,
        re.findall(LINE_PATTERN, before),
        re.findall(LINE_PATTERN, after),
        os.fsencode(name_before),
        os.fsencode(name_after),
    )
    return b"".join(line if line.endswith(b"\n") else line + b"\n\\ No newline at end of file\n" for line in lines)
