"""The boundary between commands and the shell: findings, usage errors and internal errors become exit codes."""

from __future__ import annotations

import errno
import os
import re
import sys
import tempfile
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from postproc.cli.printing import STDIN, VERBOSE, print_document, say, show
from postproc.diagnostics import Diagnostic, PostprocError
from postproc.files import SPACE

if TYPE_CHECKING:
    from cyclopts import App

USAGE_MISTAKES = {
    r'"-?\d+,\d+" into float': "numbers have a decimal point: 0.01",
    r"(nothing takes `|Unknown option: )-?\d": "a list has commas and no spaces: 200,-200,-200",
    "Unknown option: --(check|diff)": "they belong to `postproc compensate` and `batch`; `postproc diff` compares",
    r"(?i)nothing takes .*\.(prg|modx?|sysx?)`": "`--with FILE` reads a second module, `postproc batch` takes several",
}
"""What is commonly meant by words that no command takes."""
OUTPUTS = ("-o", "--output", "--report", "--draft", "--rapid")
"""Options that name a file to write: ``-`` is none."""
EVERYTHING = "--verbose"
"""Every command takes it, wherever it stands."""
OK, FINDINGS, BAD_INPUT, INTERNAL, INTERRUPTED = 0, 1, 2, 70, 130


@dataclass(frozen=True)
class Outcome:
    """How a command ended, for who calls many of them.

    Args:
        code: its exit code. changes: with ``--check`` or ``--diff``, a file would change.
        lacks: what ``--require`` asks is not met.
    """

    code: int = OK
    changes: bool = False
    lacks: bool = False


def run(app: App, arguments: Sequence[str]) -> int:
    """Run one command and return its exit code."""
    return run_command(app, arguments).code


def run_command(app: App, arguments: Sequence[str]) -> Outcome:
    """Run one command and return how it ended.

    Exit codes: 0 done; 1 findings, would change, not safe; 2 bad usage or bad input; 70 internal error; 130 stopped
    with Ctrl-C.
    """
    words = [word for word in arguments if word != EVERYTHING]
    before = VERBOSE.set(len(words) < len(arguments))
    try:
        return guarded(lambda: _call(app, words), words)
    finally:
        VERBOSE.reset(before)


def guarded(work: Callable[[], object], arguments: Sequence[str]) -> Outcome:
    """Run a piece of work that returns how it ended, an exit code, or nothing; exceptions end it as `run_command` says.

    Args:
        arguments: the command line, which decides the form of an error.
    """
    try:
        result = work()
        sys.stdout.flush()
        return result if isinstance(result, Outcome) else Outcome(result if isinstance(result, int) else OK)
    except PostprocError as error:
        return Outcome(_fail(arguments, error))
    except BrokenPipeError:  # the reader of stdout has gone (``| head``)
        _close_stdout()
        return Outcome(FINDINGS)
    except KeyboardInterrupt:
        say("stopped; nothing was written")
        return Outcome(INTERRUPTED)
    except Exception as error:
        if isinstance(error, OSError) and error.filename is not None:  # no file of ours: the user named it
            text = f"cannot use `{os.fsdecode(error.filename)}`: {error.strerror}"
            return Outcome(_fail(arguments, PostprocError.of("CLI004", text, help="check the name and the rights")))
        if not (isinstance(error, OSError) and error.errno == errno.ENOSPC):
            return Outcome(internal_error(error))
        _close_stdout()
        show([Diagnostic("CLI008", "error", "cannot write to stdout: the disk is full", help=SPACE)])
        return Outcome(BAD_INPUT)


def _close_stdout() -> None:
    """Redirect stdout to nowhere, so that the interpreter does not fail when it flushes at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _call(app: App, arguments: Sequence[str]) -> object:
    """Call the command of a command line and return its result.

    Raises:
        PostprocError: CLI001, the command line cannot be understood.
    """
    from cyclopts import CycloptsError
    from cyclopts.exceptions import UnusedCliTokensError

    # A lone hyphen looks like an option to cyclopts (5.4), wherever it stands.
    before = ("", *arguments)
    words = [STDIN if a == "-" and b not in OUTPUTS else a for a, b in zip(arguments, before, strict=False)]
    try:
        return app(words)
    except CycloptsError as error:
        text = " ".join(str(error).split())
        if isinstance(error, UnusedCliTokensError):
            text = "nothing takes " + ", ".join(f"`{token}`" for token in error.unused_tokens or ())
        command = arguments[0] if arguments and arguments[0] in app else "COMMAND"
        usage = f"`postproc {command} --help` lists what is allowed"
        help_ = next((cure for mistake, cure in USAGE_MISTAKES.items() if re.search(mistake, text)), "")
        text = text.partition(" Did you mean")[0] if help_ else text
        raise PostprocError.of("CLI001", text, help=help_ or usage) from None


def internal_error(error: Exception) -> int:
    """Write the traceback to a file, print one line with its name, and return exit code 70."""
    with tempfile.NamedTemporaryFile(
        "w", prefix="postproc-", suffix=".txt", delete=False, encoding="utf-8", errors="backslashreplace"
    ) as file:
        file.write("".join(traceback.format_exception(error)))
    what = f"{type(error).__name__}: {error}".splitlines()[0]
    say(f"postproc: internal error ({what}); nothing was written; details in {file.name}")
    return INTERNAL


def _fail(arguments: Sequence[str], error: PostprocError) -> int:
    """Print an error's findings, also as a document where one is asked for, and return its exit code."""
    show(error.diagnostics)
    words = [word for argument in arguments for word in argument.split("=")]
    stated = next((form for option, form in pairwise(words) if option == "--format"), None)
    if (form := "json" if "--json" in words else stated) is not None:
        document = {"schema": "postproc/error/1", "diagnostics": [d.as_json() for d in error.diagnostics]}
        print_document(document, form)
    return error.exit_code
