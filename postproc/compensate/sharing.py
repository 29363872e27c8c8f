"""Which declarations may be edited in place: those that serve only as targets of motion statements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from postproc.compensate.values import StatementKey, key_of
from postproc.rapid.events import MotionEvent
from postproc.rapid.program import Program
from postproc.rapid.uses import declaration_uses


def target_users(program: Program) -> Mapping[str, frozenset[StatementKey]]:
    """Statements that use each declaration as a target; declarations that are used for anything else are missing."""
    result = {}
    for key, uses in declaration_uses(program).items():
        statements = [use.statement for use in uses if use.kind == "motion" and use.role in ("to", "via")]
        if len(statements) == len(uses):
            result[key] = frozenset(key_of(s) for s in statements if s is not None)
    return result


def fully_wished(
    events: Sequence[MotionEvent], wished: Sequence[tuple[int, str]]
) -> frozenset[tuple[StatementKey, str]]:
    """Statements and roles for which every execution has a corrected value."""
    have = set(wished)
    runs: dict[tuple[StatementKey, str], bool] = {}
    for index, event in enumerate(events):
        roles = ("to", "via") if event.via_origin is not None else ("to",)
        for role in roles:
            key = (key_of(event.statement), role)
            runs[key] = runs.get(key, True) and (index, role) in have
    return frozenset(key for key, complete in runs.items() if complete)
