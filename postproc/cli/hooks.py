"""``python -m postproc.cli.hooks``: one command for each of many programs, as pre-commit and CI call it.

    python -m postproc.cli.hooks check|diff|read [OPTIONS] [--programs DIR] [--approved DIR] [--sarif FILE] [PROGRAM..]

``check`` asks whether ``compensate`` would write what is approved, ``diff`` compares a program with the approved one by
meaning, ``read`` inspects it. Without names it is every program below the folder, and every approved one must have its
program. Other options go to the command. Exit code: the largest of all programs; 2 where there is none. What ``check``
prints of a program that is as approved is one line, with ``--verbose`` all.
"""

from __future__ import annotations

import io
import json
import sys
from argparse import SUPPRESS, ArgumentParser
from collections.abc import Sequence
from contextlib import nullcontext, redirect_stderr, redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any

from postproc.cli.app import build
from postproc.cli.check_verdict import verdict_lines
from postproc.cli.output import check_outputs, write
from postproc.cli.printing import print_stderr, say
from postproc.cli.run import BAD_INPUT, EVERYTHING, FINDINGS, Outcome, guarded, run_command
from postproc.diagnostics import Diagnostic, PostprocError, Source
from postproc.rapid.program.program import ENDINGS
from postproc.tasks.discover import IGNORED_FOLDERS

MODULE_SUFFIXES = frozenset({".mod", ".prg", ".modx"})
"""Endings of programs, which are looked for in a folder; system modules are lent to them."""


def main(arguments: Sequence[str]) -> int:
    """Run the command for each program and return the largest exit code."""
    if not arguments or arguments[0] not in ("check", "diff", "read"):
        say((__doc__ or "").strip())
        return BAD_INPUT
    parser = ArgumentParser(add_help=False, allow_abbrev=False, argument_default=SUPPRESS)
    for option in ("--programs", "--approved", "--sarif"):
        parser.add_argument(option, dest=option, type=Path, nargs="?")

    def work() -> int:
        """Split this script's options from all others, and run the command."""
        values, words = parser.parse_known_args(arguments[1:])
        return _every(arguments[0], {option: path for option, path in vars(values).items() if path is not None}, words)

    return guarded(work, ()).code


def _every(name: str, folders: dict[str, Path], words: list[str]) -> int:
    """Run a command for each program, write the joint SARIF log if asked for, and return the largest exit code.

    Args:
        name: ``check``, ``diff`` or ``read``. folders: the options of this script, by name.
        words: options of the command, then programs; without these, all of the folder.
    """
    first = max((i + 1 for i, word in enumerate(words) if Path(word).suffix.lower() not in ENDINGS), default=0)
    options, programs = words[:first], [Path(word) for word in words[first:]]
    gone = [] if programs else _without_program(folders)
    programs = programs or _in_folder(folders)
    commands = [_command(name, program, folders) for program in programs]
    log = folders.get("--sarif") if name != "diff" else None
    check_outputs([*programs, *_below(folders.get("--programs")), *_below(folders.get("--approved"))], log)
    form = [] if log is None else ["--format", "sarif"]
    calls = [partial(run_command, build(), [*command, *options, *form]) for command in commands]
    calls += [partial(guarded, partial(_refuse_output, path, folders["--programs"]), form) for path in gone]
    logs: list[dict[str, Any]] = []
    outcomes = list[Outcome]()
    for path, call in zip([*programs, *gone], calls, strict=True):
        printed, messages = io.StringIO(), io.StringIO()
        with (
            nullcontext() if log is None else redirect_stdout(printed),
            redirect_stderr(messages) if name == "check" else nullcontext(),
        ):
            outcomes.append(call())
        logs += [json.loads(printed.getvalue())] if printed.getvalue() else []
        if name == "check":
            short = not outcomes[-1].code and EVERYTHING not in options
            print_stderr(f"`{path.as_posix()}` is as approved\n" if short else messages.getvalue(), end="")
    if logs and log is not None:
        from postproc.report.sarif import merged

        write(log, json.dumps(merged(logs), indent=1) + "\n")
    if name == "check":
        for line in verdict_lines(programs, outcomes[: len(programs)], len(gone)):
            say(line)
    return max(outcome.code for outcome in outcomes)


def _refuse_output(path: Path, folder: Path) -> None:
    """Raise CLI016, exit code 1: an approved output has no program in the folder."""
    help_ = "take the approved output out with its program"
    text = f"the program of `{path.as_posix()}` is not in `{folder.as_posix()}`"
    raise PostprocError([Diagnostic("CLI016", "error", text, Source(path.as_posix(), b""), help=help_)], FINDINGS)


def _in_folder(folders: dict[str, Path]) -> list[Path]:
    """Return all programs of the folder ``--programs``.

    Args:
        folders: the options of this script, by name.

    Raises:
        PostprocError: CLI016, there is none.
    """
    folder = folders.get("--programs")
    if folder is None or not (programs := _below(folder)):
        where = "no program is named" if folder is None else f"there is no program in `{folder}`"
        raise PostprocError.of("CLI016", f"nothing is checked: {where}", help="name programs, or their folder")
    return programs


def _without_program(folders: dict[str, Path]) -> list[Path]:
    """Return the approved outputs whose programs are not in the folder ``--programs``."""
    folder, approved = folders.get("--programs"), folders.get("--approved")
    if folder is None or approved is None:
        return []
    names = {path.relative_to(folder) for path in _below(folder)}
    return [path for path in _below(approved) if path.relative_to(approved) not in names]


def _below(folder: Path | None) -> list[Path]:
    """Return the programs below a folder, sorted, without what a batch keeps for itself; none for None."""
    if folder is None:
        return []
    every = (path for path in folder.rglob("*") if IGNORED_FOLDERS.isdisjoint(path.relative_to(folder).parts))
    return sorted(path for path in every if path.suffix.lower() in MODULE_SUFFIXES and path.is_file())


def _command(name: str, program: Path, folders: dict[str, Path]) -> list[str]:
    """Return the words of the postproc command for one program, with its approved output if there is a folder of these.

    Args:
        name: ``check``, ``diff`` or ``read``. folders: the options of this script, by name.
    """
    inside, folder = Path(program.name), folders.get("--programs")
    if folder is not None:
        if not program.absolute().is_relative_to(folder.absolute()):
            text = f"`{program}` is not in the folder `{folder}`"
            raise PostprocError.of("CLI016", text, help="name the folder that all programs stand in")
        inside = program.absolute().relative_to(folder.absolute())
    approved = [str(folders["--approved"] / inside)] if "--approved" in folders else []
    if name == "check":
        return ["compensate", str(program), "--check", *(["-o", *approved] if approved else [])]
    return ["diff", *approved, str(program)] if name == "diff" else ["inspect", str(program)]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
