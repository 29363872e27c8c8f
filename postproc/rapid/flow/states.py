"""After which motions the arm may stand at a place of a program, and what may have been written since each of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from postproc.rapid.data.events import StatementKey

Writes = frozenset[str]
"""What may have been written: keys as of ``WriteEffects``, loop counters as ``#name``, and the marks below."""

State = Mapping[StatementKey, Writes]
"""Motion statements that may have been the last, and what may have been written since; nothing where no way leads."""

ANYWHERE: StatementKey = ("", -1)
ENTRY: StatementKey = ("", -2)  # where the arm stood when the routine was entered
NOTHING: Writes = frozenset()
LOST: State = {ANYWHERE: NOTHING}
FROM_CALLER: State = {ENTRY: NOTHING}

MOST_WAYS = 8  # by which a program comes to a place, that are told apart; of more the place counts as not known
MOST_WRITES = 64
ANYTHING: Writes = frozenset({"*"})  # very much may have been written
CALLED = "@call"  # parameters and data of routines are those of another call
REFERRED = "%*"  # some data that was handed over by reference


def joined(states: Iterable[State]) -> State:
    """The state where ways meet: all their motions, each with all that may be written since.

    ``LOST`` if one of them is, or if there are more than ``MOST_WAYS`` motions.
    """
    found: dict[StatementKey, Writes] = {}
    for state in states:
        if ANYWHERE in state:
            return LOST
        for key, writes in state.items():
            known = found.get(key)
            found[key] = writes if known is None or known == writes else bounded(known | writes)
        if len(found) > MOST_WAYS:
            return LOST
    return found


def written(state: State, keys: Writes) -> State:
    """The state after data of these keys may have been written.

    Args:
        keys: are added to what may have been written since each motion.
    """
    if not keys or ANYWHERE in state:
        return state
    return {key: since if keys <= since else bounded(since | keys) for key, since in state.items()}


def bounded(writes: Writes) -> Writes:
    """The given keys, or ``ANYTHING`` if there are more than ``MOST_WRITES``."""
    return ANYTHING if len(writes) > MOST_WRITES or "*" in writes else writes


def entered(state: State) -> State:
    """The state at the begin of a called routine, from the caller's state at the call.

    Keys of the caller's parameters and loop counters mean nothing there: see ``_across_call``.
    """
    return {key: bounded(_across_call(writes)) for key, writes in state.items()} if ANYWHERE not in state else LOST


def returned(before: State, exit_: State, keys: Writes) -> State:
    """The caller's state behind a call.

    Args:
        before: the caller's state at the call.
        exit_: state at the end of the called routine, in which ``ENTRY`` stands for where the arm was at the call.
        keys: what the call may write, by the names that hold in the caller.
    """
    found: list[State] = []
    for key, writes in exit_.items():
        if any(k[0] in "%" for k in writes):
            writes = _across_call(writes) | keys
        own = frozenset(k for k in writes if k != CALLED and k[0] != "#")
        if key == ENTRY:
            found.append(written(before, own))
        elif key == ANYWHERE:
            return LOST
        else:
            found.append({key: bounded(own | {CALLED})})
    return joined(found)


def substituted(state: State, entry: State) -> State:
    """The state with ``ENTRY`` replaced by the state ``entry`` in which the routine is entered."""
    if ENTRY not in state:
        return state
    rest = {key: writes for key, writes in state.items() if key != ENTRY}
    return joined([rest, written(entry, state[ENTRY])])


def _across_call(writes: Writes) -> Writes:
    """Keys by the names that hold in the other routine of a call (caller or called).

    Parameters and loop counters have no names there: ``CALLED`` stands for them, with ``REFERRED`` if parameters are
    written.
    """
    here = frozenset(k for k in writes if k[0] not in "%#")
    return here | {CALLED, REFERRED} if any(k[0] == "%" for k in writes) else here | {CALLED}
