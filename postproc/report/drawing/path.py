"""The path of a converted program as numbers for its page: places, deviations, joints, targets and lines of text."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.arrays import Array, blocks, invert
from postproc.channels.state import State
from postproc.compensation.conversion import Conversion
from postproc.compensation.correction.deviation import Deviation, path_tangents
from postproc.compensation.plan import CorrectionPlan
from postproc.model.arm import Model
from postproc.model.deflection import Deflection
from postproc.model.loads import loaded_state
from postproc.motion.mounts import Mounts
from postproc.motion.path.curves import Curves, pose_at
from postproc.motion.values import Index
from postproc.report.blocks import Values
from postproc.report.drawing.columns import chain_of, exact, packed

MOST_POINTS = 60_000  # samples of a page; more than that are thinned, the largest deviations stay


@dataclass(frozen=True, slots=True)
class Places:
    """n places of the programmed path, those at which the deviation is known before or after.

    Args:
        move: (n,) index of the move, ascending; u: (n,) fraction of the move, from 0 to 1, ascending in each.
        before, after: (n, 3) deviation of the real TCP across the path [m], in work axes; on joint moves from the place
            at the same time.
    """

    move: Index
    u: Array
    before: Array
    after: Array


def path_data(conversion: Conversion) -> Values:
    """Return what the page draws of a conversion with a plan: encoded columns of numbers, targets and lines of text."""
    judged, model = conversion.judged, conversion.model
    assert judged is not None and model is not None
    plan, before, after = judged.plan, judged.before, judged.after
    assert plan is not None and before is not None and after is not None
    samples, timeline, moves = plan.motion.samples, plan.motion.timeline, plan.motion.moves
    curves, robot = samples.curves, model.robot
    places = _thinned(_places(curves, before, after))
    of, place, sampled = places.move, places.move + places.u, samples.move + samples.u
    q = _interpolated(sampled, samples.q, place)
    mounts = curves.mounts_at(of, curves.axes_at(of, places.u))
    length = np.cumsum(curves.length)
    speed = np.abs(timeline.at(timeline.v, place)) / robot.speed
    correction = _interpolated(sampled, plan.exact.q - samples.q, place)
    statements = {outcome.statement.key: i for i, outcome in enumerate(conversion.outcomes)}
    statement = np.array([statements.get(m.event.statement.key, -1) for m in moves])
    return {
        "places": {
            "move": exact(of),
            "t": exact(timeline.at(timeline.t, place)),
            "s": exact((length - curves.length)[of] + places.u * curves.length[of]),
            "p": exact(pose_at(robot, curves, of, places.u)[:, :3, 3]),
            "before": packed(1e3 * places.before),
            "after": packed(1e3 * places.after),
            "q": packed(q),
            "speed": packed(100 * speed),
            "torque": packed(_torques(model, plan, places, mounts, q)),
            "correction": packed(np.degrees(correction)),
        },
        "moves": {
            "statement": exact(statement),
            "space": exact(~curves.joint & (curves.length > 0)),
            "welding": exact(np.array([m.welding for m in moves])),
            "first": exact(np.array([m.starts_chain for m in moves])),
            "tolerance": packed(1e3 * plan.path_tolerance),
        },
        "largest": {w: _largest(d, statement, len(statements)) for w, d in (("before", before), ("after", after))},
        "targets": [outcome.statement.target for outcome in conversion.outcomes],
        "sources": _sources(conversion),
        # Where the arm stands in the frame of the work, which a track or a positioner moves.
        "base": None if mounts.T_base_frame is None else exact(invert(mounts.T_base_frame)[:, :3].reshape(len(of), 12)),
        # A stationary tool stands still, and the path is drawn on the work that the arm carries, without the arm.
        "arm": None if curves.mounts.stationary.any() else chain_of(robot, curves.mounts.T_mount_tcp),
    }


def _places(curves: Curves, before: Deviation, after: Deviation) -> Places:
    """Return each place where the deviation before or after correction is known; the other is interpolated there."""
    # Places are 2 move + u, which ascend along a path: the goal of a move differs from the next start.
    known = [(2.0 * d.owner + d.u, _across(curves, d)) for d in (before, after)]
    key = np.unique(np.round(np.concatenate([k for k, _ in known]), 5))
    columns = []
    for at, away in known:
        order = np.argsort(at, kind="stable")
        columns.append(_interpolated(at[order], away[order], key))
    move = (key // 2).astype(int)
    return Places(move, np.clip(key - 2 * move, 0.0, 1.0), columns[0], columns[1])


def _across(curves: Curves, deviation: Deviation) -> Array:
    """Return a deviation (n, 3) [m] without its component along the line or arc; on joint moves it is whole."""
    tangent = path_tangents(curves, deviation.owner, deviation.u)
    return np.asarray(deviation.away - deviation.parts[:, :1] * tangent)


def _thinned(places: Places) -> Places:
    """Return at most about 60,000 places: the ends of every move, the largest deviation of each, and others evenly."""
    n = len(places.move)
    if n <= MOST_POINTS:
        return places
    ends = np.append(True, np.diff(places.move) != 0) | np.append(np.diff(places.move) != 0, True)
    size = np.maximum(*(np.linalg.norm(d, axis=1) for d in (places.before, places.after)))
    order = np.lexsort((-size, places.move))
    largest = order[np.append(True, np.diff(places.move[order]) != 0)]
    keep = ends.copy()
    keep[largest] = True
    keep[:: -(-n // max(MOST_POINTS - int(keep.sum()), n // 20))] = True
    return Places(places.move[keep], places.u[keep], places.before[keep], places.after[keep])


def _interpolated(at: Array, values: Array, place: Array) -> Array:
    """Interpolate each column of values linearly.

    Args:
        at: (m,) ascending places of the rows of values (m, k). place: (n,) where they are wanted.

    Returns:
        (n, k).
    """
    return np.stack([np.interp(place, at, column) for column in values.T], axis=1)


def _torques(model: Model, plan: CorrectionPlan, places: Places, mounts: Mounts, q: Array) -> Array:
    """Return the motor torques (n, 6) [N m] of the rigid arm: links, payload, lasting acceleration and force.

    Args:
        mounts: poses of base, tool and work at the n places. q: (n, 6) joint angles there [rad].
    """
    rigid, motion = model.with_effects(), plan.motion
    timeline, moves = motion.timeline, motion.moves
    torque = np.empty((len(q), 6))
    for rows in blocks(len(q)):
        of = places.move[rows]
        place = of + places.u[rows]
        loaded = np.array([motion.options.force_on == "all" or moves[i].welding for i in of])
        state = State(
            q=q[rows],
            v=timeline.at(timeline.v, place),
            a=timeline.at(timeline.a, place),
            payload_mass=np.array([moves[i].payload_mass for i in of]),
            payload_center=np.array([moves[i].payload_center for i in of]),
            wrench=np.where(loaded[:, None], [*motion.options.force, *motion.options.moment], 0.0),
            T_flange_tcp=mounts[rows].T_mount_tcp,
            gravity=model.gravity,
            robot=model.robot,
        )
        unbent = Deflection(np.zeros((len(of), 6)), {}, None, None)
        load = loaded_state(rigid, state, unbent, ()).joint_load
        assert load is not None
        torque[rows] = -load
    return torque


def _largest(deviation: Deviation, statement: Index, count: int) -> Values:
    """Return, for each of ``count`` statements, the largest deviation [mm] on lines and arcs over all its runs.

    As in the figures it is that at steady speed; of a statement without any, the largest of all.

    Args:
        statement: index of the statement of each move, -1 for those of other files.
    """
    every, steady = np.full((2, count + 1), np.nan)
    for largest, rows in ((every, deviation.space), (steady, deviation.space & deviation.steady)):
        np.fmax.at(largest, statement[deviation.owner[rows]], 1e3 * deviation.across[rows])
    return packed(np.where(np.isnan(steady), every, steady)[:-1])


def _sources(conversion: Conversion) -> dict[str, list[str]]:
    """Return the lines of every file that may change, by its path."""
    sources = {o.statement.source.path: o.statement.source for o in conversion.outcomes}
    return {path: source.data.decode("latin-1").splitlines() for path, source in sources.items()}
