"""What an effect is to the rest of the package, where that is more than an effect among others."""

from __future__ import annotations

from enum import Enum


class Role(Enum):
    """What the package asks a model for without knowing which effect of the library it is.

    INSTRUMENT_FRAME: where the instrument stands, six constants. TOOL_FRAME: the calibration error of the tool, six
    constants. SESSION_FRAMES: steps of the instrument between sessions. WORK_OBJECTS: where work objects stand beside
    where a program says so. REFLECTOR_POINTS: where several measured points are on the tool. SETUPS: unknowns of what
    is measured without a tracker. JOINT_SPRINGS: a compliance for each joint. CARRIED_MASS: masses that ride on bodies
    of the arm. CURVE: a law without a name, found on data.
    """

    INSTRUMENT_FRAME = "instrument frame"
    TOOL_FRAME = "tool frame"
    SESSION_FRAMES = "frames of sessions"
    WORK_OBJECTS = "places of work objects"
    REFLECTOR_POINTS = "points of reflectors"
    SETUPS = "unknowns of set-ups"
    JOINT_SPRINGS = "joint springs"
    CARRIED_MASS = "carried mass"
    CURVE = "curve"


FRAME_ROLES = (Role.INSTRUMENT_FRAME, Role.TOOL_FRAME)
"""Constant frames: any place of instrument and tool is as likely as another."""
