"""One arm as its maker describes it: the values only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from postproc.arrays import Array

ACCELERATION = [8.0, 8.0, 8.0, 20.0, 20.0, 25.0]
"""Estimates [rad/s^2] where nobody states them."""
JERK = 60.0
"""Jerks [rad/s^3] over accelerations where nobody states them: 40 to 60 in logged corners of an IRB 6640."""
AccelerationSource = Literal["logged", "stated", "estimated"]
"""Where the limits of acceleration of an arm come from."""


@dataclass(frozen=True, slots=True)
class Opw:
    """An ortho-parallel arm with a spherical wrist (Brandstoetter et al. 2014), lengths [m], offsets [rad]."""

    a1: float
    a2: float
    b: float
    c1: float
    c2: float
    c3: float
    c4: float
    offsets: tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class Drives:
    """What limits the acceleration of axes 1 to 3: less in a stretched pose, and with a payload.

    Args:
        torque: (3,) what the motors leave beside weight and friction, at the joints [N m].
        rotor: (3,) inertia of each motor with its gear, at the joint [kg m^2].
    """

    torque: Array
    rotor: Array


@dataclass(frozen=True, slots=True)
class Robot:
    """A serial six-axis arm.

    Body b (0 pedestal .. 6 flange) ends at its distal end: joint b + 1, or the flange for body 6. The nominal chain is

        T_base_flange = link[0] * Rot(axis[0], q1) * link[1] * ... * Rot(axis[5], q6) * link[6]

    and body frames are the frames right after each joint rotation (for body 0: the base).

    Args:
        name: library name.
        link: (7, 4, 4) constant transforms of the chain above, lengths in m.
        axis: (6, 3) unit joint axes, in the frame right before the rotation.
        lower, upper: (6,) joint limits [rad]; speed (6,) [rad/s]; acceleration (6,) [rad/s^2]; jerk (6,) [rad/s^3].
        drives: limit the accelerations of axes 1 to 3 in place of ``acceleration``; None where it is constant.
        acceleration_source: ``logged`` on an arm of the type, ``stated`` in its file, or ``estimated``.
        torque: (6,) joint torque limits [N m] or None where nobody publishes them.
        mass: (7,) body masses [kg]; center: (7, 3) centres of mass in body frames [m];
        inertia: (7, 3, 3) about the centre of mass, body axes [kg m^2].
        joint_compliance: (6,) shipped elasticity [rad/(N m)] or None where nothing is known.
        opw: closed-form inverse kinematics, None for arms without spherical wrist.
        payload: rated payload [kg] or None. repeatability: RP of ISO 9283 by the data sheet [m], or None.
        stiffness_source: ``measured`` or ``estimated``; None where there is no joint_compliance.
        stiffness_factor: (6,) 95 % of arms of this type have a compliance within these factors of joint_compliance.
        mass_factor: (7,) one geometric standard deviation of the body masses.
        parallelogram: axis 3 of the controller is the forearm's own pitch: such an arm is described, not computed.
        reach: the maker's figure, from axis 1 to the wrist centre [m]; mounting: ways in which the maker lets it hang.
        sources: where each number comes from, for ``robots show``.
    """

    name: str
    link: Array
    axis: Array
    lower: Array
    upper: Array
    speed: Array
    acceleration: Array
    jerk: Array
    mass: Array
    center: Array
    inertia: Array
    drives: Drives | None = None
    acceleration_source: AccelerationSource = "estimated"
    torque: Array | None = None
    joint_compliance: Array | None = None
    opw: Opw | None = None
    payload: float | None = None
    repeatability: float | None = None
    stiffness_source: str | None = None
    stiffness_factor: Array | None = None
    mass_factor: Array | None = None
    parallelogram: bool = False
    reach: float | None = None
    mounting: tuple[str, ...] = ()
    sources: Mapping[str, str] = field(default_factory=dict)
