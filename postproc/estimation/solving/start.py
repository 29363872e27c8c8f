"""Where the instrument stands and what the tool is, before the first step of a fit.

Closed form, no guess from the user.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.effects.asking import displacement_of
from postproc.effects.base import Effect
from postproc.effects.registry import effect_in_role
from postproc.effects.roles import Role
from postproc.estimation.problem import Problem
from postproc.estimation.solving.setups import behind, with_setups
from postproc.measure.alignment import Alignment, align
from postproc.measure.checks.readings import CLEARER, SUSPICIOUS_M, PlacedArm
from postproc.measure.consensus import largest, reflector_points, sessions_of
from postproc.model.arm import Model

FEWEST_POSES_TO_PLACE = 4
"""Poses that place an instrument, and below which all rows of a pose count as one."""


def start_frames(problem: Problem) -> Problem:
    """Return the problem with all that says where things stand begun, instrument and tool first, set-ups last."""
    return with_setups(_start_frames(problem))


def _start_frames(problem: Problem) -> Problem:
    """Return the problem with null `instrument_frame` and `tool_frame` effects fitted to the nominal arm (closed form).

    Sessions in which the instrument stood elsewhere than in the first one get a frame of their own, in a `session`
    effect. So do reflectors of which the model does not know where they are on the tool, in a `reflector` effect.
    """
    problem = _with_work_objects(_with_reflectors(problem))
    data = problem.data
    rows = np.asarray(np.isfinite(data.position).all(axis=1))
    if data.state.session is None or problem.model.in_role(Role.INSTRUMENT_FRAME) is None:
        return _placed(problem, rows)
    session = data.state.session_of_rows
    first = np.asarray(rows & (session == session[np.argmax(rows)]))
    moved: dict[str, Alignment] = {}
    if first.sum() >= FEWEST_POSES_TO_PLACE:
        begun, names = _placed(problem, first), dict.fromkeys(session.tolist())
        places = {name: moved_instrument(begun, rows & (session == name)) for name in names}
        moved = {name: place for name, place in places.items() if place is not None}
    if not moved:
        return _placed(problem, rows)
    begun = _placed(problem, np.asarray(rows & ~np.isin(session, list(moved))))
    frame = begun.model.in_role(Role.INSTRUMENT_FRAME)
    assert frame is not None
    steps = _places_by_session(begun.model, Role.SESSION_FRAMES)
    steps |= {name: _vector(place) - frame.vector() for name, place in moved.items()}
    frames = _frames_of_sessions(Role.SESSION_FRAMES, steps)
    others = [e for e in begun.model.effects if e.role not in (Role.INSTRUMENT_FRAME, Role.SESSION_FRAMES)]
    # Frames come first: what does the same as they (joint 1) is not fitted.
    return begun.at([frame, frames, *others])


def reflectors_known(model: Model) -> dict[str, Array]:
    """Return the points (3,) [m] of the reflectors on the tool that a model has, by name, first that of the tool frame.

    They count from that one.
    """
    points = model.in_role(Role.REFLECTOR_POINTS)
    if points is None or points.is_null:
        return {}
    names = (*vars(points)["first"], *vars(points)["reflector"])
    return dict(zip(names, [np.zeros(3), *points.vector().reshape(-1, 3)], strict=True))


def _with_reflectors(problem: Problem) -> Problem:
    """Return the problem with a point on the tool for each of several reflectors (closed form, nominal arm)."""
    model, data = problem.model, problem.data
    names, known = data.state.reflector_of_rows, reflectors_known(model)
    rows = np.asarray(np.isfinite(data.position).all(axis=1))
    unknown = set(names[rows].tolist()) - set(known)
    if data.state.reflector is None or len(unknown) < (1 if known else 2):
        return problem
    fitted = reflector_points(_nominal_tool(problem)[rows], data.position[rows], names[rows], sessions_of(data)[rows])
    common = next((name for name in known if name in fitted), largest(names[rows]))
    shift = known.get(common, np.zeros(3)) - fitted[common]
    places = {name: point + shift for name, point in fitted.items()} | known
    first = next(iter(known), common)
    others = [name for name in places if name != first]
    new = effect_in_role(Role.REFLECTOR_POINTS).null(first=(first,), reflector=tuple(others))
    new = new.with_vector(np.concatenate([places[name] for name in others]))
    return behind(problem, new, Role.INSTRUMENT_FRAME, Role.TOOL_FRAME)


def _with_work_objects(problem: Problem) -> Problem:
    """Return the problem with a place for each work object that rows are stated in, first where the program says it is.

    The frame in which they all stand is that of the one with most rows, where nothing else places it.
    """
    model, data = problem.model, problem.data
    if data.T_frame_object is None or data.state.session is None:
        return problem
    stated, session = np.isfinite(data.T_frame_object).all(axis=(1, 2)), data.state.session_of_rows
    places = _places_by_session(model, Role.WORK_OBJECTS)
    free = np.isfinite(data.position).all(axis=1) & ~stated
    first = None if free.any() else largest(session[stated])
    new = [name for name in dict.fromkeys(session[stated].tolist()) if name != first and name not in places]
    if not new:
        return problem
    placed = _frames_of_sessions(Role.WORK_OBJECTS, places | dict.fromkeys(new, np.zeros(6)))
    return behind(problem, placed, Role.INSTRUMENT_FRAME, Role.TOOL_FRAME)


def _places_by_session(model: Model, role: Role) -> dict[str, Array]:
    """Return the translation [m] and rotation vector [rad] (6,) of each session that an effect of a role lists."""
    effect = model.in_role(role)
    if effect is None:
        return {}
    return dict(zip(vars(effect)["session"], np.hstack([*effect.vector().reshape(2, -1, 3)]), strict=True))


def _frames_of_sessions(role: Role, places: Mapping[str, Array]) -> Effect:
    """Return the effect of a role with the places (6,) of sessions, by name; the inverse of `_places_by_session`."""
    parts = np.array([*places.values()]).reshape(-1, 2, 3)
    return effect_in_role(role).null(session=tuple(places)).with_vector(np.swapaxes(parts, 0, 1).ravel())


def _nominal_tool(problem: Problem) -> Array:
    """Return (n, 4, 4) nominal poses of the tool [m] in the frame of the points."""
    data = problem.data
    T = PlacedArm(problem.model.robot, data.state.T_reference_base).flange(data.state.q)
    return np.asarray(T @ (data.state.T_flange_tcp if data.tool_known else problem.model.T_flange_tcp))


def moved_instrument(begun: Problem, rows: NDArray[np.bool_]) -> Alignment | None:
    """Return where the instrument stood for some rows; None unless that fits far better than where the model has it.

    The rows must lie over `SUSPICIOUS_M` off in the median, and `CLEARER` times nearer from the new place.

    Args:
        begun: the problem with the instrument where the model has it; rows: (n,) mask.
    """
    error = np.linalg.norm(begun.error[rows, :3], axis=1)
    if rows.sum() < FEWEST_POSES_TO_PLACE or np.median(error) < SUSPICIOUS_M:
        return None
    place = align(begun.equilibrium.T_reference_tcp[rows], begun.data.position[rows], tool=False)
    return place if place.typical < np.median(error) / CLEARER else None


def seen_from(problem: Problem, place: Alignment) -> Problem:
    """Return the problem with its instrument frame set to a place (position and orientation of the instrument)."""
    every = problem.model.effects
    return problem.at([e.with_vector(_vector(place)) if e.role is Role.INSTRUMENT_FRAME else e for e in every])


def _placed(problem: Problem, rows: NDArray[np.bool_]) -> Problem:
    """Return the problem with null instrument and tool frames fitted to the positions of some rows (closed form).

    It comes back unchanged where the model has no null instrument frame, or the rows are too few.

    Args:
        rows: (n,) mask.
    """
    model, data = problem.model, problem.data
    frame, tool = model.in_role(Role.INSTRUMENT_FRAME), model.in_role(Role.TOOL_FRAME)
    fresh = [e for e in (frame, tool) if e is not None and e.is_null]
    if not fresh or rows.sum() < FEWEST_POSES_TO_PLACE or frame is None or not frame.is_null:
        return problem
    T = _nominal_tool(problem)
    points = model.in_role(Role.REFLECTOR_POINTS)
    shift = None if points is None else displacement_of(points, data.state).tool
    measured = T.copy()
    if shift is not None:
        measured[:, :3, 3] += (T[:, :3, :3] @ shift[:, :3, None])[:, :, 0]
    free_tool = tool is not None and tool.is_null
    aligned = align(measured[rows], data.position[rows], tool=free_tool)
    new: dict[str, Effect] = {"instrument_frame": frame.with_vector(_vector(aligned))}
    if free_tool and tool is not None:
        turn = np.zeros(3)
        if data.rotation is not None:
            R = aligned.T_instrument_base[:3, :3]
            seen = (np.swapaxes(T[:, :3, :3], 1, 2) @ R.T @ data.rotation)[rows]
            good = np.isfinite(seen).all(axis=(1, 2))
            if good.any():
                turn = Rotation.from_matrix(seen[good]).mean().as_rotvec()
        new["tool_frame"] = tool.with_vector(np.concatenate([aligned.tool, turn]))
    return problem.at([new.get(e.key, e) for e in model.effects])


def turned_tool(problem: Problem) -> Problem:
    """Return the problem with its tool frame turned by the mean difference to the measured orientations."""
    tool, rotation = problem.model.in_role(Role.TOOL_FRAME), problem.data.rotation
    if tool is None or rotation is None:
        return problem
    off = np.swapaxes(problem.T_instrument_tcp[:, :3, :3], 1, 2) @ rotation
    good = np.isfinite(off).all(axis=(1, 2))
    if not good.any():
        return problem
    x = tool.vector()
    turn = Rotation.from_rotvec(x[3:]) * Rotation.from_matrix(off[good]).mean()
    turned = tool.with_vector(np.concatenate([x[:3], turn.as_rotvec()]))
    return problem.at([turned if e.role is Role.TOOL_FRAME else e for e in problem.model.effects])


def _vector(place: Alignment) -> Array:
    """Return (6,) parameters of `instrument_frame` for a place of the instrument.

    They are translation [m] and rotation vector [rad] of the base in the instrument's frame.
    """
    T = place.T_instrument_base
    return np.concatenate([T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_rotvec()])
