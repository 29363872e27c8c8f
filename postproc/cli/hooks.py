"""``python -m postproc.cli.hooks``: one command for each of many programs, as pre-commit and CI call it.

    python -m postproc.cli.hooks check|diff|read [OPTIONS] [--programs DIR] [--approved DIR] [--sarif FILE] PROGRAM..

``check`` asks whether ``compensate`` would write what is approved, ``diff`` compares a program with the approved one by
meaning, ``read`` inspects it. Other options go to the command. Exit code: the largest of all programs.
"""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from postproc.cli.app import build
from postproc.cli.report import say
from postproc.cli.run import BAD_INPUT, run
from postproc.rapid.program.program import ENDINGS

OWN = ("--programs", "--approved", "--sarif")


def main(arguments: Sequence[str]) -> int:
    """Run the command for each program and return the largest exit code."""
    own, rest = _own_options(arguments[1:])
    first = next((i for i in range(len(rest)) if _all_programs(rest[i:])), len(rest))
    options, programs = rest[:first], rest[first:]
    if not arguments or arguments[0] not in ("check", "diff", "read"):
        say((__doc__ or "").strip())
        return BAD_INPUT
    logs: list[dict[str, Any]] = []
    code = 0
    for program in programs:
        command = [*_command(arguments[0], program, own), *options]
        if "--sarif" in own and arguments[0] != "diff":
            printed = io.StringIO()
            with redirect_stdout(printed):
                code = max(code, run(build(), [*command, "--format", "sarif"]))
            logs.append(json.loads(printed.getvalue()))
        else:
            code = max(code, run(build(), command))
    if logs:
        joined = {**logs[0], "runs": [run_ for log in logs for run_ in log["runs"]]}
        Path(own["--sarif"]).write_text(json.dumps(joined, indent=1) + "\n", encoding="utf-8")
    return code


def _own_options(words: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    own, rest, at = dict[str, str](), list[str](), 0
    while at < len(words):
        if words[at] in OWN and at + 1 < len(words):
            own[words[at]] = words[at + 1]
            at += 1
        else:
            rest.append(words[at])
        at += 1
    return own, rest


def _all_programs(words: Sequence[str]) -> bool:
    """Whether all words are names of programs: what pre-commit puts behind the options."""
    return all(Path(word).suffix.lower() in ENDINGS for word in words)


def _command(name: str, program: str, own: dict[str, str]) -> list[str]:
    path = Path(program)
    inside = path.relative_to(own["--programs"]) if "--programs" in own else Path(path.name)
    approved = [str(Path(own["--approved"]) / inside)] if "--approved" in own else []
    if name == "check":
        return ["compensate", program, "--check", *(["-o", *approved] if approved else [])]
    return ["diff", *approved, program] if name == "diff" else ["inspect", program]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
