"""Planned postures as a measurement table whose columns of measured numbers are to be filled in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import AXES, COLUMNS, State
from postproc.identification.planning.setups import SHOP, SetupPlan

READ_TWICE = 2
"""Readings of a gauge without its load, and as many with it."""


def posture_columns(state: State, extax: Array | None = None) -> dict[str, list[str]]:
    """Return the columns of a table that say where n states stand, from which side they are reached, and their loads.

    Args:
        extax: (n, 6) external axes [mm], [deg], NaN for axes that are not there.
    """
    columns = _cells(COLUMNS["q"], np.degrees(state.q), ".4f") | _cells(COLUMNS["approach"], state.approach, "+.0f")
    mass, center, wrench = state.payload_mass, state.payload_center, state.wrench
    columns |= _cells(COLUMNS["payload"][:1], None if mass is None else mass[:, None])
    columns |= _cells(COLUMNS["payload"][1:], None if mass is None or center is None else 1e3 * center)
    columns |= _cells(COLUMNS["wrench"][:3], None if wrench is None else wrench[:, :3])
    if extax is not None:
        present = np.flatnonzero(np.isfinite(extax).all(axis=0))
        columns |= _cells([f"eax_{AXES[k]}" for k in present.tolist()], extax[:, present])
    return columns


def as_csv(ids: Sequence[str], columns: Mapping[str, Sequence[str]]) -> str:
    """Return a table with the names (n,) of the postures and n cells of each column."""
    rows = zip(ids, *columns.values(), strict=True)
    return "\n".join([",".join(["pose_id", *columns]), *map(",".join, rows)]) + "\n"


def setups_csv(plan: SetupPlan) -> str:
    """Return the table of planned set-ups; of a gauge four rows each, without and with its load, twice.

    Rows of a gauge have the name of their set-up: the stand may be moved between two of them. What is read twice tells
    a slip of the pen, which the springs of an arm would take up.
    """
    state, ids, names, direction = plan.state, plan.ids, list(plan.names), plan.direction
    if plan.kind == "gauge":
        each = 2 * READ_TWICE
        names, ids = np.repeat(ids, each).tolist(), [f"{name}{on}" for name in ids for on in ("", "L") * READ_TWICE]
        state, direction = state.rows(np.repeat(np.arange(len(state)), each)), np.repeat(direction, each, axis=0)
        on = np.tile([0.0, 1.0], READ_TWICE * len(plan.state))
        mass, wrench = on * np.asarray(state.payload_mass), state.wrench
        state = state.with_(payload_mass=mass, wrench=None if wrench is None else on[:, None] * wrench)
    columns, kind = posture_columns(state), SHOP[plan.kind]
    if kind.column:
        columns[kind.column] = names
    if plan.kind == "gauge":
        columns |= _cells(("nx", "ny", "nz"), direction)
    return as_csv(ids, columns | {name: [""] * len(ids) for name in kind.reading})


def _cells(names: Sequence[str], values: Array | None, form: str = ".8g") -> dict[str, list[str]]:
    """Return columns of numbers (n, c) under their names, none for None."""
    if values is None:
        return {}
    return {name: [format(x, form) for x in column] for name, column in zip(names, values.T.tolist(), strict=True)}
