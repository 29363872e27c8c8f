"""The one boundary between RAPID's millimetres and the metres of every other room.

A RAPID target is the pose of the TCP in the object frame of the work object, after the program displacement:
``T_frame_tcp = T_uframe T_oframe T_displacement T_target`` (ABB RAPID reference manual, wobjdata and PDispSet). The
``frame`` is the world, or for a work object that a mechanical unit moves, without its user frame, the end of that unit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from postproc.arrays import Array, invert
from postproc.rapid.data.events import MotionEvent
from postproc.rapid.data.records import Pose, RobTarget, ToolData, WobjData

MM = 1e-3


def pose_matrix(trans_mm: ArrayLike, rot: ArrayLike) -> Array:
    """Homogeneous matrices (..., 4, 4) [m] of positions (..., 3) [mm] and unit quaternions (..., 4), scalar first."""
    trans, quat = np.asarray(trans_mm, float), np.asarray(rot, float)
    w, x, y, z = np.moveaxis(quat, -1, 0)
    matrix = np.zeros((*np.broadcast_shapes(trans.shape[:-1], quat.shape[:-1]), 4, 4))
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    for i, row in enumerate(rows):
        matrix[..., i, 0], matrix[..., i, 1], matrix[..., i, 2] = row
    matrix[..., :3, 3] = trans * MM
    matrix[..., 3, 3] = 1.0
    return matrix


def matrix_pose(matrix: Array) -> Pose:
    """Pose [mm, scalar first, q1 >= 0] of a homogeneous matrix (4, 4) [m]."""
    x, y, z = (matrix[:3, 3] / MM).tolist()
    w, a, b, c = Rotation.from_matrix(matrix[:3, :3]).as_quat(canonical=True, scalar_first=True).tolist()
    return Pose((x, y, z), (w, a, b, c))


def tool_matrix(tool: ToolData) -> Array:
    """``T_tool0_tcp`` (4, 4) [m]; for a stationary tool (``robhold`` FALSE) ``T_world_tcp``."""
    return pose_matrix(tool.tframe.trans, tool.tframe.rot)


def object_matrix(wobj: WobjData, displacement: Pose = Pose()) -> Array:
    """``T_frame_object`` (4, 4) [m] with the program displacement; ``T_tool0_object`` if the robot holds the object.

    ``frame`` is the world, or the end of the mechanical unit that moves the object.
    """
    uframe = pose_matrix(wobj.uframe.trans, wobj.uframe.rot) if wobj.ufprog or wobj.robhold else np.eye(4)
    oframe = pose_matrix(wobj.oframe.trans, wobj.oframe.rot)
    return uframe @ oframe @ pose_matrix(displacement.trans, displacement.rot)


def target_matrix(event: MotionEvent) -> Array:
    """``T_frame_tcp`` (4, 4) [m] of an event's target; ``T_tool0_tcp`` if the robot holds the work object.

    ``frame`` is the world, or the end of the mechanical unit that moves the work object.

    Raises:
        ValueError: the event has no robtarget.
    """
    return target_matrices([event])[0]


def via_matrix(event: MotionEvent) -> Array:
    """``T_frame_tcp`` (4, 4) [m] of the circle point, which the event must have; frames as in ``target_matrix``."""
    assert event.via is not None
    return object_matrix(event.wobj, event.displacement) @ pose_matrix(event.via.trans, event.via.rot)


def target_matrices(events: Sequence[MotionEvent]) -> Array:
    """``T_frame_tcp`` (n, 4, 4) [m] of the targets of events; ``T_tool0_tcp`` where the robot holds the work object.

    Raises:
        ValueError: an event has no robtarget.
    """
    if not events:
        return np.zeros((0, 4, 4))
    numbers = np.array([(*target.trans, *target.rot) for target in _robtargets(events)])
    return object_matrices(events) @ pose_matrix(numbers[:, :3], numbers[:, 3:])


def _robtargets(events: Sequence[MotionEvent]) -> list[RobTarget]:
    """The target of each event in order.

    Raises:
        ValueError: one of them is no robtarget.
    """
    targets = [event.target for event in events if isinstance(event.target, RobTarget)]
    if len(targets) < len(events):
        raise ValueError("the event has no robtarget")
    return targets


def object_matrices(events: Sequence[MotionEvent]) -> Array:
    """``T_frame_object`` (n, 4, 4) [m] of events, with the program displacement; ``T_tool0_object`` of held objects."""
    every = [event.in_force for event in events]
    row = {now: i for i, now in enumerate(dict.fromkeys(every))}
    return np.stack([object_matrix(now.wobj, now.displacement) for now in row])[[row[now] for now in every]]


def target_poses(events: Sequence[MotionEvent], T_frame_tcp: Array) -> list[Pose]:
    """The poses to write as the targets of events so that the TCP is commanded to ``T_frame_tcp`` (n, 4, 4) [m].

    Inverse of ``target_matrices``: in the object frame, before the program displacement; quaternions on the side of the
    target they replace.

    Raises:
        ValueError: an event has no robtarget.
    """
    if not events:
        return []
    rots = [target.rot for target in _robtargets(events)]
    matrices = invert(object_matrices(events)) @ T_frame_tcp
    quats = Rotation.from_matrix(matrices[:, :3, :3]).as_quat(scalar_first=True)
    quats *= np.where(np.sum(quats * np.array(rots), axis=1) < 0, -1.0, 1.0)[:, None]
    return [
        Pose((p[0], p[1], p[2]), (r[0], r[1], r[2], r[3]))
        for p, r in zip((matrices[:, :3, 3] / MM).tolist(), quats.tolist(), strict=True)
    ]


def flange_matrix(event: MotionEvent) -> Array:
    """``T_frame_tool0`` (4, 4) [m] of the flange at an event's target; the frame is that of `target_matrix`.

    Tool on the robot: ``T_frame_tcp T_tool0_tcp^-1``. Stationary tool: ``T_world_tcp (T_tool0_object T_target)^-1``.

    Raises:
        ValueError: the event has no robtarget.
    """
    if event.tool.robhold:
        return target_matrix(event) @ invert(tool_matrix(event.tool))
    return tool_matrix(event.tool) @ invert(target_matrix(event))
