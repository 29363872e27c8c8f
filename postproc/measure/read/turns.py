"""Orientations in the forms that tables write them: quaternions, rotation vectors, three turns about axes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.measure.checks.readings import CLEARER
from postproc.measure.read.layout import QUATERNIONS
from postproc.measure.read.values import UNITS

USUAL = ("xyz", "ZYX", "ZYZ", "rotvec")
TRIPLES = ["".join(axes) for axes in product("xyz", repeat=3) if axes[0] != axes[1] != axes[2]]
FORMS = (*USUAL, *(form for axes in TRIPLES for form in (axes, axes.upper()) if form not in USUAL))
"""Three numbers, the usual forms first: small letters about fixed axes, capitals about axes that turn along."""
LARGEST_FLANGE_TURN_RAD = np.radians(5.0)
"""No arm turns its flange by so much more than it says."""
CLEAR_TURN = 2.5
"""Turns [rad] nearer to half a turn than this may be read both ways round."""


@dataclass(frozen=True)
class Turns:
    """Orientations as numbers.

    Args:
        numbers: (n, 3) angles or components [rad], or the (n, 4) of quaternions; NaN where there is none.
        form: as in ``MappedRotation``. unit: of angles in the table.
        columns: what the table calls them.
    """

    numbers: Array
    form: str
    unit: str
    columns: tuple[str, ...]

    @property
    def matrix(self) -> Array:
        """(n, 3, 3) rotation matrices, NaN where not measured."""
        result = np.full((len(self.numbers), 3, 3), np.nan)
        good = np.isfinite(self.numbers).all(axis=1)
        if good.any():
            result[good] = _read(self.numbers[good], self.form).as_matrix()
        return result

    def off(self, R_base_flange: Array, R_instrument_base: Array | None) -> float | None:
        """Return the median angle [rad] between the orientations and those of the flange with a constant turn (tool).

        If the turn B of the base is not known, those from row to row determine it, M_i M_j^T = B F_i F_j^T B^T with M
        measured and F of the flange; None where fewer than three of these are clear.

        Args:
            R_base_flange: (n, 3, 3); R_instrument_base: (3, 3), None where unknown.
        """
        return _off(_read(self.numbers, self.form), Rotation.from_matrix(R_base_flange), R_instrument_base)

    def better_reading(self, R_base_flange: Array, R_instrument_base: Array | None) -> tuple[str, str, float] | None:
        """Return another form, unit or direction in which orientations follow the flange clearly better; else None.

        The result is (text that names it, help, median angle [rad] as in `off`).

        Args:
            R_base_flange: (n, 3, 3); R_instrument_base: (3, 3), None where unknown.
        """
        flange = Rotation.from_matrix(R_base_flange)
        as_read = self.off(R_base_flange, R_instrument_base) or 0.0
        best, reading = min(LARGEST_FLANGE_TURN_RAD, as_read / CLEARER), None
        four = self.numbers.shape[1] == 4
        units = (self.unit,) if four else (self.unit, "deg" if self.unit == "rad" else "rad")
        # What is less usual comes later and must be clearly better: turned round, some orders are others not so.
        for inverse, form, unit in product((False, True), QUATERNIONS if four else FORMS, units):
            turns = _read(self.numbers * (UNITS[unit] / UNITS[self.unit]), form)
            off = _off(turns.inv() if inverse else turns, flange, R_instrument_base)
            if off is not None and off < best:
                best, reading = off / 2, (form, unit, inverse, off)
        if reading is None:
            return None
        form, unit, inverse, off = reading
        what = f"`{form}`" + (f" in {unit}" if unit != self.unit else "") + (", turned round" if inverse else "")
        stated = f', unit = "{unit}"' if (not four and form != "rotvec") or unit != self.unit else ""
        help_ = f'give a column map: [orientation] with columns = {list(self.columns)}, form = "{form}"{stated}'
        other_way = "; export the tool as the instrument sees it, not the instrument as the tool does"
        return what, help_ + (other_way if inverse else ""), off


def _read(numbers: Array, form: str) -> Rotation:
    """Return rotations of numbers (n, 3) or (n, 4) in a form of `MappedRotation`."""
    if form in QUATERNIONS:
        return Rotation.from_quat(numbers[:, QUATERNIONS[form]])
    return Rotation.from_rotvec(numbers) if form == "rotvec" else Rotation.from_euler(form, numbers)


def _off(measured: Rotation, flange: Rotation, R_instrument_base: Array | None) -> float | None:
    """Return the median angle [rad] of `Turns.off` for measured and flange rotations."""
    if R_instrument_base is None:
        turns = (measured[1:] * measured[:-1].inv()).as_rotvec(), (flange[1:] * flange[:-1].inv()).as_rotvec()
        clear = np.maximum(*(np.linalg.norm(turn, axis=1) for turn in turns)) < CLEAR_TURN
        if clear.sum() < 3:
            return None
        base = Rotation.align_vectors(turns[0][clear], turns[1][clear])[0]
    else:
        base = Rotation.from_matrix(R_instrument_base)
    tool = (base * flange).inv() * measured
    return float(np.median((tool.mean().inv() * tool).magnitude()))
