"""The text of a model file: comments and order of the text it replaces are kept."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.model.arm import Model
from postproc.robot.cells.cell_file import stated_axes
from postproc.robot.pose import rpy, rpy_degrees

TIGHT = re.compile(r"^([^#\n].*\n)(?=\[fit\]$)", re.MULTILINE)
"""A header against the line before it, which is how tomlkit leaves it when a table is added there."""
LONG = 100  # characters


def render_model(model: Model, before: str = "") -> str:
    """Return the text of the model as TOML; comments and order of the replaced text are kept.

    Args:
        before: the file as the user wrote it; empty if there is none.
    """
    import tomlkit

    document = tomlkit.parse(before) if before else tomlkit.document()
    content: dict[str, Any] = {"robot": model.robot_name or model.robot.name}
    measured = list(model.measured_springs)
    if measured or model.stiffness_source:
        content["stiffness_source"] = "measured" if measured else model.stiffness_source
    else:
        document.pop("stiffness_source", None)
    if 0 < len(measured) < 6 or "measured_springs" in document:
        content["measured_springs"] = measured
    content |= _frames(model, document)
    if model.station is not None and model.station.joints and "external_axes" not in document:
        content["external_axes"] = stated_axes(model.station)
    content["effects"] = {e.key: e.to_file() for e in model.effects}
    if model.priors or "priors" in document:
        content["priors"] = {name: list(dataclasses.astuple(prior)) for name, prior in model.priors.items()}
    if model.fit:
        content["fit"] = dict(model.fit)
    _merge(document, content, prune=("effects", "priors", "fit"))
    text = tomlkit.dumps(document)
    return text if TIGHT.search(before) else TIGHT.sub(r"\1\n", text)


def _frames(model: Model, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables ``mounting`` and ``tool``; angles of an equal rotation stay as the document states them."""

    def angles(table: str, R: Array) -> list[float]:
        """Return roll, pitch, yaw [deg] of R; those of the table, if they mean the same rotation."""
        before: list[float] = list(_unwrapped(document.get(table, {})).get("rpy_deg", [0.0, 0.0, 0.0]))
        if np.allclose(rpy(np.radians(np.array(before, float))), R, atol=1e-12):
            return before
        return [float(angle) for angle in rpy_degrees(R)]

    tool: dict[str, Any] = {"xyz_mm": [round(float(x) * 1e3, 9) + 0.0 for x in model.T_flange_tcp[:3, 3]]}
    turn = angles("tool", model.T_flange_tcp[:3, :3])
    if any(turn) or "rpy_deg" in document.get("tool", {}):
        tool["rpy_deg"] = turn
    return {"mounting": {"rpy_deg": angles("mounting", model.R_world_base)}, "tool": tool}


def _merge(table: Any, content: Mapping[str, Any], prune: tuple[str, ...] = ()) -> None:
    """Write values into a tomlkit table: equal ones stay as the user wrote them, changed ones keep their comment.

    Args:
        content: the values by key, with tables as mappings.
        prune: keys of tables from which entries that ``content`` lacks are deleted; if empty, from all tables in it.
    """
    for key, value in content.items():
        if isinstance(value, Mapping):
            if key not in table:
                import tomlkit

                table[key] = tomlkit.table(is_super_table=key == "effects" and bool(value))
            for old in [k for k in table[key] if k not in value] if key in prune or not prune else []:
                del table[key][old]
            _merge(table[key], value)
        elif key not in table or _unwrapped(table[key]) != value:
            table[key] = _in_lines(value)


def _in_lines(value: Any) -> Any:
    """Return a value of many lines as TOML: a text of several, or a list of texts of over 100 characters in all.

    Any other value comes back unchanged.
    """
    import tomlkit

    if isinstance(value, str) and "\n" in value:
        return tomlkit.string(value, literal=True, multiline=True)
    if not isinstance(value, list) or not all(isinstance(x, str) for x in value) or sum(map(len, value)) < LONG:
        return value
    array = tomlkit.array()
    array.extend(value)
    return array.multiline(True)


def _unwrapped(item: Any) -> Any:
    """Return the plain Python value of a tomlkit item."""
    return item.unwrap() if hasattr(item, "unwrap") else item
