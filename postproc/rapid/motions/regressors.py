"""The numbers by which one execution of a statement differs from another: what its displacement may go with."""

from __future__ import annotations

import re
from collections.abc import Iterator

from postproc.rapid.data.events import MotionStatement, Origin
from postproc.rapid.evaluation.evaluate import evaluate, names_in
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.syntax.expressions import read_whole_expression
from postproc.rapid.syntax.tokens import identifiers
from postproc.rapid.syntax.trees import Call, Component, Expression, Index, Name, Number
from postproc.rapid.unknown import Unknown

Term = tuple[str, Expression]
Numbers = tuple[tuple[str, float], ...]
DATA_NAME = re.compile(r"[A-Za-z_]\w*(?:\{[\w+*/, -]*\}|\.\w+)*")


def named_numbers(statement: MotionStatement, origin: Origin, memory: Memory) -> Numbers:
    """Numbers that tell this execution of a statement from others, each with the RAPID expression that gives it.

    They are num variables, parameters and loop indices at hand, the amounts of ``Offs`` or ``RelTool``, the coordinates
    of the target's variable, of its work object and of the program displacement. For an array element they are its
    coordinates alone; there are none if all executions go to one place.
    """
    frames = [*_frames(statement, memory)]
    terms: list[Term] = []
    if origin.kind == "expression" or origin.handed is not None or frames:
        terms += _words(statement, memory)
    elif origin.kind != "element":
        return ()
    if "to" not in statement.roles:
        return ()
    data = statement.source.data
    for written in (data[slice(*statement.span_of("to"))], *frames):
        try:
            terms += _terms(read_whole_expression(written, 0, len(written)), written, memory)
        except Unknown:
            continue
    numbers = {}
    for text, tree in terms:
        try:
            value = evaluate(tree, memory.aside())
        except Unknown:
            continue
        if value.type == "num" and isinstance(value.data, float):
            numbers[text] = value.data
    return tuple(numbers.items())


def _frames(statement: MotionStatement, memory: Memory) -> Iterator[bytes]:
    """RAPID expressions of the frames whose pose may differ between executions.

    They are the program displacement, where the program sets it, and user and object frame of a work object that the
    program writes or that is a parameter.
    """
    if "@pdisp" in memory.changes.everything:
        yield b"C_PROGDISP.pdisp"
    if (wobj := statement.argument("\\wobj")) is not None:
        declaration = memory.find(wobj.text.lower())
        if wobj.text.lower() in memory.frame.bindings or (
            declaration is not None and declaration.key in memory.changes.everything
        ):
            yield from (f"{wobj.text}.{frame}".encode("latin-1") for frame in ("uframe", "oframe"))


def _words(statement: MotionStatement, memory: Memory) -> Iterator[Term]:
    """Parameters, loop indices and num variables in the statement or bound in its routine, as (RAPID text, tree)."""
    for word in sorted(identifiers(statement.source.data[slice(*statement.span)]) | memory.frame.bindings.keys()):
        bound = memory.frame.bindings.get(word)
        declaration = memory.find(word) if bound is None else None
        if bound is not None or (
            declaration is not None and declaration.storage != "CONST" and declaration.type == "num"
        ):
            yield word, Name((0, 0), word, word)


def _terms(tree: Expression, data: bytes, memory: Memory) -> Iterator[Term]:
    """Numbers that place a target expression, as terms (RAPID text, tree): amounts of Offs and RelTool, coordinates.

    Args:
        data: the text of the tree, in which its spans count.
    """
    text = data[slice(*tree.span)].decode("latin-1")
    match tree:
        case Call(_, "offs" | "reltool", (base, *amounts), options):
            yield from _terms(base, data, memory)
            for part in (*amounts, *(value for _, value in options if value is not None)):
                words = data[slice(*part.span)].decode("latin-1")
                if not isinstance(part, Number) and _harmless(part, words, memory):
                    yield (words.lower() if isinstance(part, Name) else f"({words})"), part
        case Name() | Index() | Component() if _harmless(tree, text, memory):
            for axis in "xyz":
                place = Component(tree.span, Component(tree.span, tree, "trans"), axis)
                yield f"{text}.trans.{axis}", place


def _harmless(tree: Expression, text: str, memory: Memory) -> bool:
    """Whether an expression may be evaluated a second time: it is on one line and calls no routine of the program."""
    routines = (memory.program.routine(name, memory.frame.routine.module) for name in names_in(tree))
    return "\n" not in text and "!" not in text and not any(routines)
