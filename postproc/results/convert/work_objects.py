"""How much of a correction is one rigid shift of a work object, in words: drawn offline, or taught with this arm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.compensation.correction.rigid_shift import WORLD, RigidShift
from postproc.numbers import mm
from postproc.report.blocks import DataTable, Section, Values

MOST_LISTED = 3  # work objects that get a line; a table has all
SHIFT_NOTE = "The rigid motion that fits the corrections of the arm at rest best, about the middle of the targets."
TAUGHT = "If `{0}` was taught {1}, it holds its shift already: leave it out with `--wobj-taught {0}`."
BY_TORCH, AT_TOOL = "with this arm's own torch", "on this arm at the stationary tool, turned as in these targets"
SHIFT = {
    "wobj": "work object",
    "dx_mm": "x",
    "dy_mm": "y",
    "dz_mm": "z",
    "rx_deg": "x [deg]",
    "ry_deg": "y [deg]",
    "rz_deg": "z [deg]",
    "rest_mm": "the rest",
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
        "held": shift.robot_holds,
        "places": shift.places,
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
    digits = [None if key in ("wobj", "left_out") else 3 if key.endswith("_deg") else 2 for key in SHIFT]
    brief = [i for i, row in enumerate(rows) if row in largest]
    shifts = DataTable("work objects", list(SHIFT.values()), table, brief=brief, decimals=digits)
    open_ = [row for row in largest if not row["left_out"] and row["wobj"].lower() != WORLD]
    advice = [TAUGHT.format(row["wobj"], AT_TOOL if row["held"] else BY_TORCH) for row in open_[:1]]
    return Section("Of the correction, one rigid shift of each work object [mm]", [shifts, *advice], SHIFT_NOTE)


def _cell(key: str, value: object) -> object:
    """Return a value as the table shows it: hundredths of a millimetre, thousandths of a degree, yes or no."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return round(float(value), 2 if key.endswith("_mm") else 3) + 0.0 if isinstance(value, float) else value


def _size(row: Values) -> float:
    """Return the length of the shift [mm]."""
    return float(np.linalg.norm([row[f"d{axis}_mm"] for axis in "xyz"]))
