"""How much of a correction is one rigid shift of a work object, and the path without it.

A work object that the arm's own torch has taught holds the error of the arm at the places that were touched: what is
stated in it comes out right up to the part of the error that differs from place to place. The rigid motion

    x' = c + d + (x - c) + w x (x - c)        (Kabsch 1976, for small angles; c: centre of the targets)

that fits the corrections of the work object's targets best is that common part. It is fitted to the corrections of the
arm at rest without process force, as it stands while a frame is taught. A correction that leaves it out aims at the
path moved by the inverse of that motion: there the arm brings the torch by itself, up to the rest.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from postproc.arrays import Array, invert
from postproc.compensation.correction.curve import shifted
from postproc.compensation.correction.inverse import command
from postproc.compensation.path.motion import Motion
from postproc.diagnostics import Diagnostic, did_you_mean, joined
from postproc.grouping import grouped
from postproc.model.arm import Model
from postproc.motion.path.samples import Samples
from postproc.motion.values import Index
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import WobjData
from postproc.rapid.motions.units import object_matrix
from postproc.rapid.program.program import Program, names_of
from postproc.robot.pose import displace, pose_error

EVERY = "all"  # in place of names: all work objects were taught with this arm
WORLD = "wobj0"  # the base or the world of the arm: nobody teaches it
FEWEST = 3  # places of which a rigid motion does not hold nearly all, whatever their corrections are
LEVER = 0.05  # share of the farthest spread of the targets below which they say nothing of a turn about that axis
UNTAUGHT = f"`{WORLD}` is the base or the world of the arm, which nobody teaches"
_MOST_TARGETS = 500  # targets of a work object that are asked
_COORDINATE = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


@dataclass(frozen=True, slots=True, eq=False)
class RigidShift:
    """The rigid motion that fits the corrections of the targets of one work object best, in its own axes.

    Args:
        wobj: name of the work object.
        center: (3,) mean place of the targets that were fitted [m], about which the turn is.
        shift: (3,) translation there [m]. turn: (3,) rotation vector [rad].
        residual: largest distance [m] of a correction, under the loads of the program, from that motion.
        omitted: the motion is no part of what is corrected.
        at_welds: the targets of its welds were fitted, as it welds there; else all its targets.
        robot_holds: the robot holds it, and the tool stands. places: number of places that were fitted.
        moves: (k,) indices of the moves to its targets. fitted: (f,) those of them that were fitted.
        T_work_wobj: (4, 4) the work object in the work frame.
    """

    wobj: str
    center: Array
    shift: Array
    turn: Array
    residual: float
    omitted: bool
    at_welds: bool
    robot_holds: bool
    places: int
    moves: Index
    fitted: Index
    T_work_wobj: Array

    @property
    def motion(self) -> Array:
        """T (4, 4) in the work frame: a pose x [m] becomes T x."""
        about = np.eye(4)
        about[:3, 3] = self.center
        about_origin = about @ displace(np.concatenate([self.shift, self.turn])) @ invert(about)
        return self.T_work_wobj @ about_origin @ invert(self.T_work_wobj)


def remainder_unknown(shifts: Sequence[RigidShift]) -> list[str]:
    """Names of work objects that are left out and whose places are too few to tell what remains beside the shift.

    A rigid motion follows any corrections of two places but for their distance. Where it welds, only welds count.
    """
    counted = [shift for shift in shifts if shift.at_welds] or shifts
    return list(dict.fromkeys(shift.wobj for shift in counted if shift.omitted and shift.places < FEWEST))


def fit_rigid(points: Array, shifts: Array) -> tuple[Array, Array, Array]:
    """Centre (3,), translation (3,) and rotation vector (3,) that fit small shifts of points best, by least squares.

    A turn is fitted about axes from which the points lie far enough (``LEVER``): none for a single point, none about
    the line for points on a line.

    Args:
        points: (n, 3) places [m], at least one. shifts: (n, 3) how far each is moved [m].
    """
    center, mean = points.mean(axis=0), shifts.mean(axis=0)
    x = points - center
    # Normal equations of sum |mean + w x x_i - shift_i|^2 in w.
    spread = np.eye(3) * np.sum(x * x) - x.T @ x
    moment = np.cross(x, shifts - mean).sum(axis=0)
    squares, axes = np.linalg.eigh(spread)
    far = squares > LEVER**2 * max(squares.max(), len(x) * 1e-12)
    along = np.where(far, axes.T @ moment / np.where(far, squares, 1.0), 0.0)
    return center, mean, axes @ along


def fit_shifts(model: Model, motion: Motion, program: Program, taught: Sequence[str] = ()) -> tuple[RigidShift, ...]:
    """The rigid motion in the corrections of each work object, of the arm at rest without process force.

    Where it welds in a work object, the targets of its welds are fitted, else all. The rest is 0 until `with_rests`.

    Args:
        taught: names of work objects whose motion is left out, in any case; ``all`` for every one but `WORLD`.
    """
    to_leave_out = {name.lower() for name in taught}
    name_of = _names_of_objects(program)
    frames = {now: object_matrix(now.wobj).tobytes() for now in {m.event.in_force for m in motion.moves}}
    placed = [
        ((name_of(m.event), m.frame, m.stationary, frames[m.event.in_force]), i)
        for i, m in enumerate(motion.moves)
        if m.T_work_tcp is not None and m.resumes_from is None
    ]
    shifts = []
    # A target of a weld: the arc burns on the way to it, or from there.
    burns = np.array([move.welding for move in motion.moves], dtype=bool)
    goes_on = np.array([not move.starts_chain for move in motion.moves], dtype=bool)
    welds = burns | np.append(burns[1:] & goes_on[1:], False)
    for (name, _, robot_holds, _), members in grouped(placed).items():
        moves = np.array(members)
        at_welds = bool(welds[moves].any())
        fitted = moves[welds[moves]] if at_welds else moves
        T_work_wobj = object_matrix(motion.moves[members[0]].event.wobj)
        omitted = name.lower() != WORLD and not to_leave_out.isdisjoint((EVERY, name.lower()))
        spread = _spread_out(motion.samples, fitted)
        poses = _standing(model, motion, spread)
        points, ends = ((invert(T_work_wobj) @ T)[:, :3, 3] for T in poses)
        center, d, w = fit_rigid(points, ends - points)
        fit_of = at_welds, robot_holds, len(spread)
        shifts.append(RigidShift(name, center, d, w, 0.0, omitted, *fit_of, moves, fitted, T_work_wobj))
    return tuple(shifts)


def with_rests(shifts: Sequence[RigidShift], samples: Samples, T_base_flange: Array) -> tuple[RigidShift, ...]:
    """The shifts with how far the corrections of their fitted targets are from them, at most.

    Args:
        samples: of the path as programmed.
        T_base_flange: (m, 4, 4) commanded flange at every goal; where a shift is left out, it is no part of it.
    """
    commanded = samples.curves.mounts.work(T_base_flange)[:, :3, 3]
    completed = []
    for shift in shifts:
        T_goal = samples.T_work_tcp[samples.goal[shift.fitted]]
        rigid = T_goal if shift.omitted else shift.motion @ T_goal
        away = np.linalg.norm(commanded[shift.fitted] - rigid[:, :3, 3], axis=1)
        completed.append(replace(shift, residual=float(away.max(initial=0.0))))
    return tuple(completed)


def leave_out(samples: Samples, shifts: Sequence[RigidShift]) -> Samples | None:
    """The samples of the path that is meant where some shifts are left out: moved by their inverses; None without any.

    A line from one work object to another leads from the moved start to the moved goal.

    Args:
        samples: of the path as programmed.
    """
    if not any(shift.omitted for shift in shifts):
        return None
    m, curves = len(samples.moves), samples.curves
    G = np.tile(np.eye(4), (m, 1, 1))
    for shift in shifts:
        if shift.omitted:
            G[shift.moves] = invert(shift.motion)
    for i, move in enumerate(samples.moves):
        if move.resumes_from is not None:
            G[i] = G[move.resumes_from]
    T_goal = samples.T_work_tcp[samples.goal]
    T_goal_meant = G @ T_goal
    first = np.array([move.starts_chain for move in samples.moves])
    before = np.where(first, np.arange(m), np.maximum(np.arange(m) - 1, 0))
    T_flange = curves.mounts.flange(T_goal_meant)
    T_start = samples.T_work_tcp[samples.start]
    T_begins = samples.mounts_at(samples.start).work(T_flange[before])
    # Where the tool changes between two moves, the first one's flange carries the other tool to where it was.
    T_began = samples.mounts_at(samples.start).work(curves.mounts.flange(T_goal)[before])
    at_start, at_goal = pose_error(T_began, T_begins), pose_error(T_goal, T_goal_meant)
    at_start[first] = at_goal[first]
    u = samples.u[:, None]
    of = samples.move
    T = shifted(samples.T_work_tcp, (1.0 - u) * at_start[of] + u * at_goal[of])
    arcs = curves.arc[of]
    T[arcs] = G[of[arcs]] @ samples.T_work_tcp[arcs]
    start = T_start[:, :3, 3] + at_start[:, :3]
    arc = curves.arc
    R, p = G[:, :3, :3], G[:, :3, 3]
    start[arc] = (R @ curves.start[:, :, None])[arc, :, 0] + p[arc]
    chord = curves.chord + at_goal[:, :3] - at_start[:, :3]
    center, radial, tangent = ((R @ x[:, :, None])[:, :, 0] for x in (curves.center, curves.radial, curves.tangent))
    length = np.where(arc | curves.joint, curves.length, np.linalg.norm(chord, axis=1))
    moved = replace(
        curves, start=start, chord=chord, center=center + p, radial=radial, tangent=tangent, length=length
    )  # fmt: skip
    return replace(samples, curves=moved, T_work_tcp=T)


def _spread_out(samples: Samples, moves: Index) -> Index:
    """Of some moves those with different goals, each place once, evenly reduced to at most 500."""
    places = samples.T_work_tcp[samples.goal[moves], :3, 3].round(6)
    rows = moves[np.sort(np.unique(places, axis=0, return_index=True)[1])]
    fewest = min(len(rows), _MOST_TARGETS)
    return rows[np.linspace(0, len(rows) - 1, fewest).round().astype(int)]


def _standing(model: Model, motion: Motion, moves: Index) -> tuple[Array, Array]:
    """T_work_tcp (k, 4, 4) of the goals of moves as programmed, and as commanded to an arm at rest without a force."""
    alone = replace(motion.options, force=(0.0, 0.0, 0.0), moment=(0.0, 0.0, 0.0), inertia=False)
    sides = None if motion.sides is None else np.zeros_like(motion.sides)
    still = replace(motion, options=alone, moving=False, sides=sides)
    goals = motion.samples.goal[moves]
    T, mounts = motion.samples.T_work_tcp[goals], motion.samples.mounts_at(goals)
    return T, mounts.seen(command(model, still.at(goals), mounts.base_tcp(T)).T_base_tcp, T)


def _names_of_objects(program: Program) -> Callable[[MotionEvent], str]:
    """A function that returns the name of a motion's work object, also where a routine has it as its parameter.

    It is as written if that is data, else that of the one work object with the same numbers.
    """
    declared = [
        (d.name, np.array([float(n) for n in _COORDINATE.findall(d.source.data[slice(*d.init)])]))
        for d in program.declarations
        if d.type.lower() == "wobjdata" and d.init is not None and not d.routine
    ]

    @cache
    def name(module: str, routine: str, wobj: WobjData) -> str:
        """The name of a work object in that routine."""
        inside = program.routine(routine, module)
        if inside is None or wobj.name.lower() not in names_of(inside):
            declaration = program.declaration(wobj.name, module)
            return wobj.name if declaration is None else declaration.name
        numbers = np.array([*wobj.uframe.trans, *wobj.uframe.rot, *wobj.oframe.trans, *wobj.oframe.rot])
        same = [name for name, n in declared if n.shape == numbers.shape and np.allclose(n, numbers, atol=1e-4)]
        return same[0] if len(same) == 1 else wobj.name

    return lambda event: name(event.statement.module, event.statement.routine, event.wobj)


def not_taught(taught: Sequence[str], shifts: Sequence[RigidShift], program: Program) -> Iterator[Diagnostic]:
    """CMP026, a warning, for each name of ``--wobj-taught`` that nobody teaches, or in which no target is known.

    Args:
        taught: names as the user states them.
    """
    known = list(dict.fromkeys(shift.wobj for shift in shifts if shift.wobj.lower() != WORLD))
    listed = joined([f"`{other}`" for other in known])
    for name in taught:
        if name.lower() not in {EVERY, *map(str.lower, known)}:
            text = f"no target of the program is known in a work object `{name}`: nothing is left out for it"
            help_ = did_you_mean(name, known) or f"its targets are in {listed or f'`{WORLD}`'}"
            if name.lower() == WORLD:
                text, help_ = f"{UNTAUGHT}: nothing is left out for it", "take the name out of `wobj_taught`"
            yield Diagnostic("CMP026", "warning", text, program.sources[0], help=help_)
