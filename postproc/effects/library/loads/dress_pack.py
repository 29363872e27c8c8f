"""Hoses that pull the flange towards the forearm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import XYZ, Effect, Load, State, Variant, param, structure, variant
from postproc.effects.geometry import distal_point, force_at, joint_axis, point_in_base
from postproc.effects.run_time import Pull, RunTimeTables
from postproc.robot.arm import Robot


class DressPack(
    Effect,
    reads=("pose", "robot"),
    confused_with={
        "payload_error": "the same pose with the hose taken off; or the same wrist with joint 2 and 3 elsewhere",
        "arm_load": "wrist turns with the rest of the arm held",
        "backlash": "wrist turns from both sides: a hose pulls by where it is, not by where it came from",
    },
):
    """A hose pack pulls two bodies towards each other once it is taut.

    Equation: force k max(|p_b - p_a| - l0, 0) along the line between a point p_a of one body and p_b of another, equal
    and opposite on the two; l0 is the slack length. Points are in body axes.
    Source: linear tension spring; arm loads of hoses in robot manuals.
    Typical size: 100 to 1000 N/m, 10 to 150 N at the flange.
    """

    body_from: int = structure(3, low=0, high=6)
    body_to: int = structure(6, low=0, high=6)
    stiffness_N_per_m: float = param(unit="N/m", low=0.0, high=1e5, typical=200.0)
    slack_m: float = param(unit="m", low=0.0, high=10.0, typical=0.3, amplitude=False)
    from_m: Array = param(unit="m", shape=(3,), low=-1.5, high=1.5, typical=0.2, amplitude=False, labels=XYZ)
    to_m: Array = param(unit="m", shape=(3,), low=-1.5, high=1.5, typical=0.2, amplitude=False, labels=XYZ)

    def load(self, state: State) -> Load:
        """The pull of the hose on the bodies at its ends, wrenches (n, 6) [N], [N m]."""
        if self.body_from == self.body_to:
            return Load()
        start, end, distance = self._ends(state)
        taut = self.stiffness_N_per_m * np.maximum(distance - self.slack_m, 0.0)
        pull = force_at(end, (taut / np.maximum(distance, 1e-9))[:, None] * (start - end))
        # Both ends are on the line of the force, so that its moment about the base is the same at either.
        return Load(body={self.body_to: pull, self.body_from: -pull})

    def run_time_tables(self) -> RunTimeTables:
        """The hose as a line that pulls its two bodies; none where both ends are on one body."""
        bodies, points = (self.body_from, self.body_to), (self.from_m, self.to_m)
        pull = Pull(bodies, points, self.stiffness_N_per_m, self.slack_m)
        return RunTimeTables(pulls=(pull,) if self.body_from != self.body_to else ())

    def _ends(self, state: State) -> tuple[Array, Array, Array]:
        """Both ends of the hose in the base frame, (n, 3) [m] each, and their distance (n,) [m]."""
        T = np.asarray(state.T_base_body)
        start, end = point_in_base(T[:, self.body_from], self.from_m), point_in_base(T[:, self.body_to], self.to_m)
        return start, end, np.sqrt(np.einsum("ni,ni->n", end - start, end - start))

    @classmethod
    def loads(cls, some: Sequence[Self], state: State) -> Load:
        """The pull of m hoses between the same two bodies, wrenches (n, 6, m) [N], [N m]."""
        body, far = some[0].body_from, some[0].body_to
        if body == far:
            return Load()
        T = np.asarray(state.T_base_body)
        stiffness, slack = (np.array([getattr(h, name) for h in some]) for name in ("stiffness_N_per_m", "slack_m"))
        start = T[:, body, :3, :3] @ np.transpose([h.from_m for h in some]) + T[:, body, :3, 3:]
        end = T[:, far, :3, :3] @ np.transpose([h.to_m for h in some]) + T[:, far, :3, 3:]
        line = start - end
        distance = np.sqrt(np.einsum("nim,nim->nm", line, line))
        taut = stiffness * np.maximum(distance - slack, 0.0) / np.maximum(distance, 1e-9)
        force = taut[:, None] * line
        moment = np.cross(end, force, axis=1)
        wrench = np.concatenate([force, moment], axis=1)
        return Load(body={far: wrench, body: -wrench})

    def relatives(self, state: State, label: str) -> tuple[Variant, ...]:
        """For a hose from body 0 to 3 to the flange, the form that ends on body 5 at its mean place; else none."""
        if self.body_to != 6 or self.body_from > 3:
            return ()
        T = np.asarray(state.T_base_body)
        end = point_in_base(T[:, 6], self.to_m) - T[:, 5, :3, 3]
        mean_place = np.einsum("nki,nk->ni", T[:, 5, :3, :3], end).mean(axis=0)
        tied = replace(self, body_to=5, to_m=np.clip(mean_place, -1.5, 1.5))
        return (variant(tied, label.replace(",", " to 5,", 1), odds=RARE),)

    @classmethod
    def variants(cls, state: State, current: Self | None = None) -> tuple[Variant, ...]:
        """Forms: hoses along `_routes`, always taut or slack at times; with ``current``, that hose alone."""
        if current is not None or state.T_base_body is None or state.robot is None:
            return (variant(current or cls()),)
        forms: list[Variant] = []
        for taut, (body, start_point), (far, end_point) in _routes(state.robot):
            start = cls(body_from=body, body_to=far, from_m=start_point, to_m=end_point)
            distance = start._ends(state)[2]
            slack = 0.8 * distance.min() if taut else np.quantile(distance, 0.3)
            where = f"from body {body}" if far == 6 else f"from body {body} to {far}"
            label = f"{where}, {'always taut' if taut else 'slack at times'}"
            forms.append(variant(replace(start, slack_m=float(slack)), label, odds=1.0 if far == 6 else RARE))
        return tuple(forms)


RARE = 0.1
"""How ordinary a hose is that does not end at the flange."""
Place = tuple[int, Array]


def _routes(robot: Robot) -> list[tuple[bool, Place, Place]]:
    """Routes of a hose at which a search starts: whether it is always taut, and body and point [m] of each of its ends.

    From every body to the one after next and to the flange. What hangs from a ceiling or a gantry is tied to body 0 and
    leads to the forearm or the flange. From half way along the one, two hands' width to either side, to four places
    around the axis that carries the other.
    """
    routes: list[tuple[bool, Place, Place]] = []
    for body in range(5):
        middle, (side, other, _, _) = 0.5 * distal_point(robot, body), _across(joint_axis(robot, body))
        for far in sorted({body + 2, 6} if body else {3, 6}):
            for way in _across(robot.axis[far - 1]):
                end = (far, 0.1 * way)
                near, away = (body, middle + 0.2 * side), (body, middle + 0.2 * other)
                routes += [(True, near, end), (False, away, end)]
                routes += [(False, near, end), (True, away, end)] if far == 6 else []
    return routes


def _across(axis: Array) -> tuple[Array, ...]:
    """Four unit vectors (3,) at right angles to an axis (3,), 90 degrees apart."""
    along = axis / max(float(np.linalg.norm(axis)), 1e-9)
    one = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    one /= np.linalg.norm(one)
    two = np.cross(along, one)
    return one, -one, two, -two
