"""Generated programs written as people do."""

from __future__ import annotations

import numpy as np

from tests.independent import arm as A
from tests.independent import paths as P
from tests.independent import rapid as R
from tests.independent.generate_programs import inside


def complicate(text: str, seed: int, geometry: str = "irb4600_60_205") -> str:
    """``_complicated`` with a displacement, or without where the displaced program could not run as it says."""
    other = _complicated(text, seed, displaced=True)
    legs = P.play(A.ARMS[geometry](), R.motions(other)[0], 0.02)
    if any(leg.problem or leg.conf_wrong for leg in legs) or not all(inside(A.ARMS[geometry](), leg.q) for leg in legs):
        return _complicated(text, seed, displaced=False)
    return other


def _complicated(text: str, seed: int, displaced: bool) -> str:
    """The same motion written as people do: broken lines, two statements a line, remarks, calls in loops, loads, displacements."""
    g = np.random.default_rng(seed + 10**6)
    eol = "\r\n" if "\r\n" in text else "\n"
    lines = text.split(eol)
    start = next(i for i, line in enumerate(lines) if "PROC main" in line)
    moves = [
        i
        for i in range(start, len(lines))
        if R.MOVES.match(lines[i].strip()) and not lines[i].strip().startswith("MoveAbsJ")
    ]
    for i in moves:
        u = g.random()
        if u < 0.08:
            head, _, tail = lines[i].rpartition(",")
            lines[i] = head + "," + eol + "          " + tail
        elif u < 0.16:
            lines[i] += " ! na\xeft p\xe5 svets"
        elif u < 0.22:
            lines[i] += " WaitTime 0;"
    if g.random() < 0.3:
        at = next(i for i, line in enumerate(lines) if "tooldata" in line)
        lines.insert(at, "  CONST loaddata loadPart:=[3.5,[20,0,60],[1,0,0,0],0,0,0];")
        at = next(i for i, line in enumerate(lines) if "PROC main" in line)
        lines.insert(at + 1, "    GripLoad loadPart;")
    if g.random() < 0.3 and displaced:
        at = next(i for i, line in enumerate(lines) if "tooldata" in line)
        lines.insert(at, "  CONST pose peShift:=[[4,-3,6],[1,0,0,0]];")
        at = next(i for i, line in enumerate(lines) if "PROC main" in line)
        lines.insert(at + 2, "    PDispSet peShift;")
    if g.random() < 0.4:
        for i, line in enumerate(lines):
            if line.strip() == "rSeam1;":
                pad = line[: len(line) - len(line.lstrip())]
                lines[i] = eol.join([pad + "FOR i FROM 1 TO 2 DO", pad + "  rSeam1;", pad + "ENDFOR"])
                break
    if g.random() < 0.4:
        at = next(i for i, line in enumerate(lines) if "PROC main" in line)
        lines.insert(
            at + 1, '    TPErase; TPWrite "weld; start!";' + eol + "    IF DOutput(doReady)=0 SetDO doReady, 1;"
        )
    return eol.join(lines)
