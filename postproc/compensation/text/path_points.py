"""Targets on a line or arc whose ends have names: calls of a function that is written into the program.

    MoveL ppLinePoint(pStart,pGoal,0.25,0.012,-0.03,0.007),v50,z1,tT;

goes to the point after a quarter of the line, displaced by the correction, wherever the ends are taught
(templates/line_point.j2, arc_point.j2). Orientation, configuration and external axes are those of the ends, too.
"""

from __future__ import annotations

import numpy as np

from postproc.arrays import Array
from postproc.compensation.text.values import Conf
from postproc.motion.path.curves import circle_through
from postproc.rapid.data.builtins import FUNCTIONS
from postproc.rapid.program.program import Program
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.tokens import identifiers
from postproc.rapid.syntax.trees import Call, Star, nodes
from postproc.rapid.unknown import Unknown

HIDDEN = "the program has a name of its own for `{}`, which a target between its ends needs"
SHARE_DECIMALS = 5
LINE_FUNCTION, ARC_FUNCTION = "ppLinePoint", "ppArcPoint"
# What the functions call and declare.
LINE_NAMES = ("Present", "Distance", "ATan2", "Sqrt", "Sin", "robtarget", "confdata", "orient", "pos", "num")
ARC_NAMES = (*LINE_NAMES, "DotProd", "Cos", "Abs")


def free_name(program: Program, name: str) -> str:
    """A name that no identifier of the program equals: ``name``, or ``name2``, ``name3``, .."""
    taken = set[str]().union(*(identifiers(source.data) for source in program.sources))
    return next(n for n in (name, *(f"{name}{k}" for k in range(2, 1000))) if n.lower() not in taken)


def hidden_name(program: Program, module: str, arc: bool) -> str | None:
    """Why a function that calculates a point of a line or arc cannot be written into a module, None if it can.

    The reason is a built-in name, needed by the function, that the program declares itself.

    Args:
        module: name of the module.
        arc: the point is on an arc, not on a line.
    """
    hidden = (name for name in (ARC_NAMES if arc else LINE_NAMES) if program.hides(name, module, ""))
    return next((HIDDEN.format(name) for name in hidden), None)


def argument_text(text: str, program: Program, module: str) -> str | None:
    """A target expression on one line for use in a call; None if evaluating it several times could have an effect.

    Args:
        text: the expression as it stands in the module.
    """
    text = " ".join(text.split())
    data = text.encode("latin-1")
    try:
        tree = read_whole_expression(data, 0, len(data)) if "!" not in text else None
    except Unknown:
        return None
    if tree is None or any(isinstance(part, Star) for part in nodes(tree)):
        return None
    called = [part.name for part in nodes(tree) if isinstance(part, Call)]
    pure = all(name in FUNCTIONS and program.routine(name, module) is None for name in called)
    return text if pure else None


def quarter_turns(start: Conf, conf: Conf) -> Conf | None:
    """Quarter turns of axes 1, 4 and 6 from one confdata to another, and 1 where axis 5 has the other sign.

    None where shoulder or elbow differ. They are the same for targets taught anew with the other wrist: axes 4 and 6 of
    the whole line are then half a turn on.
    """
    other = start[3] ^ conf[3]
    return (conf[0] - start[0], conf[1] - start[1], conf[2] - start[2], other) if other < 2 else None


def point_at(points: Array, share: float) -> Array:
    """(3,) point at a fraction of the line between two points (2, 3), or of the arc through three (3, 3)."""
    if len(points) < 3:
        along: Array = points[0] + share * (points[1] - points[0])
        return along
    start, via, goal = points[:, None]
    center, radial, tangent, angle, _, _ = circle_through(start, via, goal)
    along = (center + np.cos(share * angle) * radial + np.sin(share * angle) * tangent)[0]
    return along
