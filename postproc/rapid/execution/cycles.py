"""What a routine finds when a controller runs it again: the values that the cycle before has left."""

from __future__ import annotations

from contextlib import suppress

from postproc.rapid.evaluation.assign import differing, forget, joined, present
from postproc.rapid.evaluation.memory import Memory
from postproc.rapid.execution.abstract_interpreter import MAX_TRIALS, AbstractInterpreter
from postproc.rapid.execution.path_splitting import SplitBranches
from postproc.rapid.syntax.nodes import Routine
from postproc.rapid.unknown import Kind, PartlyUnknown, Unknown, unknown_part

CALIBRATED = frozenset({"tooldata", "wobjdata", "loaddata"})
"""Types of data that routines of a cell measure."""
LASTING = frozenset({"@gripload", "@pdisp", "@eoffs"})
"""State that is in force until it is set anew: payload, program displacement, offset of external axes."""


def start_cycle(run: AbstractInterpreter, routine: Routine, memory: Memory) -> None:
    """Make data unknown that a routine, started again when it has ended, does not find as at its first start.

    Variables and persistents keep their values from cycle to cycle, and variables get their initial ones where the
    program pointer is moved to main (RAPID overview, 3HAC050947, initialization of data objects; RobotStudio developer
    documentation, RAPID data). A payload or a displacement remains until it is set anew (RAPID reference manual,
    PDispOn: "until some other program displacement is activated"); of a cycle that leaves it changed it is not known
    what the next one begins with. All else that instructions set is taken to be as at the start. Data named by
    ``--taught`` is as in its file.

    Args:
        memory: before the first start, changed here.
    """
    names, steps, choices = run.program.names, run.steps, run.choices
    run.choices = SplitBranches()  # the next cycle may take another arm
    written = run.changes.of_routine[routine.key]
    keys = {key for key in written if key in names and not memory.teaching.covers(names[key])} | written & LASTING
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
        now = present(cycle, keys & cycle.changed.keys())
        open_ = {key for key, data in before.items() if isinstance(data, Unknown) and type(data) is not PartlyUnknown}
        changed = {key: unknown_part(cycle.changed[key]) for key in differing(before, now) - open_}
        # A tool or a frame that is measured anew is about as it was.
        # Loops put back what they grip and displace; a trial does not tell that.
        changed = {k: why for k, why in changed.items() if k not in LASTING or not _in_loop(why)}
        measured = {key for key in changed.keys() & names.keys() if names[key].type in CALIBRATED}
        changed = {key: why for key, why in changed.items() if key not in measured or not _measures(why, key)}
        if not changed:
            break
        forget(memory, (key for key, why in changed.items() if why is None), Kind.CHANGED_BY_CYCLE)
        memory.changed |= {key: why for key, why in changed.items() if why is not None}
    else:
        forget(memory, keys, Kind.CHANGED_BY_CYCLE)
    run.steps, run.choices = steps, choices


def _in_loop(why: Unknown | None) -> bool:
    """Return whether state is unknown as a loop of unknown turns sets it."""
    return why is not None and why.root.kind is Kind.CHANGED_IN_LOOP


def _measures(why: Unknown | None, key: str) -> bool:
    """Return whether data is unknown as a search has found it, or as code outside of the files may have written it."""
    if why is None or why.kind is Kind.SEARCH_RESULT:
        return why is not None
    return why.kind is Kind.MAY_BE_WRITTEN and why.key == key
