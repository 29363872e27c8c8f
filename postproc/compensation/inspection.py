"""What a program moves: one row for each motion statement, with the posture of the arm there and what is in the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array
from postproc.compensation.options import Options
from postproc.compensation.text.values import Place, StatementOutcome
from postproc.diagnostics import Diagnostic, Matter, Source
from postproc.motion.path.moves import read_moves
from postproc.motion.path.nominal_arm import NominalArm
from postproc.motion.path.places import place_events
from postproc.motion.path.samples import sample_path
from postproc.motion.postures import Nearest, nearest_to, posture_notes, singular_postures
from postproc.motion.values import Move, mounts_of
from postproc.rapid.data.events import MotionEvent, MotionStatement, executions_of
from postproc.rapid.data.records import NO_AXES, NO_AXIS
from postproc.rapid.execution.measured import say_measured
from postproc.rapid.execution.walk import forgiven, walk_program
from postproc.rapid.program.program import read_program
from postproc.robot.arm import Robot
from postproc.robot.cells.cell import LETTERS
from postproc.robot.cells.station import Station
from postproc.robot.configuration import confdata
from postproc.robot.kinematics import forward

STATIONARY = "stationary tool: the robot carries the work object"


@dataclass(frozen=True, slots=True)
class Row:
    """What a program does at one motion statement.

    Args:
        statement: as it is in the text.
        runs: how often it is executed, as far as known.
        tool, wobj: their names.
        payload_mass: tool and grip load [kg].
        position_mm: (3,) goal of the TCP in base axes, q_deg: (6,) posture there; None where not known.
        notes: a stationary tool, near a joint limit, near a singularity.
        reason: why the statement would stay as it is, None where it would be corrected.
        edited: kind of place where its new target would be written, None where that is not known.
        confdata: of that posture; None where not known, and for arms whose wrist is not spherical.
        external_axes: positions that its target states, mm or degrees by letter.
    """

    statement: MotionStatement
    runs: int
    tool: str
    wobj: str
    payload_mass: float
    position_mm: Array | None
    q_deg: Array | None
    notes: tuple[str, ...]
    reason: str | None
    edited: Place | None = None
    confdata: tuple[int, ...] | None = None
    external_axes: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Inspection:
    """What a program moves.

    Args:
        rows: one for each motion statement.
        diagnostics: all findings.
        start: the row of the first motion whose posture is known; None if there is none.
        nearest: to joint limits and singularities, over the whole way.
    """

    rows: tuple[Row, ...]
    diagnostics: tuple[Diagnostic, ...]
    start: Row | None = None
    nearest: tuple[Nearest, ...] = ()

    def decided(self, outcomes: Sequence[StatementOutcome], findings: Sequence[Diagnostic] = ()) -> Inspection:
        """The inspection with the decisions of a compensation for each statement added to its rows.

        Findings about what concerns the controller (RUN007, KIN018) are added, too. If there are outcomes, errors about
        ways that the arm cannot follow become warnings, since only those statements stay uncorrected.

        Args:
            outcomes: of the compensation.
            findings: of the compensation.
        """
        decisions = {outcome.statement.key: outcome for outcome in outcomes}
        rows = []
        for row in self.rows:
            outcome = decisions.get(row.statement.key)
            if outcome is None:
                rows.append(row)
                continue
            stays = outcome.status == "skipped" and outcome.statement.interpolation not in ("absjoint", "none")
            reason = row.reason or (outcome.reason if stays else None)
            rows.append(replace(row, edited=outcome.edited, reason=reason))
        diagnostics = [forgiven(d) if outcomes and d.matter is Matter.UNFOLLOWABLE else d for d in self.diagnostics]
        diagnostics += [d for d in findings if d.matter is Matter.CONTROLLER]
        return replace(self, rows=tuple(rows), diagnostics=tuple(diagnostics))


Postures = tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_]]
"""The arm at the goals of n moves: joint angles (n, 6) [rad], the TCP (n, 3) in base axes [m], whether arm and wrist
are singular (n, 2), and whether the tool is stationary (n,)."""


def inspect_program(
    sources: Sequence[Source] | Source, robot: Robot, options: Options = Options(), station: Station | None = None
) -> Inspection:
    """Read a program, follow its execution, and find the posture of the arm at every target and between them.

    Args:
        sources: the files of the task; files that are only read along get no rows.
        options: those that say how the program is read.
        station: where the arm stands, and its external axes.
    """
    program = read_program(sources, options.taught, NominalArm(robot, station or Station()))
    followed = walk_program(program)
    events = place_events(followed.events, station or Station())
    moves, unreachable = read_moves(robot, events, options.free_axes, station)
    path, on_the_way = sample_path(robot, moves) if moves else (None, [])
    at = {move.row: i for i, move in enumerate(moves)}
    postures = _postures(robot, moves)
    runs = executions_of(events)
    rows = [
        _row(statement, events, executions, _chosen(postures, [at[i] for i in executions if i in at]), robot)
        for statement in program.statements
        if not statement.source.read_only
        for executions in [runs.get(statement.key, [])]
    ]
    measured = say_measured(program, followed.events)
    findings = (*program.diagnostics, *followed.diagnostics, *measured.values(), *unreachable, *on_the_way)
    first = moves[0].event.statement.key if moves else None
    start = next((row for row in rows if row.statement.key == first), None)
    return Inspection(tuple(rows), findings, start, () if path is None else nearest_to(robot, path))


def _postures(robot: Robot, moves: Sequence[Move]) -> Postures:
    """The postures of the arm at the goals of moves."""
    q = np.array([move.q for move in moves]).reshape(-1, 6)
    if not moves:
        return q, np.zeros((0, 3)), np.zeros((0, 2), dtype=bool), np.zeros(0, dtype=bool)
    mounts = mounts_of(moves)
    position = mounts.base_tcp(mounts.work(forward(robot, q)))[:, :3, 3]
    return q, position, singular_postures(robot, q), mounts.stationary


def _row(
    statement: MotionStatement,
    events: Sequence[MotionEvent],
    executions: Sequence[int],
    postures: Postures,
    robot: Robot,
) -> Row:
    """The row of one statement: the tool of its first execution, and the posture of the first that the arm can make.

    Args:
        executions: indices of its executions in ``events``.
        postures: at those executions that the arm can make.
    """
    if not executions:
        return Row(statement, 0, "", "", 0.0, None, None, (), "no known way of running the program comes here")
    q, position, singular, stationary = postures
    event, known = events[executions[0]], len(q) > 0
    conf = tuple(confdata(robot, q[:1])[0].tolist()) if known and robot.opw is not None else None
    stated = event.target.extax if event.target is not None else NO_AXES
    axes = {letter: axis for letter, axis in zip(LETTERS, stated, strict=True) if axis < NO_AXIS}
    return Row(
        statement,
        sum(events[i].way == 0 for i in executions),
        event.tool.name,
        event.wobj.name,
        event.tool.tload.mass + event.gripload.mass,
        position[0] * 1e3 if known else None,
        np.degrees(q[0]) if known else None,
        (STATIONARY,) * bool(stationary[:1].any()) + posture_notes(robot, q, singular) if known else (),
        _reason(event, known),
        confdata=conf,
        external_axes=axes,
    )


def _chosen(postures: Postures, rows: list[int]) -> Postures:
    """The postures of the chosen moves."""
    q, position, singular, stationary = postures
    return q[rows], position[rows], singular[rows], stationary[rows]


def _reason(event: MotionEvent, known: bool) -> str | None:
    """Why the statement would stay uncorrected, None if it would be corrected.

    Args:
        event: its first execution.
        known: the arm can make that motion.
    """
    if event.reason is not None:
        return event.reason
    if event.statement.interpolation == "absjoint":
        return "joint angles are taken as they are"
    if not known:
        return "the arm cannot run it as it is programmed: see the finding at this place"
    return None
