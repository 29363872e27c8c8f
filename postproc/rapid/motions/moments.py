"""What instructions have set at a moment, as all motions feel it until one sets something else."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TypeVar

from postproc.rapid.data.events import InForce, StatementShape
from postproc.rapid.data.records import LoadData, Pose
from postproc.rapid.data.values import Data
from postproc.rapid.evaluation.state import NO_MASS, NO_OFFSET
from postproc.rapid.motions.settings import MotionSettings
from postproc.rapid.program.instructions import SETTERS
from postproc.rapid.unknown import Causes, Kind, Unknown, joined_causes, without_causes

T = TypeVar("T")
FIXED_AXES = "\\noeoffs"  # the option of a motion that is made without the offset of external axes


class Moment:
    """What is in force for all motions.

    ``known`` says whether all of it is; ``reasons`` why load and displacement are not, ``causes`` why they are not
    certain; ``offset`` of external axes is None where it is not known.

    Args:
        values: of the state by the keys of ``SETTERS``, in their order.
    """

    def __init__(self, values: tuple[Data, ...]) -> None:
        """Work out payload, displacement, speed and options from state values in the order of ``SETTERS``."""
        state = {key: without_causes(value) for key, value in zip(SETTERS, values, strict=True)}
        known = {key: None if causes or isinstance(value, Unknown) else value for key, (value, causes) in state.items()}
        self.values = values
        self.known = not any(isinstance(value, Unknown) for value in values)
        self.reasons: list[Unknown] = []
        self.gripload, load_causes = self._or_else(state["@gripload"], LoadData(), Kind.PAYLOAD)
        self.displacement, causes = self._or_else(state["@pdisp"], Pose(), Kind.DISPLACEMENT)
        self.causes = joined_causes(load_causes, causes)
        if state["@soft"][0] is True:
            self.reasons.append(Unknown(Kind.SOFT_SERVO))
        self.offset, self.units = known["@eoffs"], known["@units"]
        velocity, acceleration, singarea = (state[key][0] for key in ("@velset", "@accset", "@singarea"))
        self.velocity: tuple[float, float | None] = velocity if isinstance(velocity, tuple) else (100.0, None)
        self.acceleration = 100.0 if isinstance(acceleration, Unknown) else acceleration
        options = {name: on for name in ("conf_l", "conf_j") if isinstance(on := state[f"@{name}"][0], bool)}
        if isinstance(singarea, str):
            options["wrist_in_joints"] = singarea in ("wrist", "lockaxis4")
        self.options = MappingProxyType(options)
        self._motions: dict[StatementShape, tuple[MotionSettings, InForce]] = {}  # the last of each shape

    def _or_else(self, state: tuple[Data, Causes], default: T, kind: Kind) -> tuple[T, Causes]:
        """The value of a state and why it is not certain; the default if it is Unknown, which is added to ``reasons``.

        Args:
            state: its value and why that is not certain; kind: reason to add.
        """
        if isinstance(state[0], Unknown):
            self.reasons.append(Unknown(kind, cause=state[0]))
            return default, ()
        return state

    def in_force(self, shape: StatementShape, settings: MotionSettings) -> InForce:
        """Tool, frames, speed, load and state of a motion; one object for motions of equal shape and settings."""
        settled, causes = self._motions.get(shape, (None, None))
        if causes is None or not (settled is settings or settled == settings):
            causes = self._with(settings, fixed_axes=FIXED_AXES in shape.roles)
            self._motions[shape] = settings, causes
        return causes

    def _with(self, settings: MotionSettings, fixed_axes: bool) -> InForce:
        r"""Settings joined with the state; ``\TLoad`` above 1 g replaces the tool's load and removes the payload.

        Args:
            fixed_axes: the motion ignores the offset of external axes (``\NoEOffs``).
        """
        tool, gripload, total = settings.tool, self.gripload, settings.total
        if total is not None and total.mass > NO_MASS:
            tool, gripload = replace(tool, tload=total), LoadData()
        offset = NO_OFFSET if self.offset is None or fixed_axes else self.offset
        return InForce(
            tool, settings.wobj, settings.speed, settings.zone, settings.weld, settings.duration, gripload,
            self.displacement, self.options, *self.velocity, self.acceleration, offset, self.units, total,
        )  # fmt: skip
