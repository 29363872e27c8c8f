"""What is measured in a row: positions, orientations, joint angles on the output side; each with its own unit."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Observation:
    """One kind of measured numbers. Their unit for people is a thousandth of the SI unit, whatever kind they are.

    Args:
        name: ``position``, ``orientation`` or ``joint``.
        columns: where its numbers stand among all that are measured in a row.
        unit: ``mm`` or ``mrad``; each: what one number belongs to.
        subject: what is off by it, for people.
    """

    name: str
    columns: slice
    unit: str
    each: str
    subject: str

    def key(self, name: str) -> str:
        """Return the key of a figure in a document, with the unit at its end: ``rms_mm``, ``rms_mrad``."""
        return f"{name}_{self.unit}"


def observations(rotation: bool, joint: bool, read: bool = False) -> tuple[Observation, ...]:
    """Return the kinds of numbers in a row of measurements, in the order of their columns; positions always exist.

    Args:
        rotation, joint: whether orientations, and joint angles on the output side, have columns.
        read: whether no row measures a position, but reads something in its place.
    """
    each, subject = ("reading", "the readings") if read else ("axis", "the points")
    kinds = [Observation("position", slice(0, 3), "mm", each, subject)]
    if rotation:
        kinds.append(Observation("orientation", slice(3, 6), "mrad", "axis", "the orientations"))
    if joint:
        start = kinds[-1].columns.stop
        kinds.append(Observation("joint", slice(start, start + 6), "mrad", "joint", "the joint angles"))
    return tuple(kinds)
