"""n states of one arm: what was commanded and recorded, and what a model fills in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from postproc.arrays import Array, gravity_in
from postproc.robot.arm import Robot
from postproc.robot.kinematics import BodyMotion, body_motions

if TYPE_CHECKING:
    from postproc.robot.cells.station import Station

AXES = "abcdef"
"""External axes by their letters."""

FIELDS = {"payload": "payload_mass", "load": "joint_load", "pose": "T_base_body"}
"""Fields of a state that effects declare by another name."""
COLUMNS: Mapping[str, tuple[str, ...]] = {
    "q": tuple(f"q{j}_deg" for j in range(1, 7)),
    "v": tuple(f"v{j}_deg_s" for j in range(1, 7)),
    "a": tuple(f"a{j}_deg_s2" for j in range(1, 7)),
    "approach": tuple(f"dir{j}" for j in range(1, 7)),
    "temperature": ("temperature_C",),
    "time": ("time_s",),
    "payload": ("payload_kg", "payload_x_mm", "payload_y_mm", "payload_z_mm"),
    "wrench": ("fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm"),
    "session": ("session",),
    "reflector": ("reflector",),
    "setup": ("tip", "plane", "anchor", "gauge", "from"),
    "external_axes": tuple(f"eax_{letter}" for letter in AXES),
}
"""Recorded channels by the name that effects declare, and the columns of a measurement table that hold them."""
CONSTANT = frozenset(
    {
        "gravity",
        "robot",
        "station",
        "channels",
        "session_names",
        "reflector_names",
        "setup_names",
        "touches",
        "T_flange_tcp",
    }
)
"""Fields of a state that are not one value for each row."""
EACH_ROW = {"T_flange_tcp": 3, "gravity": 2}
"""Dimensions of constants that may differ row by row."""


@dataclass(frozen=True)
class State:
    """n states of one arm. Channels that were not recorded are None.

    Args:
        q: (n, 6) commanded joint angles [rad].
        v, a: (n, 6) joint speeds [rad/s] and accelerations [rad/s^2]; None = standing still.
        approach: (n, 6) side from which each joint was approached, -1, 0, +1.
        payload_mass: (n,) [kg] on the flange (tool included), payload_center: (n, 3) [m] in tool0.
        wrench: (n, 6) external force [N] and moment [N m] on the TCP, base axes (a dead load).
        temperature: (n,) [degC]; time: (n,) [s].
        T_flange_tcp: (4, 4) or (n, 4, 4) nominal tool.
        session: (n,) index of the measuring session in session_names.
        reflector: (n,) index of the measured point of the tool in reflector_names.
        setup: (n,) index in setup_names of what a row reads where it measures no position, -1 for none; a name is that
            of its kind and its own, ``tip spike`` (`measure.kinds`). touches: whether some rows hold the point to a tip
            or a plane.
        channels: further columns of the measurement table, by name, (n,).
        gravity: (3,) [m/s^2] in base axes (a gantry hangs its arm upside down), or (n, 3) where it differs: of a base
            that leans with its axes, and less the acceleration of the origin of one that moves.
        external_axes: (n, 6) positions of axes a to f [m], [rad], NaN where there is none.
        work: (n,) name of the unit at whose end the work stands to which the pose counts, empty for the world.
        T_reference_base: (n, 4, 4) the nominal base in the frame to which measured points count, but for the place of
            the instrument: the world, or the end of that unit. None where that is the base.
        base_spin, base_spin_rate: (n, 3) angular velocity [rad/s] and acceleration [rad/s^2] of the base, base axes.
        robot: the nominal arm, for effects that need its lengths and axes. Filled by the model, as are:
        station: its place in its cell, None where nobody says;
        T_base_body: (n, 7, 4, 4) poses of the body frames and joint_load (n, 6) [N m], body_load (n, 7, 6)
            (force [N], moment [N m] at the distal end of each body, in its axes): the loads that deflect the springs.
            Loads are asked for first, with T_base_body alone.
    """

    q: Array
    v: Array | None = None
    a: Array | None = None
    approach: Array | None = None
    payload_mass: Array | None = None
    payload_center: Array | None = None
    wrench: Array | None = None
    temperature: Array | None = None
    time: Array | None = None
    T_flange_tcp: Array = field(default_factory=lambda: np.eye(4))
    session: Array | None = None
    session_names: tuple[str, ...] = ()
    reflector: Array | None = None
    reflector_names: tuple[str, ...] = ()
    setup: Array | None = None
    setup_names: tuple[str, ...] = ()
    touches: bool = False
    channels: Mapping[str, Array] = field(default_factory=dict)
    gravity: Array = field(default_factory=lambda: gravity_in(np.eye(3)))
    external_axes: Array | None = None
    work: NDArray[np.str_] | None = None
    T_reference_base: Array | None = None
    base_spin: Array | None = None
    base_spin_rate: Array | None = None
    robot: Robot | None = None
    station: Station | None = None
    T_base_body: Array | None = None
    joint_load: Array | None = None
    body_load: Array | None = None

    def __len__(self) -> int:
        """Return the number of states n."""
        return len(self.q)

    def channel(self, name: str) -> Array | None:
        """Return a channel by the name that effects declare in ``reads``; None where it was not recorded."""
        return self.channels[name] if name in self.channels else getattr(self, FIELDS.get(name, name), None)

    def rows(self, index: Any) -> State:
        """Return the states of some rows (slice, mask or indices)."""
        picked: dict[str, Any] = {}
        for name in (f.name for f in fields(self) if f.name not in CONSTANT):
            value = getattr(self, name)
            if value is not None:
                picked[name] = np.asarray(value)[index]
        for name in ("T_flange_tcp", "gravity"):
            if len(getattr(self, name).shape) == EACH_ROW[name]:
                picked[name] = getattr(self, name)[index]
        return self.with_(**picked, channels={name: np.asarray(value)[index] for name, value in self.channels.items()})

    @property
    def session_of_rows(self) -> NDArray[np.str_]:
        """(n,) name of the session of each row, its number where names are missing; the states must have sessions."""
        return _named(self.session, self.session_names)

    @property
    def reflector_of_rows(self) -> NDArray[np.str_]:
        """(n,) name of the reflector of each row, its number where names are missing; "" where rows name none."""
        return np.full(len(self), "") if self.reflector is None else _named(self.reflector, self.reflector_names)

    @property
    def setup_of_rows(self) -> NDArray[np.str_]:
        """(n,) name of the set-up of each row, "" where a row has none."""
        if self.setup is None:
            return np.full(len(self), "")
        return np.asarray(np.array([*self.setup_names, ""])[np.asarray(self.setup, dtype=int)])

    @cached_property
    def motions(self) -> list[BodyMotion] | None:
        """Motion of each body (`body_motions`); None where no speed or acceleration was recorded.

        Where only the speed was recorded, accelerations of joints are zero.
        """
        rates = (self.v, self.a, self.base_spin, self.base_spin_rate)
        if self.robot is None or self.T_base_body is None or all(rate is None for rate in rates):
            return None
        v, a = (np.zeros((len(self), 6)) if rate is None else rate for rate in (self.v, self.a))
        base = (self.base_spin, self.base_spin_rate)
        return body_motions(self.robot, np.asarray(self.T_base_body), v, a, base)

    @cached_property
    def axis_frames(self) -> dict[str, tuple[Array, Array]]:
        """By external axis, T_base_joint (n, 4, 4) right before and right after its motion; empty without a station."""
        if self.station is None or self.external_axes is None:
            return {}
        return self.station.axis_frames(self.external_axes)

    def with_(self, **changes: object) -> State:
        """Return the states with other values of these fields."""
        return replace(self, **changes)  # type: ignore[arg-type]


def _named(number: Array | None, names: tuple[str, ...]) -> NDArray[np.str_]:
    """Return (n,) names by their numbers, the numbers themselves where there are no names."""
    index = np.asarray(number, dtype=int)
    every = np.array(names or [str(i) for i in range(int(index.max(initial=0)) + 1)])
    return np.asarray(every[index])
