"""What every kind of observation is: numbers that a row reads off the TCP, beside unknowns of its set-up."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from postproc.arrays import Array

POINT, TILT, ZERO, UNKNOWNS = slice(0, 3), slice(3, 5), 5, 6
"""Where the unknowns of a set-up stand: a point [m], the tilt of a plane [rad], the zero of a reading [m]."""


@dataclass(frozen=True)
class Readings:
    """What n rows read beside positions.

    Args:
        numbers: (n, 3) measured numbers [m]; a kind of one number a row has it in the first column. NaN elsewhere.
        direction: (n, 3) unit vectors in which readings grow, base axes; NaN where a row has none.
        sign: (n,) +1 and -1 at both ends of a distance between two rows, 0 elsewhere.
        zero_open: whether distances from an anchor have a zero that is not known.
    """

    numbers: Array
    direction: Array
    sign: Array
    zero_open: bool = False

    def rows(self, index: Any) -> Readings:
        """Return the readings of some rows (slice, mask or indices)."""
        return replace(self, numbers=self.numbers[index], direction=self.direction[index], sign=self.sign[index])


@dataclass(frozen=True)
class Seen:
    """m rows of one kind, as the arm stands in them.

    Args:
        point: (m, 3) TCP [m]. unknown: (m, 6) unknowns of the set-up of each row. direction, sign: as in `Readings`.
        other: (m, 3) TCP at the other end of a distance between two rows, NaN where that row is missing.
    """

    point: Array
    unknown: Array
    direction: Array
    sign: Array
    other: Array


@dataclass(frozen=True)
class Read:
    """What m rows read, and its derivatives. Of all rows of a table k is 3; what a row does not read is NaN there.

    Args:
        value: (m, k) predicted numbers [m]. by_point: (m, k, 3) by the TCP. by_unknown: (m, k, 6) by the unknowns of
            the set-up [1], of angles [m/rad]. Both are 0 where nothing is read.
    """

    value: Array
    by_point: Array
    by_unknown: Array


class ReadingKind(ABC):
    """One way to observe a TCP.

    Attributes:
        column: of a table, which names the set-up. reading: columns of its numbers, none where these are zero.
        point, plane, zero: which unknowns a set-up has; zero_may_open: whether a column map may free its zero.
        noise: standard deviation [m] where nobody states one.
        touches: whether rows hold the TCP to one place or plane. each: numbers a row has.
        lasting: whether another table may come back to a set-up. item: what is measured once more, in the plural.
    """

    column: ClassVar[str]
    reading: ClassVar[tuple[str, ...]] = ()
    point: ClassVar[bool] = False
    plane: ClassVar[bool] = False
    zero: ClassVar[bool] = False
    zero_may_open: ClassVar[bool] = False
    noise: ClassVar[float]
    touches: ClassVar[bool] = False
    each: ClassVar[int] = 1
    lasting: ClassVar[bool] = True
    item: ClassVar[str] = "touches"

    @abstractmethod
    def read(self, seen: Seen) -> Read:
        """Return what rows of this kind read, with derivatives."""

    @abstractmethod
    def start(self, seen: Seen, numbers: Array) -> Array:
        """Return the unknowns (6,) of one set-up from its m rows and their numbers (m, 3), by the nominal arm.

        Half of the rows may be wrong.
        """

    @classmethod
    def unknowns(cls, zero_open: bool) -> tuple[bool, bool, bool]:
        """Return whether a set-up has an unknown point, an unknown plane, an unknown zero."""
        return cls.point, cls.plane, cls.zero or cls.plane or (cls.zero_may_open and zero_open)


def unknown(point: Array | float = 0.0, tilt: Array | float = 0.0, zero: float = 0.0) -> Array:
    """Return (6,) unknowns of a set-up, 0 where a kind has none."""
    result = np.zeros(UNKNOWNS)
    result[POINT], result[TILT], result[ZERO] = point, tilt, zero
    return result


def single(
    value: Array, along: Array, point: Array | float = 0.0, tilt: Array | float = 0.0, zero: Array | float = -1.0
) -> Read:
    """Return readings (m,) of one number a row.

    Args:
        along: (m, 3) derivatives by the TCP; point: (m, 3), tilt: (m, 2), zero: (m,) by the unknowns of the set-up.
    """
    by_unknown = np.zeros((len(value), 1, UNKNOWNS))
    by_unknown[:, 0, POINT], by_unknown[:, 0, TILT], by_unknown[:, 0, ZERO] = point, tilt, zero
    return Read(value[:, None], along[:, None], by_unknown)
