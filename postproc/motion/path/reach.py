"""Whose fault it is that targets cannot be reached: the target's, its displacement's, or that of another arm."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

from postproc.diagnostics import Diagnostic
from postproc.motion.path.weights import in_metres
from postproc.rapid.data.events import MotionEvent, StatementKey
from postproc.rapid.data.records import Pose, RobTarget
from postproc.robot.arm import Robot

Reached = Sequence[tuple[MotionEvent, str | None]]
"""Runs of the program, and the code of what keeps the arm from making one."""
FEW = 3
"""Targets that fail before their program is doubted as a whole."""


def only_displaced(runs: Reached) -> frozenset[StatementKey]:
    """Statements that are out of reach only because their target or work is displaced in some or all of their runs.

    They either succeed in another run, or never fail with a written target without displacement. If no statement of the
    program can be run, the set is empty.

    Args:
        runs: executions, each with the code of the finding that keeps the arm from making it, or None.
    """
    run = {e.statement.key for e, code in runs if code is None and isinstance(e.target, RobTarget)}
    lost = {e.statement.key for e, code in runs if code is not None}
    taught = {e.statement.key for e, code in runs if code is not None and _as_taught(e)}
    return frozenset(lost & run | lost - taught if run else ())


def _as_taught(e: MotionEvent) -> bool:
    """Whether the target is written in the program as numbers or a name, and no program displacement is in force."""
    return e.target_origin.kind != "expression" and e.displacement == Pose()


def another_arm(robot: Robot, runs: Reached) -> list[Diagnostic]:
    """KIN009 if more than half of the targets, and at least three, fail in every run: the program suits another arm.

    Each target counts once, however many statements lead there. If at least half of those that fail do so only by their
    configuration, the finding says that instead, since another arm would not explain it.

    Args:
        runs: executions, each with the code of the finding that keeps the arm from making it, or None.
    """
    if not any([code for _, code in runs]):
        return []
    targets: dict[Hashable, set[str | None]] = {}
    for e, code in runs:
        if not e.unreachable:
            targets.setdefault((e.target, e.wobj, e.tool, e.displacement), set()).add(code)
    failed = [codes for codes in targets.values() if None not in codes]
    if len(failed) < FEW or 2 * len(failed) <= len(targets):
        return []
    count = f"{len(failed)} of {len(targets)} targets"
    beyond = sum(codes != {"KIN002"} for codes in failed)
    if 2 * beyond <= len(failed):
        return [_odd_configurations(runs, count)]
    text = f"`{robot.name}` cannot reach {count} as they are"
    tiny = next(filter(None, (in_metres(e) for e, code in runs if code is not None)), "")
    if tiny:
        return [Diagnostic("KIN009", "error", f"{text}: {tiny}", help="RAPID states lengths in mm: are these metres?")]
    help_ = "name the arm with `--robot`: one of `postproc robots list`, or a file or URDF that describes it"
    return [Diagnostic("KIN009", "error", f"{text}: it hardly is their arm", help=help_)]


def _odd_configurations(runs: Reached, count: str) -> Diagnostic:
    """KIN009, an error: the targets can be reached, but not in the configurations that they state.

    Args:
        runs: executions, each with the code of the finding that keeps the arm from making it, or None.
        count: "n of m targets", for the message.
    """
    unset = all(isinstance(e.target, RobTarget) and not any(e.target.robconf) for e, code in runs if code is not None)
    if unset:
        text = f"the configurations of {count}, all [0,0,0,0], do not exist"
        help_ = (
            "where they were never set, begin with `ConfL\\Off` and `ConfJ\\Off`: the arm keeps the one it comes with"
        )
    else:
        text = f"{count} can be reached, but not in the configuration that they state"
        help_ = (
            "check where their confdata comes from; `ConfL\\Off` and `ConfJ\\Off` leave the choice to the controller"
        )
    return Diagnostic("KIN009", "error", text, help=help_)
