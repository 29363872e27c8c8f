"""Planned postures as a measurement table whose columns of measured numbers are to be filled in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from postproc.arrays import Array
from postproc.channels.state import AXES, COLUMNS, State
from postproc.identification.planning.setups import SHOP, SetupPlan


def posture_columns(state: State, extax: Array | None = None) -> dict[str, list[str]]:
    """Return the columns of a table that say where n states stand, from which side they are reached, and their loads.

    Args:
        extax: (n, 6) external axes [mm], [deg], NaN for axes that are not there.
    """
    columns = {name: [f"{x:.4f}" for x in q] for name, q in zip(COLUMNS["q"], np.degrees(state.q).T, strict=True)}
    if state.approach is not None:
        columns |= _cells(COLUMNS["approach"], state.approach, "+.0f")
    if state.payload_mass is not None:
        columns |= _cells(COLUMNS["payload"][:1], state.payload_mass[:, None])
        if state.payload_center is not None:
            columns |= _cells(COLUMNS["payload"][1:], 1e3 * state.payload_center)
    if state.wrench is not None:
        columns |= _cells(COLUMNS["wrench"][:3], state.wrench[:, :3])
    if extax is not None:
        present = np.flatnonzero(np.isfinite(extax).all(axis=0))
        columns |= _cells([f"eax_{AXES[k]}" for k in present.tolist()], extax[:, present])
    return columns


def as_csv(ids: Sequence[str], columns: Mapping[str, Sequence[str]]) -> str:
    """Return a table with the names (n,) of the postures and n cells of each column."""
    rows = zip(ids, *columns.values(), strict=True)
    return "\n".join([",".join(["pose_id", *columns]), *map(",".join, rows)]) + "\n"


def setups_csv(plan: SetupPlan) -> str:
    """Return the table of planned set-ups; of a gauge two rows each, without and with its load.

    Rows of a gauge have the name of their set-up: the stand may be moved between two of them.
    """
    state, ids, names, direction = plan.state, plan.ids, list(plan.names), plan.direction
    if plan.kind == "gauge":
        names, ids = np.repeat(ids, 2).tolist(), [f"{name}{on}" for name in ids for on in ("", "L")]
        state, direction = state.rows(np.repeat(np.arange(len(state)), 2)), np.repeat(direction, 2, axis=0)
        on = np.tile([0.0, 1.0], len(plan.state))
        mass, wrench = on * np.asarray(state.payload_mass), state.wrench
        state = state.with_(payload_mass=mass, wrench=None if wrench is None else on[:, None] * wrench)
    columns, kind = posture_columns(state), SHOP[plan.kind]
    if kind.column:
        columns[kind.column] = names
    if plan.kind == "gauge":
        columns |= _cells(("nx", "ny", "nz"), direction)
    return as_csv(ids, columns | {name: [""] * len(ids) for name in kind.reading})


def _cells(names: Sequence[str], values: Array, form: str = ".8g") -> dict[str, list[str]]:
    """Return columns of numbers (n, c) under their names."""
    return {name: [format(x, form) for x in column] for name, column in zip(names, values.T.tolist(), strict=True)}
