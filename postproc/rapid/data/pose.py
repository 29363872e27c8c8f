"""Pose algebra on single values in mm, quaternions scalar first (the arrays of the other rooms begin in ``units``)."""

from __future__ import annotations

import math

from postproc.rapid.data.records import Pose, Quat, Vec3


def quat_mult(a: Quat, b: Quat) -> Quat:
    """Hamilton product: rotation ``b`` first, then ``a``, both in fixed axes."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def rotate(q: Quat, v: Vec3) -> Vec3:
    """``v`` turned by the unit quaternion ``q``."""
    w, x, y, z = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return (v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx)


def normalise(q: Quat) -> Quat:
    """The quaternion scaled to length 1.

    Raises:
        ZeroDivisionError: ``q`` is zero (a position that was never taught).
    """
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm)


def add(a: Vec3, b: Vec3) -> Vec3:
    """Sum ``a + b`` of two vectors."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vec3, b: Vec3) -> Vec3:
    """Difference ``a - b`` of two vectors."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a: Vec3, b: Vec3) -> float:
    """Scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vec3, b: Vec3) -> Vec3:
    """Vector product ``a x b``."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def pose_mult(a: Pose, b: Pose) -> Pose:
    """Product ``T_a T_b``: the pose ``b``, stated in the frame ``a``, in the frame in which ``a`` is stated."""
    return Pose(add(a.trans, rotate(a.rot, b.trans)), quat_mult(a.rot, b.rot))


def pose_inv(a: Pose) -> Pose:
    """Inverse ``T_a^-1`` of a pose."""
    inverse = (a.rot[0], -a.rot[1], -a.rot[2], -a.rot[3])
    x, y, z = rotate(inverse, a.trans)
    return Pose((-x, -y, -z), inverse)


def about(axis: int, degrees: float) -> Quat:
    """Unit quaternion of a rotation by ``degrees`` about the x (0), y (1) or z (2) axis."""
    half = math.radians(degrees) / 2
    parts = [math.cos(half), 0.0, 0.0, 0.0]
    parts[1 + axis] = math.sin(half)
    return (parts[0], parts[1], parts[2], parts[3])


def orient_zyx(z: float, y: float, x: float) -> Quat:
    """Quaternion ``Rz Ry Rx`` of angles in degrees: turned about z, then about the new y, then about the new x."""
    return quat_mult(quat_mult(about(2, z), about(1, y)), about(0, x))


def euler_zyx(q: Quat) -> Vec3:
    """Angles (x, y, z) in degrees with ``q = Rz Ry Rx``; x is 0 where y is at +-90."""
    w, x, y, z = q
    sine = max(-1.0, min(1.0, 2 * (w * y - x * z)))
    if abs(sine) > 1 - 1e-12:
        turn = math.atan2(2 * (w * z - x * y), 1 - 2 * (x * x + z * z))
        return (0.0, math.copysign(90.0, sine), math.degrees(turn))
    return (
        math.degrees(math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))),
        math.degrees(math.asin(sine)),
        math.degrees(math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))),
    )


def frame_of_points(p1: Vec3, p2: Vec3, p3: Vec3, origin: int = 1) -> Pose:
    """Pose [mm] of the frame of RAPID's DefFrame: x from ``p1`` to ``p2``, and ``p3`` on the side of +y.

    Args:
        origin: 1 puts it in ``p1``, 2 in ``p2``, 3 on the x axis where the y axis passes through ``p3``.

    Raises:
        ZeroDivisionError: the points coincide or lie on a line.
    """
    from scipy.spatial.transform import Rotation  # reading alone does without

    along = subtract(p2, p1)
    length = math.sqrt(dot(along, along))
    x = (along[0] / length, along[1] / length, along[2] / length)
    normal = cross(x, subtract(p3, p1))
    height = math.sqrt(dot(normal, normal))
    z = (normal[0] / height, normal[1] / height, normal[2] / height)
    foot = dot(subtract(p3, p1), x)
    start = {1: p1, 2: p2, 3: add(p1, (foot * x[0], foot * x[1], foot * x[2]))}[origin]
    axes = list(zip(x, cross(z, x), z, strict=True))
    w, a, b, c = Rotation.from_matrix(axes).as_quat(scalar_first=True).tolist()
    return Pose(start, (w, a, b, c))
