"""Arcs whose circle is known only with a point that stays as it is: corrected points beside that make another circle.

A start that lacks its correction c, a tenth of the way before a corrected circle point, carries the arc twice c beyond
its curve; nearer to it, any distance. Nothing of the kind happens where all three points are left, or the circle point
is laid on the circle through start and goal as they are written and the middle as it should be.
"""

from __future__ import annotations

from collections.abc import Set

import numpy as np

from postproc.arrays import Array
from postproc.compensation.correction.curve import Exact
from postproc.compensation.correction.placement import circle_gaps
from postproc.compensation.path.motion import Motion
from postproc.motion.path.curves import circle_through
from postproc.motion.path.samples import Samples
from postproc.rapid.data.events import StatementKey

BEHIND = "its circle begins where the arm stays as it is, nobody knows where: corrected points would make another one"
BEFORE = "the arc behind it stays as it is, and with a corrected start it would be another one"
WORSE_CIRCLE = 1.25
"""How much farther off an arc may be with a corrected start: a circle point in the middle makes 1.125 of it."""


def arcs_without_start(motion: Motion) -> dict[StatementKey, str]:
    """Arcs to leave uncorrected, with the reason: the goal of the motion before them, where they begin, is unknown."""
    return {
        move.event.statement.key: BEHIND
        for move in motion.moves
        if move.kind == "arc" and move.first and not move.event.first and move.resumes_from is None
    }


def spoiled_starts(motion: Motion, exact: Exact, stays: Set[int]) -> dict[StatementKey, str]:
    """Statements to leave uncorrected, with the reason: an arc that stays as it is begins at their target.

    They are left if their correction takes that arc more than 25 % farther off its commanded curve.

    Args:
        exact: correction at every sample, with all targets corrected.
        stays: indices of the moves that stay uncorrected.
    """
    samples = motion.samples
    spoiled: dict[StatementKey, str] = {}
    for i in sorted(i for i in stays if samples.curves.arc[i] and i - 1 not in stays):
        via = motion.moves[i].T_work_via
        if via is None or motion.moves[i].first:
            continue
        wanted = exact.T_work_tcp[samples.start[i] : samples.goal[i] + 1, :3, 3]
        goal = samples.T_work_tcp[samples.goal[i], :3, 3]
        starts = ends_of(samples, exact, i)[0], samples.curves.start[i]
        now, before = (circle_gaps(wanted, start, via[:3, 3], goal).max() for start in starts)
        if now > WORSE_CIRCLE * before:
            spoiled[motion.moves[i - 1].event.statement.key] = BEFORE
    return spoiled


def ends_of(samples: Samples, written: Exact, i: int) -> tuple[Array, Array]:
    """Start and goal (3,) [m] of move i in its own work frame, with the targets as they are written.

    Args:
        written: the correction with the targets that the text can have, from ``place_targets``.
    """
    ends = np.array([samples.start[i], samples.goal[i]])
    T = samples.mounts_at(ends).work(written.T_base_flange[[i - 1, i]])
    return T[0, :3, 3], T[1, :3, 3]


def circle_point(samples: Samples, written: Exact, i: int, u: float) -> Array:
    """Point (3,) [m] at fraction u of the circle through the written ends of arc i and its corrected middle.

    Args:
        written: the correction with the targets that the text can have, from ``place_targets``.
        u: fraction of the arc, 0 at its start and 1 at its goal.
    """
    start, goal = ends_of(samples, written, i)
    middle = written.T_work_tcp[(samples.start[i] + samples.goal[i]) // 2, :3, 3]
    center, radial, tangent, angle, _, _ = circle_through(start[None], middle[None], goal[None])
    return (center + np.cos(u * angle) * radial + np.sin(u * angle) * tangent)[0]
