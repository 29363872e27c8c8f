"""``python -m postproc.cli.hooks``: one command for each of many programs, as pre-commit and CI call it.

    python -m postproc.cli.hooks check|diff|read [OPTIONS] [--programs DIR] [--approved DIR] [--sarif FILE] [PROGRAM..]

``check`` asks whether ``compensate`` would write what is approved, ``diff`` compares a program with the approved one by
meaning, ``read`` inspects it. Without names it is every program below the folder, and every approved one must have its
program. Other options go to the command. Exit code: the largest of all programs; 2 where there is none.
"""

from __future__ import annotations

import io
import json
import sys
from argparse import SUPPRESS, ArgumentParser
from collections.abc import Sequence
from contextlib import nullcontext, redirect_stdout
from pathlib import Path
from typing import Any

from postproc.cli.app import build
from postproc.cli.output import check_outputs, write
from postproc.cli.printing import say
from postproc.cli.run import BAD_INPUT, guarded, run
from postproc.diagnostics import PostprocError
from postproc.rapid.program.program import ENDINGS

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

    return guarded(work, ())


def _every(name: str, folders: dict[str, Path], words: list[str]) -> int:
    """Run a command for each program, write the joint SARIF log if asked for, and return the largest exit code.

    Args:
        name: ``check``, ``diff`` or ``read``. folders: the options of this script, by name.
        words: options of the command, then programs; without these, all of the folder.
    """
    first = max((i + 1 for i, word in enumerate(words) if Path(word).suffix.lower() not in ENDINGS), default=0)
    options, programs = words[:first], [Path(word) for word in words[first:]]
    programs = programs or _in_folder(folders)
    commands = [_command(name, program, folders) for program in programs]
    log = folders.get("--sarif") if name != "diff" else None
    check_outputs([*programs, *_below(folders.get("--programs")), *_below(folders.get("--approved"))], log)
    logs: list[dict[str, Any]] = []
    codes, form = list[int](), [] if log is None else ["--format", "sarif"]
    for command in commands:
        printed = io.StringIO()
        with nullcontext() if log is None else redirect_stdout(printed):
            codes.append(run(build(), [*command, *options, *form]))
        logs += [json.loads(printed.getvalue())] if printed.getvalue() else []
    if logs and log is not None:
        from postproc.report.sarif import merged

        write(log, json.dumps(merged(logs), indent=1) + "\n")
    red = [program.as_posix() for program, code in zip(programs, codes, strict=True) if code]
    if name == "check":
        named = f": {', '.join(red)}; approve with `postproc batch`, or `compensate PROGRAM -o APPROVED`" if red else ""
        required = " or lack what `--require` asks" if any(word.startswith("--require") for word in options) else ""
        say(f"{len(red)} of {len(programs)} programs are not as approved{required}{named}")
    return max(codes)


def _in_folder(folders: dict[str, Path]) -> list[Path]:
    """Return all programs of the folder ``--programs``.

    Args:
        folders: the options of this script, by name.

    Raises:
        PostprocError: CLI016, there is none, or an approved output has no program any more.
    """
    folder, approved = folders.get("--programs"), folders.get("--approved")
    programs = _below(folder)
    if folder is None or not programs:
        where = "no program is named" if folder is None else f"there is no program in `{folder}`"
        raise PostprocError.of("CLI016", f"nothing is checked: {where}", help="name programs, or their folder")
    names = {path.relative_to(folder) for path in programs}
    if gone := [path for path in _below(approved) if approved and path.relative_to(approved) not in names]:
        text = f"the program of `{gone[0]}` is not in `{folder}`"
        raise PostprocError.of("CLI016", text, help="take the approved output out with its program")
    return programs


def _below(folder: Path | None) -> list[Path]:
    """Return the programs below a folder, sorted; none for None."""
    every = () if folder is None else folder.rglob("*")
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
