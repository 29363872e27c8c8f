"""What several may share: texts that serve only for targets of motions, one correction for several runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.compensate.values import StatementKey, key_of
from postproc.rapid.events import MotionEvent
from postproc.rapid.execution import MAX_CALLS
from postproc.rapid.program import Program
from postproc.rapid.uses import Use, declaration_uses


@dataclass(frozen=True, slots=True)
class Users:
    """Motion statements that use a declaration: as a target by itself, or inside Offs, RelTool and the like."""

    plain: frozenset[StatementKey]
    derived: frozenset[StatementKey]


def target_users(program: Program) -> Mapping[str, Users]:
    """Users of each declaration and parameter that serves for nothing but targets; what serves for more is missing.

    What a call hands over to a parameter is used by those who use the parameter.
    """
    uses = declaration_uses(program)
    found: dict[str, Users | None] = {}

    def users(key: str, depth: int) -> Users | None:
        if key not in found:
            found[key] = None  # of a routine that calls itself
            found[key] = joined(uses.get(key, ()), depth) if depth <= MAX_CALLS else None
        return found[key]

    def joined(parts: Iterable[Use], depth: int) -> Users | None:
        plain: set[StatementKey] = set()
        derived: set[StatementKey] = set()
        for use in parts:
            if use.handed and use.kind == "argument":
                more = users(use.handed, depth + 1)
                if more is None:
                    return None
                plain |= more.plain
                derived |= more.derived
            elif use.statement is None or use.kind not in ("motion", "expression") or use.role not in ("to", "via"):
                return None
            else:
                (plain if use.kind == "motion" else derived).add(key_of(use.statement))
        return Users(frozenset(plain), frozenset(derived))

    return {key: known for key in uses if (known := users(key, 0)) is not None}


def fully_wished(events: Sequence[MotionEvent], wished: Sequence[int]) -> frozenset[StatementKey]:
    """Statements of which every execution has a corrected value."""
    have = set(wished)
    complete: dict[StatementKey, bool] = {}
    for index, event in enumerate(events):
        key = key_of(event.statement)
        complete[key] = complete.get(key, True) and (index in have or event.again is not None)
    return frozenset(key for key, all_of_it in complete.items() if all_of_it)


def led_elsewhere(events: Sequence[MotionEvent], wished: Sequence[int]) -> frozenset[StatementKey]:
    """Statements that also run to a place that is not known, or to another one for which no value is asked."""
    have = set(wished)
    places = {(key_of(events[i].statement), events[i].target, events[i].via) for i in have}
    return frozenset(
        key_of(event.statement)
        for i, event in enumerate(events)
        if i not in have and event.again is None and (key_of(event.statement), event.target, event.via) not in places
    )


def shared_middles(counts: Sequence[int], shifts: Array) -> dict[int, Array]:
    """The correction (6,) in the middle of what the runs of a statement ask for, by row, where one can serve them all.

    That is where the middle takes more than half of the smallest correction off (runs that arrive at another speed or
    from another side, layers of a weld, displaced work): left alone, each would keep all of it.

    Args:
        counts: runs of each statement; shifts: (n, 6) what they ask for, one statement after the other, in the axes in
            which they share it.
    """
    found: dict[int, Array] = {}
    end = 0
    for count in counts:
        begin, end = end, end + count
        shift = shifts[begin:end]
        middle = (shift.min(axis=0) + shift.max(axis=0)) / 2
        stays = np.linalg.norm((shift - middle)[:, :3], axis=1).max()
        if stays < np.linalg.norm(shift[:, :3], axis=1).min() / 2:
            found |= dict.fromkeys(range(begin, end), middle)
    return found
