"""What instructions have set at a moment, as all motions feel it until one sets something else."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType

from postproc.rapid.data.events import InForce, StatementShape
from postproc.rapid.data.records import Ax6, LoadData, Pose
from postproc.rapid.data.values import Data
from postproc.rapid.evaluation.state import NO_MASS, NO_OFFSET
from postproc.rapid.motions.settings import Settings
from postproc.rapid.program.write_effects import SETTERS
from postproc.rapid.unknown import Causes, Kind, Unknown, joined_causes, without_causes

FIXED_AXES = "\\noeoffs"  # the option of a motion that is made without the offset of external axes


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """What is in force for all motions.

    Args:
        values: of the state by the keys of ``SETTERS``, in their order; known: whether each is.
        offset: of external axes, None where it is not known.
        reasons: why load and displacement are not known; causes: why they are not certain.
        motions: settings of the last motion of each shape, and what was in force for it.
    """

    values: tuple[Data, ...]
    known: bool
    gripload: LoadData
    displacement: Pose
    offset: Ax6 | None
    units: tuple[tuple[str, bool], ...] | None
    velocity: tuple[float, float | None]
    acceleration: float
    options: MappingProxyType[str, bool]
    reasons: tuple[Unknown, ...]
    causes: Causes
    motions: dict[StatementShape, tuple[Settings, InForce]] = field(default_factory=dict)

    def in_force(self, shape: StatementShape, settings: Settings) -> InForce:
        """What a motion of some shape runs with; the same value for all that run with the same."""
        settled, found = self.motions.get(shape, (None, None))
        if found is None or not (settled is settings or settled == settings):
            found = self._with(settings, fixed_axes=FIXED_AXES in shape.roles)
            self.motions[shape] = settings, found
        return found

    def _with(self, settings: Settings, fixed_axes: bool) -> InForce:
        tool, gripload, total = settings.tool, self.gripload, settings.total
        if total is not None and total.mass > NO_MASS:
            tool, gripload = replace(tool, tload=total), LoadData()
        offset = NO_OFFSET if self.offset is None or fixed_axes else self.offset
        return InForce(
            tool, settings.wobj, settings.speed, settings.zone, settings.weld, settings.duration, gripload,
            self.displacement, self.options, *self.velocity, self.acceleration, offset, self.units,
        )  # fmt: skip


def moment_of(values: tuple[Data, ...]) -> Moment:
    """What is in force where the state has these values, in the order of ``SETTERS``."""
    state = {key: without_causes(value) for key, value in zip(SETTERS, values, strict=True)}
    gripload, more = state["@gripload"]
    displacement, causes = state["@pdisp"]
    reasons = []
    if isinstance(gripload, Unknown):
        reasons.append(Unknown(Kind.PAYLOAD, cause=gripload))
        gripload, more = LoadData(), ()
    if isinstance(displacement, Unknown):
        reasons.append(Unknown(Kind.DISPLACEMENT, cause=displacement))
        displacement, causes = Pose(), ()
    offset, unsure = state["@eoffs"]
    units, doubtful = state["@units"]
    velocity, acceleration = state["@velset"][0], state["@accset"][0]
    options = {name: on for name in ("conf_l", "conf_j") if isinstance(on := state[f"@{name}"][0], bool)}
    if isinstance(singarea := state["@singarea"][0], str):
        options["wrist_in_joints"] = singarea in ("wrist", "lockaxis4")
    return Moment(
        values,
        not any(isinstance(value, Unknown) for value in values),
        gripload,
        displacement,
        None if unsure or isinstance(offset, Unknown) else offset,
        None if doubtful or isinstance(units, Unknown) else units,
        velocity if isinstance(velocity, tuple) else (100.0, None),
        100.0 if isinstance(acceleration, Unknown) else acceleration,
        MappingProxyType(options),
        tuple(reasons),
        joined_causes(more, causes),
    )
