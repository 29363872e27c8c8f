"""What the check of many programs says in the end: which are not as approved, and which lack something else."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

_CHANGES = re.compile("(?m)^`.*` (would change|is not there and would be written)")
_LACKS = re.compile("(?m)^`--require (model|arm)`: ")
"""Lines of ``compensate --check`` on an output that would change, and on a requirement that is not met."""


def verdict_lines(programs: Sequence[Path], codes: Sequence[int], texts: Sequence[str], gone: int) -> Iterator[str]:
    """Yield what ``check`` says in the end: how many programs are not as approved, or lack something else.

    Args:
        codes, texts: exit code of each program and what was printed of it on stderr. gone: outputs without a program.
    """
    red = [(program.as_posix(), text) for program, code, text in zip(programs, codes, texts, strict=False) if code]
    changed = [name for name, text in red if _CHANGES.search(text)]
    lacking = [name for name, text in red if _LACKS.search(text)]
    failed = [name for name, _ in red if name not in {*changed, *lacking}]
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
