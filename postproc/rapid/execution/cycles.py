"""What a routine finds when a controller runs it again: the values that the cycle before has left."""

from __future__ import annotations

from contextlib import suppress

from postproc.rapid.evaluation.assign import differing, forget, joined, present
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.execution.abstract_interpreter import MAX_TRIALS, AbstractInterpreter
from postproc.rapid.execution.path_splitting import SplitBranches
from postproc.rapid.syntax.nodes import Routine
from postproc.rapid.unknown import Kind, Unknown, unknown_part

CALIBRATED = frozenset({"tooldata", "wobjdata", "loaddata"})
"""Types of data that routines of a cell measure."""


def start_cycle(run: AbstractInterpreter, routine: Routine, memory: Memory) -> None:
    """Make data unknown that a routine, started again when it has ended, does not find as at its first start.

    Variables and persistents keep their values from cycle to cycle; what instructions set is taken to be as at the
    start (RAPID overview, 3HAC050947, initialization of data objects). Data named by ``--taught`` is as in its file.

    Args:
        memory: before the first start, changed here.
    """
    names, steps, choices = run.program.names, run.steps, run.choices
    run.choices = SplitBranches()  # the next cycle may take another arm
    keys = {key for key in run.changes.of_routine[routine.key] if key in names}
    keys = {key for key in keys if not memory.teaching.covers(names[key])}
    for _ in range(MAX_TRIALS if keys else 0):
        cycle = memory.trial_copy()
        before = present(cycle, keys)
        for key in keys - memory.changed.keys():
            with suppress(Unknown):
                before[key] = memory.declared(names[key]).data
        for declaration in routine.declarations:
            cycle.initialise(declaration)
        reached, exits = run.body(routine.body, cycle), cycle.frame.exits
        paths = [*([cycle.changed] if reached else ()), *(e.changed for e in exits if e.goes_on)]
        if not paths:
            break  # it never ends
        cycle.changed = joined(paths, run.program)
        written = keys & cycle.changed.keys()
        changed = {key: unknown_part(cycle.changed[key]) for key in differing(before, present(cycle, written))}
        # A tool or a frame that is measured anew is about as it was.
        changed = {k: why for k, why in changed.items() if names[k].type not in CALIBRATED or not _measures(why, k)}
        if not changed:
            break
        forget(memory, (key for key, why in changed.items() if why is None), Kind.CHANGED_BY_CYCLE)
        memory.changed |= {key: why for key, why in changed.items() if why is not None}
    else:
        forget(memory, keys, Kind.CHANGED_BY_CYCLE)
    run.steps, run.choices = steps, choices


def _measures(why: Unknown | None, key: str) -> bool:
    """Return whether data is unknown as a search has found it, or as code outside of the files may have written it."""
    if why is None or why.kind is Kind.SEARCH_RESULT:
        return why is not None
    return why.kind is Kind.MAY_BE_WRITTEN and why.key == key
