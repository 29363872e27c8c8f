"""``python -m postproc.cli.hooks``: one command for each of many programs, as pre-commit and CI call it.

    python -m postproc.cli.hooks check|diff|read [OPTIONS] [--programs DIR] [--approved DIR] [--sarif FILE] [PROGRAM..]

``check`` asks whether ``compensate`` would write what is approved, ``diff`` compares a program with the approved one by
meaning, ``read`` inspects it. Without names it is every program below the folder, and every approved one must have its
program; also where a file is named that programs are corrected with: settings, a model, a system module. Other options
go to the command. Exit code: the largest of all programs; 2 where there is none. What ``check`` prints of a program
that is as approved is one line, with ``--verbose`` all.
"""

from __future__ import annotations

import io
import json
import sys
from argparse import SUPPRESS, ArgumentParser
from collections.abc import Iterator, Sequence
from contextlib import nullcontext, redirect_stderr, redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any

from postproc.cli.app import build
from postproc.cli.hook_files import below, chosen
from postproc.cli.output import check_outputs, write
from postproc.cli.printing import print_stderr, say
from postproc.cli.run import BAD_INPUT, EVERYTHING, FINDINGS, Outcome, guarded, run_command
from postproc.diagnostics import Diagnostic, PostprocError, Source


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
    options, programs, gone = chosen(words, folders)
    commands = [_command(name, program, folders) for program in programs]
    log = folders.get("--sarif") if name != "diff" else None
    check_outputs([*programs, *below(folders.get("--programs")), *below(folders.get("--approved"))], log)
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
        for line in _verdict_lines(programs, outcomes[: len(programs)], len(gone)):
            say(line)
    return max(outcome.code for outcome in outcomes)


def _verdict_lines(programs: Sequence[Path], outcomes: Sequence[Outcome], gone: int) -> Iterator[str]:
    """Yield what ``check`` says in the end: how many programs are not as approved, or lack something else.

    Args:
        outcomes: of the check of each program. gone: number of outputs without a program.
    """
    red = [(path.as_posix(), outcome) for path, outcome in zip(programs, outcomes, strict=True) if outcome.code]
    changed = [name for name, outcome in red if outcome.changes]
    lacking = [name for name, outcome in red if outcome.lacks]
    failed = [name for name, outcome in red if not (outcome.changes or outcome.lacks)]
    approve = "approve with `postproc batch`, or `compensate PROGRAM -o APPROVED`"
    kinds = [
        (changed, "not as approved", approve),
        (lacking, "without what `--require` asks", "an approval does not cure that; the line of each says what does"),
        (failed, "not converted", "their findings say why"),
    ]
    for names, what, cure in kinds:
        if names:
            yield f"{len(names)} of {len(programs)} programs are {what}: {', '.join(names)}; {cure}"
    if gone:
        yield f"{gone} approved output{'s have' if gone > 1 else ' has'} no program: take out what CLI016 names"
    if not red and not gone:
        yield f"all {len(programs)} are as approved"


def _refuse_output(path: Path, folder: Path) -> None:
    """Raise CLI016, exit code 1: an approved output has no program in the folder."""
    help_ = "take the approved output out with its program"
    text = f"the program of `{path.as_posix()}` is not in `{folder.as_posix()}`"
    raise PostprocError([Diagnostic("CLI016", "error", text, Source(path.as_posix(), b""), help=help_)], FINDINGS)


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
