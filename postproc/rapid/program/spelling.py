"""What a name that stands in none of the files may be a misspelling of."""

from __future__ import annotations

import re
from collections.abc import Iterable

from postproc.diagnostics import did_you_mean
from postproc.rapid.data.builtins import PREDEFINED
from postproc.rapid.program.program import Program, statements_of

SURE_SIMILARITY = 0.8  # of two long names that mean different things, most letters are the same, too


def if_not(meant: str, otherwise: str) -> str:
    """Help text: the "did you mean" question (if any) followed by what to do otherwise.

    Args:
        meant: the question, or an empty text. otherwise: what to do, as an imperative clause.
    """
    return f"{meant} If not, {otherwise}" if meant else otherwise


def meant_name(name: str, known: Iterable[str]) -> str:
    """A "did you mean" question with the known name that is most similar, or an empty text.

    Names that differ in their digits alone, ``p10`` and ``p20``, are no misspellings of each other.
    """
    stem = _without_digits(name)
    return did_you_mean(name, (other for other in known if _without_digits(other) != stem), cutoff=SURE_SIMILARITY)


def meant_data(program: Program, name: str, types: frozenset[str], module: str, routine: str) -> str:
    """A "did you mean" question with data that a routine sees and whose name is similar, or an empty text.

    Args:
        types: types that the data may have; any if empty.
        module, routine: names of the module and the routine that use the name.
    """
    of_type = (d for d in program.declarations if not types or d.type in types)
    seen = (d.name for d in of_type if program.declaration(d.name, module, routine) is not None)
    predefined = (n for n, (type_, _) in PREDEFINED.items() if not types or type_ in types)
    return meant_name(name, [*seen, *predefined])


def meant_routine(program: Program, name: str) -> str:
    """A "did you mean" question with a procedure that no statement calls by its name, or an empty text."""
    called = {s.word for r in program.all_routines() for s in statements_of(r) if s.kind == "call"}
    uncalled = (r for r in program.all_routines() if r.kind.upper() == "PROC" and r.name.lower() not in called)
    return meant_name(name, (r.name for r in uncalled))


def _without_digits(name: str) -> str:
    """The name in lower case with 0 in place of every number."""
    return re.sub(r"\d+", "0", name.lower())
