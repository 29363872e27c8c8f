"""A plane that is touched: a table, a face of a cube, a plate."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.measure.kinds.base import TILT, ZERO, Read, ReadingKind, Seen, single, unknown
from postproc.robot.pose import left_jacobian

WEIGHINGS = 20
"""Times that rows are weighed anew by how far they lie off (least absolute distances)."""
NEAREST_M = 1e-5


class Plane(ReadingKind):
    """A plane n.p = d: n is the base's z turned by a rotation vector (a, b, 0), so that n.z >= 0; n and d unknown."""

    column = "plane"
    plane = touches = True
    noise = 5e-5

    def read(self, seen: Seen) -> Read:
        """Return n.p - d (m, 1)."""
        vector = np.column_stack([seen.unknown[:, TILT], np.zeros(len(seen.point))])
        normal = Rotation.from_rotvec(vector).as_matrix()[:, :, 2]
        # dn = (J dw) x n with the left Jacobian J of the rotation vector w, so that p.dn = ((n x p)^T J) dw.
        turn = np.einsum("mi,mij->mj", np.cross(normal, seen.point), left_jacobian(vector))
        return single(np.sum(normal * seen.point, axis=1) - seen.unknown[:, ZERO], normal, tilt=turn[:, :2])

    def start(self, seen: Seen, numbers: Array) -> Array:
        """Return the plane of least absolute distances (iteratively reweighted principal axes)."""
        weight = np.ones(len(seen.point))
        for _ in range(WEIGHINGS):
            centre = weight @ seen.point / weight.sum()
            _, _, axes = np.linalg.svd((seen.point - centre) * np.sqrt(weight)[:, None])
            normal = axes[2] if axes[2, 2] >= 0 else -axes[2]
            weight = 1.0 / np.maximum(np.abs((seen.point - centre) @ normal), NEAREST_M)
        across = np.cross([0.0, 0.0, 1.0], normal)
        length = float(np.linalg.norm(across))
        angle = float(np.arctan2(length, normal[2]))
        return unknown(tilt=across[:2] * (angle / length if length > 1e-12 else 1.0), zero=float(normal @ centre))
