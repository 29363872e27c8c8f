"""Which declarations may be edited in place: those that serve only as targets of motion statements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from postproc.compensate.values import StatementKey, key_of
from postproc.rapid.events import MotionEvent
from postproc.rapid.program import Program
from postproc.rapid.uses import declaration_uses


@dataclass(frozen=True, slots=True)
class Users:
    """Motion statements that use a declaration: as a target by itself, or inside Offs, RelTool and the like."""

    plain: frozenset[StatementKey]
    derived: frozenset[StatementKey]


def target_users(program: Program) -> Mapping[str, Users]:
    """Users of each declaration that serves for nothing but targets; declarations that serve for more are missing."""
    result = {}
    for key, uses in declaration_uses(program).items():
        kinds: dict[str, set[StatementKey]] = {"motion": set(), "expression": set()}
        for use in uses:
            if use.kind not in kinds or use.statement is None or use.role not in ("to", "via"):
                break
            kinds[use.kind].add(key_of(use.statement))
        else:
            result[key] = Users(frozenset(kinds["motion"]), frozenset(kinds["expression"]))
    return result


def fully_wished(events: Sequence[MotionEvent], wished: Sequence[int]) -> frozenset[StatementKey]:
    """Statements of which every execution has a corrected value."""
    have = set(wished)
    complete: dict[StatementKey, bool] = {}
    for index, event in enumerate(events):
        key = key_of(event.statement)
        complete[key] = complete.get(key, True) and index in have
    return frozenset(key for key, all_of_it in complete.items() if all_of_it)
