"""Reading a measurement table into one value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError, Source, has_errors
from postproc.effects.contract import State
from postproc.measure import columns as names
from postproc.measure.cells import Cells, read_cells
from postproc.measure.checks import check_measurements
from postproc.measure.columns import UNITS, ColumnMap, MappedColumn, read_column_map, unit_of
from postproc.measure.commanded import commanded_joints, program_targets
from postproc.measure.measurements import Measurements
from postproc.measure.trajectory import with_motion
from postproc.robot.arm import Robot


def read_measurements(
    source: Source,
    robot: Robot,
    program: Source | None = None,
    column_map: Source | Mapping[str, Any] | None = None,
    measured: bool = True,
) -> Measurements:
    """Read a measurement table and check it against the arm.

    Args:
        source: the table; comma, dot decimals and the standard column names unless the column map says otherwise.
        robot: gives the nominal kinematics for commanded poses and for the checks of units and columns.
        program: the RAPID program that was run, for tables with a ``target`` column.
        column_map: how another layout writes its columns, see ``read_column_map``.
        measured: False for poses that are only asked about, or have yet to be measured.

    Raises:
        PostprocError: DAT001 to DAT009, where the table cannot be what it says.
    """
    diagnostics: list[Diagnostic] = []
    layout = read_column_map(column_map)
    table = _Table(read_cells(source, layout, diagnostics), layout, diagnostics)
    n = len(table.cells.rows)
    rotation = table.rotation(names.ORIENTATION)
    measured_joints = table.vector(names.MEASURED_JOINTS)
    position = table.vector(names.POSITION)
    if position is None:
        position = np.full((n, 3), np.nan)
        if measured and rotation is None and measured_joints is None:
            message = "nothing was measured: there is no column `x_mm`, `y_mm`, `z_mm`, nor `qw`, nor `mq1_deg`"
            raise PostprocError(Diagnostic("DAT002", "error", message, source, help=_help(table.cells)))
    q, T_flange_tcp = _commanded(table, robot, program)
    sessions = table.text("session")
    session_names = tuple(dict.fromkeys(sessions)) if sessions else ()
    payload_center = table.vector(names.PAYLOAD[1:], fill=0.0)
    state = State(
        q=q,
        v=table.vector(names.SPEED, fill=0.0),
        a=table.vector(names.ACCELERATION, fill=0.0),
        approach=table.vector(names.APPROACH, fill=0.0),
        payload_mass=table.column("payload_kg", fill=0.0),
        payload_center=payload_center,
        wrench=table.vector(names.WRENCH, fill=0.0, partial=True),
        temperature=table.column("temperature_C", fill="median"),
        time=table.column("time_s", fill="median"),
        session=np.array([session_names.index(s) for s in sessions]) if sessions else None,
        session_names=session_names,
        channels=table.others(),
    )
    if T_flange_tcp is not None:
        state = state.with_(T_flange_tcp=T_flange_tcp)
    if "time_s" in table.place:
        state, findings = with_motion(state, source)
        diagnostics += findings
    sigma = table.column("sigma_mm")
    data = Measurements(
        state=state,
        position=position,
        rotation=rotation,
        joint=measured_joints,
        sigma=None if sigma is None or not np.isfinite(sigma).any() else sigma,
        pose_id=tuple(table.text("pose_id") or (str(i + 1) for i in range(n))),
        row=tuple(range(1, n + 1)),
        line=table.cells.lines,
        tool_known=T_flange_tcp is not None,
        source=source,
    )
    diagnostics += check_measurements(data, robot, table.cells)
    if has_errors(diagnostics):
        raise PostprocError(diagnostics)
    return replace(data, diagnostics=tuple(diagnostics))


class _Table:
    """Cells looked up by standard column name, converted to SI; what is missing is reported as it is asked for."""

    def __init__(self, cells: Cells, layout: ColumnMap, diagnostics: list[Diagnostic]) -> None:
        self.cells = cells
        self.diagnostics = diagnostics
        self.place = self._find(layout)

    def _find(self, layout: ColumnMap) -> dict[str, MappedColumn]:
        header = self.cells.header
        lower = {theirs.lower(): theirs for theirs in reversed(header)}
        standard = (name for name in (*names.TEXT, *names.NUMBERS) if name.lower() in lower)
        place = {
            name: MappedColumn(name if name in header else lower[name.lower()], unit_of(name)) for name in standard
        }
        for name, mapped in layout.columns.items():
            theirs = (
                header[mapped.name - 1] if isinstance(mapped.name, int) and mapped.name <= len(header) else mapped.name
            )
            if theirs not in header:
                message = f"the column map names `{mapped.name}` for `{name}`, and the table has no such column"
                raise PostprocError(Diagnostic("DAT002", "error", message, self.cells.source, help=_help(self.cells)))
            place[name] = replace(mapped, name=theirs)
        return place

    def text(self, name: str) -> list[str]:
        return self.cells.text(str(self.place[name].name)) if name in self.place else []

    def column(self, name: str, fill: float | str | None = None) -> Array | None:
        if name not in self.place:
            return None
        mapped = self.place[name]
        values = mapped.sign * self.cells.numbers(str(mapped.name), self.diagnostics) + mapped.offset
        values = values * UNITS[mapped.unit]
        gaps = ~np.isfinite(values)
        if fill is None or not gaps.any():
            return values
        if gaps.all():
            return None
        value = float(np.median(values[~gaps])) if fill == "median" else float(fill)
        first = int(np.flatnonzero(gaps)[0])
        taken = f"{value / UNITS[mapped.unit]:g} is taken there"
        message = f"column `{mapped.name}` is empty in {gaps.sum()} of {len(values)} rows; {taken}"
        span = self.cells.span(first)
        self.diagnostics.append(
            Diagnostic("DAT005", "warning", message, self.cells.source, span, "fill in the cells, or remove the column")
        )
        return np.where(gaps, value, values)

    def vector(self, wanted: Sequence[str], fill: float | None = None, partial: bool = False) -> Array | None:
        present = [name for name in wanted if name in self.place]
        if not present:
            return None
        if len(present) < len(wanted) and not partial:
            missing = ", ".join(f"`{name}`" for name in wanted if name not in present)
            message = f"there is a column `{present[0]}` and no {missing}"
            severity = "warning" if fill is not None else "error"
            found = Diagnostic("DAT002", severity, message, self.cells.source, help=_help(self.cells))  # type: ignore[arg-type]
            if fill is None:
                raise PostprocError(found)
            self.diagnostics.append(found)
        zeros = np.zeros(len(self.cells.rows))
        parts = [self.column(name, fill) for name in wanted]
        return np.stack([zeros if part is None else part for part in parts], axis=1)

    def rotation(self, wanted: Sequence[str]) -> Array | None:
        quaternion = self.vector(wanted)
        if quaternion is None:
            return None
        return _rotation(quaternion, self.cells, self.diagnostics)

    def others(self) -> dict[str, Array]:
        """Columns that the standard layout does not know, where they hold numbers."""
        taken = {str(mapped.name) for mapped in self.place.values()}
        found: dict[str, Array] = {}
        for name in self.cells.header:
            if name not in taken and name:
                values = self.cells.numbers(name, [])
                if np.isfinite(values).all():
                    found[name] = values
        return found


def _rotation(quaternion: Array, cells: Cells, diagnostics: list[Diagnostic]) -> Array:
    """(n, 4) quaternions, scalar first -> (n, 3, 3).

    A norm that is not 1 is reported as DAT008, the row then has no orientation.
    """
    from scipy.spatial.transform import Rotation

    norm = np.linalg.norm(quaternion, axis=1)
    bad = np.isfinite(norm) & (np.abs(norm - 1) > 1e-2)
    for i in np.flatnonzero(bad)[:5]:
        message = f"the quaternion of this row has the length {norm[i]:.4f} instead of 1; its orientation is not used"
        diagnostics.append(
            Diagnostic("DAT008", "warning", message, cells.source, cells.span(int(i)), "check columns qw,qx,qy,qz")
        )
    good = np.isfinite(norm) & ~bad
    rotation = np.full((len(quaternion), 3, 3), np.nan)
    if good.any():
        rotation[good] = Rotation.from_quat(quaternion[good][:, [1, 2, 3, 0]]).as_matrix()
    return rotation


def _commanded(table: _Table, robot: Robot, program: Source | None) -> tuple[Array, Array | None]:
    q = table.vector(names.JOINTS)
    if q is not None:
        return q, None
    cells = table.cells
    if "target" in table.place and program is not None:
        return program_targets(program, robot, table.text("target"), cells, table.diagnostics)
    position = table.vector(names.COMMAND_POSITION)
    rotation = table.rotation(names.COMMAND_ORIENTATION)
    if position is None or rotation is None:
        message = "there are no commanded joint angles: neither `q1_deg` .. `q6_deg` nor `cmd_x_mm` .. `cmd_qz`"
        if "target" in table.place:
            message = "column `target` names robtargets, and the program that was run is not given"
        raise PostprocError(Diagnostic("DAT002", "error", message, cells.source, help=_help(cells)))
    configuration = table.vector(names.CONFIGURATION, fill=0.0)
    return commanded_joints(robot, position, rotation, configuration, cells, table.diagnostics), None


def _help(cells: Cells) -> str:
    shown = ", ".join(cells.header[:8]) + (", ..." if len(cells.header) > 8 else "")
    likely = names.likely_map(cells.header)
    if likely:
        return f"the table has the columns {shown}; if these are meant, give a column map with the lines:\n{likely}"
    return f"the table has the columns {shown}; name others with a column map (`postproc explain DAT002`)"
