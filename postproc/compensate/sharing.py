"""What several may share: a declaration that serves only as target of motions, one correction for several runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array
from postproc.compensate.values import StatementKey, key_of
from postproc.rapid.events import MotionEvent
from postproc.rapid.program import Program
from postproc.rapid.uses import declaration_uses
from postproc.robot.pose import pose_error

SAME_GOAL = 1e-9  # [m], [rad]: runs of a statement that are programmed to one place


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


def shared_middles(runs: Sequence[Sequence[int]], T_goal: Array, T_corrected: Array) -> dict[int, Array]:
    """The correction (6,) in the middle of what the runs of a statement ask for, by run, where one can serve them all.

    That is where all are programmed to one place and the middle takes more than half of the smallest correction off
    (runs that arrive with another speed, or from another side): left alone, each would keep all of it.

    Args:
        runs: rows of each statement; T_goal, T_corrected: (m, 4, 4) programmed and corrected poses.
    """
    found: dict[int, Array] = {}
    for rows in map(list, runs):
        if np.abs(pose_error(np.broadcast_to(T_goal[rows[0]], (len(rows), 4, 4)), T_goal[rows])).max() > SAME_GOAL:
            continue
        shift = pose_error(T_goal[rows], T_corrected[rows])
        middle = (shift.min(axis=0) + shift.max(axis=0)) / 2
        stays = np.linalg.norm((shift - middle)[:, :3], axis=1).max()
        if stays < np.linalg.norm(shift[:, :3], axis=1).min() / 2:
            found |= dict.fromkeys(rows, middle)
    return found
