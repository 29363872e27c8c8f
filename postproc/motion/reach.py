"""Whose fault it is that targets cannot be reached: the target's, its displacement's, or that of another arm."""

from __future__ import annotations

from collections.abc import Sequence

from postproc.diagnostics import Diagnostic
from postproc.motion.weights import in_metres
from postproc.rapid.program.events import MotionEvent, StatementKey
from postproc.rapid.program.records import Pose, RobTarget
from postproc.robot.arm import Robot

Reached = Sequence[tuple[MotionEvent, str | None]]
"""Runs of the program, and the code of what keeps the arm from making one."""


def only_displaced(runs: Reached) -> frozenset[StatementKey]:
    """Statements that the arm can run, but for what displaces their targets or the work in some or all of their runs.

    What a robtarget itself states has to exist; where a displacement carries it over a quadrant or a limit, that run
    alone is not possible. Of a program of which nothing can be run nothing is.
    """
    run = {e.statement.key for e, code in runs if code is None and isinstance(e.target, RobTarget)}
    lost = {e.statement.key for e, code in runs if code is not None}
    taught = {e.statement.key for e, code in runs if code is not None and _as_taught(e)}
    return frozenset(lost & run | lost - taught if run else ())


def _as_taught(e: MotionEvent) -> bool:
    return e.target_origin.kind != "expression" and e.displacement == Pose()


def another_arm(robot: Robot, runs: Reached) -> list[Diagnostic]:
    """KIN009 where many statements do not suit the arm in any run: the program is hardly made for it."""
    places: dict[StatementKey, bool] = {}
    for e, code in runs:
        if not e.loose:
            places[e.statement.key] = places.get(e.statement.key, True) and code is not None
    failed = sum(places.values())
    if failed < 3 or 10 * failed < len(places):
        return []
    unset = (isinstance(e.target, RobTarget) and not any(e.target.robconf) for e, code in runs if code is not None)
    if all(unset) and {code for _, code in runs} <= {"KIN002", None}:
        text = f"the configurations of {failed} of {len(places)} statements, all [0,0,0,0], do not exist"
        help_ = (
            "where they were never set, begin with `ConfL\\Off` and `ConfJ\\Off`: the arm keeps the one it comes with"
        )
        return [Diagnostic("KIN009", "error", text, help=help_)]
    text = f"`{robot.name}` cannot run {failed} of {len(places)} statements as they are"
    tiny = next(filter(None, (in_metres(e) for e, code in runs if code is not None)), "")
    if tiny:
        return [Diagnostic("KIN009", "error", f"{text}: {tiny}", help="RAPID states lengths in mm: are these metres?")]
    help_ = "name the arm with `--robot`: one of `postproc robots list`, or a file or URDF that describes it"
    return [Diagnostic("KIN009", "error", f"{text}: it hardly is their arm", help=help_)]
