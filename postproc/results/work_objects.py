"""How much of a correction is one rigid shift of a work object, in words: drawn offline, or taught with this arm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.compensation.correction.rigid_shift import RigidShift
from postproc.numbers import mm
from postproc.report.blocks import DataTable, Section, Values

MOST_LISTED = 3  # work objects that get a line; a table has all
SHIFT = {
    "wobj": "work object",
    "dx_mm": "x [mm]",
    "dy_mm": "y [mm]",
    "dz_mm": "z [mm]",
    "rx_deg": "about x [deg]",
    "ry_deg": "about y [deg]",
    "rz_deg": "about z [deg]",
    "rest_mm": "rest [mm]",
    "left_out": "left out",
}


def rigid_shift_values(shift: RigidShift) -> Values:
    """Return an entry of ``rigid_shift`` of the ``postproc/compensate/1`` document [mm], [deg]."""
    moved = {f"d{axis}_mm": mm(x, 4) for axis, x in zip("xyz", shift.shift, strict=True)}
    turned = {f"r{axis}_deg": round(float(x), 6) for axis, x in zip("xyz", np.degrees(shift.turn), strict=True)}
    return {
        "wobj": shift.wobj,
        **moved,
        **turned,
        "about_mm": [mm(x, 2) for x in shift.center],
        "rest_mm": mm(shift.residual, 4),
        "at_welds": shift.at_welds,
        "left_out": shift.omitted,
    }


def work_object_section(values: Values) -> Section:
    """Return the section on rigid shifts: a line for each of the work objects that it welds in, and a table of all.

    Args:
        values: the document of the conversion.
    """
    rows: Sequence[Values] = values.get("rigid_shift", ())
    welds = [row for row in rows if row["at_welds"]]
    largest = sorted(welds or rows, key=_size, reverse=True)[:MOST_LISTED]
    table = [[_cell(key, row[key]) for key in SHIFT] for row in rows]
    shifts = DataTable("work objects", list(SHIFT.values()), table, brief=())
    note = "The rigid motion that fits the corrections of the arm at rest best, about the middle of the targets."
    return Section("Work objects, drawn offline or taught with this arm", [*map(_line, largest), shifts], note)


def from_programmed_path(values: Values) -> str:
    """Return a sentence, after a blank, on deviations from the path as programmed; empty if no other path is meant.

    Args:
        values: the document of the conversion.
    """
    drawn = values["from_programmed_path"]
    if drawn is None:
        return ""
    names = ", ".join(f"`{row['wobj']}`" for row in values["rigid_shift"] if row["left_out"])
    return (
        f" These are deviations from the path as this arm has taught {names}; from the path in the numbers of the"
        f" program they are {drawn['after_mm']:.3f} mm, and were {drawn['before_mm']:.3f} mm."
    )


def _line(row: Values) -> str:
    """Say how much of the correction in a work object is one rigid shift, and what it means to have taught it."""
    shift = ", ".join(f"{round(row[f'd{axis}_mm'], 2) + 0.0:.2f}" for axis in "xyz")  # no -0.00
    name, size, remaining = row["wobj"], _size(row), row["rest_mm"]
    if row["left_out"]:
        text = f"`{name}`: a rigid shift of ({shift}) mm, {size:.2f} mm, is left out; "
        return text + f"up to {remaining:.2f} mm is corrected."
    return (
        f"`{name}`: {size:.2f} mm of its correction is one rigid shift of ({shift}) mm, "
        f"at most {remaining:.2f} mm the rest; if this arm's own torch has taught it, it holds that shift already: "
        f"`--wobj-taught {name}`."
    )


def _cell(key: str, value: object) -> object:
    """Return a value as the table shows it: hundredths of a millimetre, thousandths of a degree, yes or no."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return round(float(value), 2 if key.endswith("_mm") else 3) + 0.0 if isinstance(value, float) else value


def _size(row: Values) -> float:
    """Return the length of the shift [mm]."""
    return float(np.linalg.norm([row[f"d{axis}_mm"] for axis in "xyz"]))
