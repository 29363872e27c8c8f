"""What the check of many programs says in the end: which are not as approved, and which lack something else."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from postproc.cli.run import Outcome


def verdict_lines(programs: Sequence[Path], outcomes: Sequence[Outcome], gone: int) -> Iterator[str]:
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
