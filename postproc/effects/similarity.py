"""Ordinary sizes of parameters on arms of any mass and length, from those on an arm of 60 kg payload."""

from __future__ import annotations

import re
from functools import cache

import numpy as np

from postproc.arrays import Array
from postproc.effects.base import Effect
from postproc.robot.arm import Robot

MASS_KG, LENGTH_M = 320.0, 2.3
"""Moving mass and added lengths of the links of the arm that ordinary sizes are stated for (IRB 4600-60/2.05)."""


def ordinary_sizes(effect: Effect, robot: Robot) -> Array:
    """Return the ordinary size (p,) of every parameter of an effect on this arm, scaled from the reference arm.

    Equation: a unit of mass^a length^b grows with (M / M0)^a (L / L0)^b, a newton as a kilogram does: a part that rides
    on an arm, the pull of a hose, and the moment that turns a bearing by so much are larger on a larger arm. Angles,
    lengths, strains and times stay as they are. Source: dimensional analysis (Buckingham 1914) with gravity given.
    """
    powers = [dimensions(meta.unit) for meta in type(effect).parameters().values()]
    if not any(kilograms for kilograms, _ in powers):
        return effect.scale()
    mass, length = size(robot)
    # A length by itself is a tolerance or a place: what holds for one casting holds for another.
    factor = [mass**kilograms * length**metres if kilograms else 1.0 for kilograms, metres in powers]
    return np.asarray(effect.scale() * np.array(factor)[effect.layout.parameter])


def size(robot: Robot) -> tuple[float, float]:
    """Return moving mass and length of an arm, each over the reference arm's; without masses, length^3 as mass."""
    length = float(np.linalg.norm(robot.link[1:, :3, 3], axis=1).sum()) / LENGTH_M
    mass = float(np.sum(robot.mass[1:])) / MASS_KG
    return (mass if mass > 0 else length**3), length


@cache
def dimensions(unit: str) -> tuple[int, int]:
    """Return the powers of mass and length in an SI unit: (-1, -1) for ``rad/(N m)``; a newton counts as a kilogram."""
    over, _, under = unit.partition("/")
    kilograms = metres = 0
    for sign, part in ((1, over), (-1, under)):
        for word, power in re.findall(r"([A-Za-z]+)(?:\^(\d+))?", part):
            kilograms += sign * int(power or 1) * (word in ("N", "kg"))
            metres += sign * int(power or 1) * (word == "m")
    return kilograms, metres
