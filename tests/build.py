"""What tests of every room ask of the product: small programs through the whole conversion, and what is refused."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
import pytest

from postproc.compensation.conversion import Conversion
from postproc.compensation.options import Options
from postproc.compensation.text.values import StatementOutcome
from postproc.diagnostics import Diagnostic, PostprocError, Source
from postproc.model.arm import Model
from postproc.model.file import default_model
from postproc.motion.path.moves import read_moves
from postproc.motion.path.samples import sample_path
from postproc.motion.timing.trajectory import Trajectory, retime
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import RobTarget
from postproc.rapid.execution.walk import walk
from postproc.rapid.program.program import read_program
from postproc.runtime.passes import correct_program
from tests.independent.arm import ARMS
from tests.independent.verify import Report, check

FORCE = (200.0, -200.0, -200.0)
AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
DATA = """  PERS tooldata tT:=[TRUE,[[0,0,350],[1,0,0,0]],[5,[0,0,120],[1,0,0,0],0,0,0]];
  PERS tooldata tLong:=[TRUE,[[0,0,410],[1,0,0,0]],[9,[0,0,160],[1,0,0,0],0,0,0]];
  PERS wobjdata wT:=[FALSE,TRUE,"",[[1000,-300,500],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS seamdata sm:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.3,[0,0,22,6.5,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.5];
  PERS welddata wd:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  PERS weavedata wv:=[1,0,3,2,0,0,0,0,0,0,0,0,0,0,0];
  PERS trackdata tr:=[0,FALSE,0,[0,0,0,0,0,0,0,0,0],[0,0,0,0,0,0,0]];
"""


def target(x: float, y: float, z: float = 700, conf: Sequence[int] = (-1, 0, -1, 0)) -> str:
    """A robtarget with a torch that points down and outwards, text as a pendant writes it."""
    numbers = ",".join(f"{v:g}" for v in (x, y, z))
    return f"[[{numbers}],[0.300294,-0.015738,0.95241,0.049914],[{','.join(map(str, conf))}],{AXES}]"


def module(data: str, body: str, more: str = "") -> str:
    """A module with tools and weld data, declarations, a main routine and further routines."""
    lines = "".join(f"  {line.strip()}\n" for line in data.strip().splitlines())
    steps = "".join(f"    {line.strip()}\n" for line in body.strip().splitlines())
    return f"MODULE M\n{DATA}{lines}  PROC main()\n{steps}  ENDPROC\n{more}ENDMODULE\n"


@cache
def arm() -> Model:
    return default_model()


def convert(text: str | bytes, model: Model | None = None, more: Sequence[Source] = (), **options: Any) -> Conversion:
    """The conversion of a program and of further files under the force of the study.

    Unless asked for it is without inertia, and with 0.01 mm on all motions.
    """
    data = text.encode("latin-1") if isinstance(text, str) else text
    near = options.get("tolerance_m", 1e-5)
    chosen = Options(**{"force": FORCE, "inertia": False, "tolerance_m": near, "air_tolerance_m": near, **options})
    return correct_program([Source("m.mod", data), *more], model or arm(), chosen)


def written(conversion: Conversion) -> str:
    assert conversion.output is not None, [d.message for d in conversion.diagnostics]
    return conversion.output.decode("latin-1")


def lines_of(text: str) -> list[str]:
    """Lines without their indentation; a statement that was broken into several is one."""
    return [line.strip() for line in re.sub(r"(?<=,)\n\s*(?=[^\s[])|\n\s*(?=[+-])", "", text).splitlines()]


def body_of(text: str) -> list[str]:
    """Statements between PROC main and ENDPROC."""
    lines = lines_of(text)
    first = lines.index("PROC main()") + 1
    return lines[first : lines.index("ENDPROC", first)]


def events(text: str) -> list[MotionEvent]:
    return list(walk(read_program([Source("m.mod", text.encode("latin-1"))])))


def timed(text: str) -> Trajectory:
    """The programmed path with its time."""
    found, robot = events(text), arm().robot
    return retime(robot, sample_path(robot, read_moves(robot, found)[0])[0])


def places(text: str) -> list[tuple[float, float, float]]:
    """Positions [mm] of the targets in the order in which they run."""
    return [e.target.trans for e in events(text) if isinstance(e.target, RobTarget)]


def outcome(conversion: Conversion, number: int) -> StatementOutcome:
    """Outcome of the n-th motion statement of the text."""
    return conversion.outcomes[number]


def codes(conversion: Conversion) -> list[str]:
    return [d.code for d in conversion.diagnostics]


def independent(text: str, conversion: Conversion, force: Sequence[float] = FORCE, **how: Any) -> Report:
    """What another reader and another arm find along the whole way of the written program."""
    return check(text, written(conversion), ARMS["irb4600_60_205"](), np.array(force), **how)


def refused(call: Callable[[], object]) -> Sequence[Diagnostic]:
    """Findings of what must be refused."""
    with pytest.raises(PostprocError) as caught:
        call()
    return caught.value.diagnostics
