"""Where a tool is and how a base is mounted, as options state it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from postproc.cli.options import parse_vector
from postproc.cli.printing import show
from postproc.diagnostics import Diagnostic

if TYPE_CHECKING:
    from postproc.arrays import Array

NEARLY_NOTHING = 1e-3
"""Distance [m] of a TCP from the flange that no tool has, and many a tool in metres."""


def parse_tool(text: str, option: str = "--tool", such_as: str = "0,0,250") -> Array:
    """Parse ``--tool X,Y,Z`` [mm] to a tool (4, 4) that is not turned; prints CLI006 where it is below a millimetre.

    Raises:
        PostprocError: CLI006 where these are not three numbers.
    """
    import numpy as np

    tool = np.eye(4)
    tool[:3, 3] = 1e-3 * np.array(parse_vector(option, text, such_as))
    if 0 < (length := float(np.linalg.norm(tool[:3, 3]))) < NEARLY_NOTHING:
        message = f"`{option} {text}` puts the TCP {1e3 * length:.3g} mm from the flange: no tool is as short"
        show([Diagnostic("CLI006", "warning", message, help=f"write it in mm, `{option} {such_as}`")])
    return tool


def parse_mounting(text: str | None) -> Array:
    """Parse ``--mounting R,P,Y`` [deg] to how the base stands in the world (3, 3); upright for None.

    Raises:
        PostprocError: CLI006 where these are not three numbers.
    """
    import numpy as np

    from postproc.robot.pose import rpy

    return rpy(np.radians(parse_vector("--mounting", text or "0,0,0", "180,0,0")))
