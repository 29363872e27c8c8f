"""Data that may hold where the arm has stood: what `CRobT` gives and what a search finds, wherever it is handed on.

Such a position holds the error of the arm already: the arm that is sent there comes there again.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import product

from postproc.diagnostics import Source, Span
from postproc.grouping import closure
from postproc.rapid.program.arguments import BY_REFERENCE, argument_name, paired, read_arguments
from postproc.rapid.program.late_binding import named_by_text
from postproc.rapid.program.program import Program, statements_of
from postproc.rapid.syntax.nodes import Routine, Statement
from postproc.rapid.syntax.tokens import names_at

ARM = "@arm"
STANDING_FUNCTIONS = frozenset({"crobt", "cpos", "cjointt"})
"""Functions that give where the arm stands."""
UNPLACED = frozenset({"bool", "string", "clock", "intnum", "signaldi", "signaldo", "switch"})
"""Types that hold no position and no part of one."""
_NO_PLACE = re.compile(rb"(?i)\.\s*(?:extax|robconf)\b")  # parts of a target that say nothing of where the TCP is
Flow = tuple[str, str]


class FromTheArm:
    """Finds the data, parameters and functions of a program that may hold a position where the arm has stood.

    It follows assignments, arguments and results from functions such as ``CRobT`` and from searches.

    Args:
        keys: of what may hold such a position.
    """

    def __init__(self, program: Program, giving: frozenset[str] = STANDING_FUNCTIONS) -> None:
        """Follow what the functions ``giving`` (lower-case names) and searches give through a program."""
        self.program, self.giving = program, giving
        into: dict[str, set[str]] = {}
        named = re.compile("|".join(sorted(giving)).encode(), re.IGNORECASE)
        some = any(named.search(s.data) for s in program.sources) or any(
            m.signature.results for m in program.statements
        )
        for routine in program.all_routines() if some else ():
            for source, target in self._flows(routine):
                into.setdefault(source, set()).add(target)
        self.keys = closure([ARM], lambda key: into.get(key, ()))

    def holds(self, source: Source, span: Span, module: str, routine: str) -> bool:
        """Whether a piece of text names data, a parameter or a function that may hold a position of the arm.

        That is a position where the arm has stood, or one found by a search, possibly passed on by assignments and
        calls.

        Args:
            source, span: file and place of the text; module, routine: names of those in which it stands.
        """
        scope = self.program.routine(routine, module)
        return bool(scope and self._keys(scope, source, span) & self.keys)

    def _keys(self, routine: Routine, source: Source, span: Span) -> set[str]:
        """Keys, as `_key` makes them, of all data, parameters and functions that a piece of text of a routine names."""
        keys = (self._key(routine, name) for name, _ in names_at(source, span))
        return {key for key in keys if key is not None}

    def _key(self, routine: Routine, name: str) -> str | None:
        """Key of the parameter, data or function that a name in a routine means; None if its type holds no position.

        The functions that give such a position have the key ``ARM``. Any other name that is not declared
        has None.
        """
        parameter = next((p for p in routine.parameters if p.name == name), None)
        if parameter is not None:
            return None if parameter.type.lower() in UNPLACED else routine.parameter_key(name)
        declared = self.program.declaration(name, routine.module, routine.name)
        if declared is not None:
            return None if declared.type.lower() in UNPLACED else declared.key
        called = self.program.routine(name, routine.module)
        if called is not None:
            return None if called.type.lower() in UNPLACED else f"{called.key}()"
        return ARM if name in self.giving else None

    def _flows(self, routine: Routine) -> Iterator[Flow]:
        """Pairs of keys (from, to) of data, parameters or functions between which a routine may pass a value."""
        source = routine.source
        for declaration in routine.declarations:
            if declaration.init is not None:
                yield from product(self._keys(routine, source, declaration.init), [declaration.key])
        for statement in statements_of(routine):
            yield from self._of_statement(routine, statement)

    def _of_statement(self, routine: Routine, statement: Statement) -> Iterator[Flow]:
        """Pairs of keys (from, to) of data between which one statement may pass a value.

        It may be a search, an assignment, a RETURN, a call, or have functions in its expressions.
        """
        source = routine.source
        motion = self.program.motion(source, statement)
        if motion is not None:
            for result in motion.results:
                yield from product([ARM], self._keys(routine, source, result.span))
            spans = [argument.span for argument in motion.arguments]
        elif statement.kind == "assign":
            target, value = statement.parts
            name = argument_name(source.data, target) if not _NO_PLACE.search(source.data, *target) else ""
            key = self._key(routine, name) if name else None
            yield from product(self._keys(routine, source, value), [key] if key else [])
            spans = [value]
        elif statement.kind == "return":
            spans = [span for span in statement.parts if span[0] < span[1]]
            for span in spans:
                yield from product(self._keys(routine, source, span), [f"{routine.key}()"])
        else:
            spans = [*statement.parts, *(c for branch in statement.branches for c in branch.conditions)]
        if statement.kind == "call" and motion is None:
            yield from self._of_call(routine, statement)
        for span in spans:
            yield from self._of_functions(routine, source, span)

    def _of_call(self, routine: Routine, statement: Statement) -> Iterator[Flow]:
        """Pairs of keys (from, to) between which a procedure call may pass a value.

        It goes from arguments to parameters, and back if passed by reference. ``GetDataVal`` and ``SetDataVal`` pass
        values from and to all data whose name they may compose.
        """
        source, word = routine.source, statement.word
        pieces = read_arguments(source.data, statement.span[0] + len(word), statement.span[1])
        called = self.program.routine(word, routine.module)
        for parameter, span in paired(called.parameters, pieces) if called is not None else ():
            handed, key = self._keys(routine, source, span), called.parameter_key(parameter.name) if called else ""
            yield from product(handed, [key])
            if parameter.mode.upper() in BY_REFERENCE:
                yield from product([key], handed)
        named = [d.key for d in named_by_text(statement, routine, self.program)]
        if named and len(pieces) > 1:
            other = self._keys(routine, source, pieces[1][1])
            yield from product(named, other) if word == "getdataval" else product(other, named)
        for _, span, _ in pieces:
            yield from self._of_functions(routine, source, span)

    def _of_functions(self, routine: Routine, source: Source, span: Span) -> Iterator[Flow]:
        """Pairs of keys (from, to) between which calls of the program's functions in an expression may pass a value.

        Everything named in the expression counts as an argument of each, and may be changed by parameters passed by
        reference.
        """
        names = dict(names_at(source, span))
        functions = [f for name in names if (f := self.program.routine(name, routine.module)) is not None]
        if not functions:
            return
        handed = self._keys(routine, source, span)
        for function in functions:
            for parameter in function.parameters:
                key = function.parameter_key(parameter.name)
                yield from product(handed, [key])
                if parameter.mode.upper() in BY_REFERENCE:
                    yield from product([key], handed - {f"{function.key}()"})
