"""Statements whose targets are known only at run time, with the function that corrects them there."""

from __future__ import annotations

from postproc.compensation.text.marks import CORRECTED, CORRECTED_CIRCLE, CORRECTING
from postproc.rapid.data.builtins import FUNCTIONS
from postproc.rapid.data.events import Argument, MotionStatement
from postproc.rapid.evaluation.evaluate import names_in
from postproc.rapid.program.from_the_arm import STANDING_FUNCTIONS
from postproc.rapid.syntax.expressions import read_full_expression
from postproc.rapid.syntax.spans import Edit
from postproc.rapid.syntax.trees import Call, Component, Expression, Index, Name, Star, nodes
from postproc.rapid.unknown import Unknown

POSITIONS = STANDING_FUNCTIONS | {"calcrobt"}
"""Functions that give where the arm stands, or stands with some joint angles."""
WELDING = ("start", "weld", "end")
"""Phases with the force of the process: where a seam starts, the target is that of what follows."""


def run_time_edits(motion: MotionStatement) -> tuple[Edit, ...] | None:
    r"""The edits that send the targets of a statement through the run-time function.

    ``p`` becomes ``ppCorrected(p,tool\WObj:=w)``, a circle point ``ppCorrectedCirc(c,p,tool\WObj:=w)``; with ``\Weld``
    while the arc burns.

    Returns:
        Two edits for each target, around it; none where the statement calls the function already. None if the targets
        must not be corrected: the instruction itself works out where it goes, the target is no place in a work object,
        is where the arm stands or is hidden (``*``), the tool is no data, or a function that may do more than give a
        target would run twice.
    """
    signature, to, via = motion.signature, motion.argument("to"), motion.argument("via")
    tool = motion.argument("tool")
    if signature.why_not or signature.jointed or to is None or tool is None:
        return None
    try:
        end, holder, middle = (_tree(motion, argument) for argument in (to, tool, via or to))
    except Unknown:
        return None
    if not isinstance(holder, (Name, Index, Component)):
        return None
    if isinstance(end, Call) and end.name in CORRECTING:
        return ()
    if any(isinstance(tree, Star) or names_in(tree) & POSITIONS for tree in (end, middle)):
        return None
    weld = "\\Weld" if signature.phase in WELDING else ""
    further = f",{tool.text}{_option(motion, 'WObj')}{weld}{_option(motion, 'TLoad')}"
    edits = _around(to, CORRECTED, further)
    if via is None:
        return edits
    called = {node.name for node in nodes(end) if isinstance(node, Call)}
    return (*_around(via, CORRECTED_CIRCLE, f",{to.text}{further}"), *edits) if called <= FUNCTIONS.keys() else None


def _around(argument: Argument, function: str, further: str) -> tuple[Edit, Edit]:
    """The two edits that put a call of a function around an argument; ``further``: text of its other arguments."""
    start, end = argument.span
    return Edit(start, start, f"{function}(".encode()), Edit(end, end, f"{further})".encode("latin-1"))


def _option(motion: MotionStatement, name: str) -> str:
    r"""An option with its value as the statement writes it, ``\Name:=value`` or ``\Name?value``; empty without one."""
    option = motion.argument(f"\\{name.lower()}")
    if option is None:
        return ""
    sign = "?" if b"?" in motion.source.data[option.full_span[0] : option.span[0]] else ":="
    return f"\\{name}{sign}{option.text}"


def _tree(motion: MotionStatement, argument: Argument) -> Expression:
    """The syntax tree of an argument; raises ``Unknown`` where it is no expression that the reader knows."""
    return read_full_expression(motion.source.data, *argument.span, what="the target")
