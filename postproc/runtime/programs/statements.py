"""Statements whose targets are known only at run time, with the function that corrects them there."""

from __future__ import annotations

from postproc.rapid.data.builtins import FUNCTIONS
from postproc.rapid.data.events import Argument, MotionStatement
from postproc.rapid.evaluation.evaluate import names_in
from postproc.rapid.program.from_the_arm import STANDING_FUNCTIONS
from postproc.rapid.syntax.edits import Edit
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.trees import (
    Aggregate,
    Binary,
    Call,
    Component,
    Expression,
    Index,
    Name,
    Star,
    Unary,
)
from postproc.rapid.unknown import Unknown

CORRECTED, CORRECTED_CIRCLE = "ppCorrected", "ppCorrectedCirc"
POSITIONS = STANDING_FUNCTIONS | {"calcrobt"}
"""Functions that give where the arm stands, or stands with some joint angles."""
CORRECTING = frozenset({CORRECTED.lower(), CORRECTED_CIRCLE.lower()})
"""Functions that have corrected what they give."""
WELDING = ("start", "weld", "end")
"""Phases with the force of the process: where a seam starts, the target is that of what follows."""


class LeftAlone(Exception):
    """Raised where a statement's targets are not corrected by the run-time function; its text says why."""


def run_time_edits(motion: MotionStatement) -> tuple[Edit, ...]:
    r"""The edits that send the targets of a statement through the run-time function.

    ``p`` becomes ``ppCorrected(p,tool\WObj:=w)``, a circle point ``ppCorrectedCirc(c,p,tool\WObj:=w)``; with ``\Weld``
    while the arc burns.

    Returns:
        Two edits for each target, around it; none where the statement calls the function already.

    Raises:
        LeftAlone: the target is not in a work object, is where the arm stands, is hidden (``*``), or would be evaluated
            twice by a function that may have other effects; the tool is no data.
    """
    signature = motion.signature
    to, tool = motion.argument("to"), motion.argument("tool")
    if signature.why_not or signature.jointed or to is None or tool is None:
        raise LeftAlone(signature.why_not or "its target is not a place in a work object")
    if not isinstance(_tree(motion, tool), (Name, Index, Component)):
        raise LeftAlone("its tool is no name of data")
    end = _tree(motion, to)
    if isinstance(end, Call) and end.name in (CORRECTED.lower(), CORRECTED_CIRCLE.lower()):
        return ()
    _refuse(end)
    rest = "," + tool.text + _object(motion) + ("\\Weld" if signature.phase in WELDING else "") + _load(motion)
    edits = [*_around(to, CORRECTED, rest)]
    via = motion.argument("via")
    if via is not None:
        _refuse(_tree(motion, via))
        if not calls_in(end) <= FUNCTIONS.keys():
            raise LeftAlone("its end would be worked out twice, and the function that gives it may do more than that")
        edits = [*_around(via, CORRECTED_CIRCLE, f",{to.text}{rest}"), *edits]
    return tuple(edits)


def _around(argument: Argument, function: str, rest: str) -> tuple[Edit, Edit]:
    """The two edits that put a call of ``function`` around an argument; ``rest``: text of its further arguments."""
    start, end = argument.span
    return Edit(start, start, f"{function}(".encode()), Edit(end, end, f"{rest})".encode("latin-1"))


def _object(motion: MotionStatement) -> str:
    r"""The work object as the statement writes it, ``\WObj:=w`` or ``\WObj?w``; empty without one."""
    return _option(motion, "\\wobj", "\\WObj")


def _load(motion: MotionStatement) -> str:
    r"""The option ``\TLoad`` as the statement writes it, empty without one."""
    return _option(motion, "\\tload", "\\TLoad")


def _option(motion: MotionStatement, role: str, name: str) -> str:
    r"""An option with its value as the statement writes it, ``\Name:=value`` or ``\Name?value``; empty without one."""
    given = motion.argument(role)
    if given is None:
        return ""
    first, start = given.whole[0], given.span[0]
    sign = "?" if b"?" in motion.source.data[first:start] else ":="
    return f"{name}{sign}{given.text}"


def _tree(motion: MotionStatement, argument: Argument) -> Expression:
    """The syntax tree of an argument.

    Raises:
        LeftAlone: it is no expression that the reader knows.
    """
    try:
        return read_whole_expression(motion.source.data, *argument.span, what="the target")
    except Unknown:
        raise LeftAlone("its target is no expression that this reader knows") from None


def _refuse(tree: Expression) -> None:
    """Check a target expression.

    Raises:
        LeftAlone: it is ``*``, or calls a function that returns where the arm stands.
    """
    if isinstance(tree, Star):
        raise LeftAlone("the position is stored without a name (`*`)")
    if names_in(tree) & POSITIONS:
        raise LeftAlone("its target is where the arm stands, and that needs no correction")


def calls_in(tree: Expression) -> set[str]:
    """Names of the functions that an expression calls, lower case."""
    match tree:
        case Call(_, name, arguments, options):
            parts = [*arguments, *(value for _, value in options if value is not None)]
            return {name}.union(*map(calls_in, parts))
        case Index(_, base, items):
            return calls_in(base).union(*map(calls_in, items))
        case Component(_, base, _) | Unary(_, _, base):
            return calls_in(base)
        case Aggregate(_, items):
            return set().union(*map(calls_in, items))
        case Binary(_, _, left, right):
            return calls_in(left) | calls_in(right)
        case Name():
            return set()
        case _:
            return set()
