"""Seam points as a vision system delivers them: a CSV table read, every wrong cell named by row and column."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array
from postproc.diagnostics import Diagnostic, PostprocError, Severity, Source, Span
from postproc.measure.read.cells import Cells, read_cells
from postproc.measure.read.layout import ColumnMap
from postproc.measure.read.values import as_number
from postproc.numbers import read_number

POSITION_COLUMNS = ("x_mm", "y_mm", "z_mm")
QUATERNION = ("qw", "qx", "qy", "qz")
TANGENT, NORMAL = ("tx", "ty", "tz"), ("nx", "ny", "nz")
SPEED_COLUMN = "speed_mm_s"

NEAREST_MM = 0.1  # the shortest move a controller makes (RAPID reference, MoveC)
LARGEST_COORDINATE_MM = 1e6  # no arm reaches a kilometre
UNIT_NORM_WITHIN = 0.01  # a quaternion this far from length one is a mistake, not rounding
PARALLEL = math.radians(5.0)  # a normal this close to the tangent does not say how the torch stands
BACK = math.radians(
    120.0
)  # a seam that turns by more than this runs back along itself: rows in disorder, or an outlier
TWIST = math.radians(90.0)  # a torch that turns by more than this from point to point: an axis or a sign is wrong


@dataclass(frozen=True)
class SeamPoints:
    """Points of one seam, in the frame of the work object.

    Args:
        rows: span of each row in ``source``.
        place_mm: (n, 3) positions.
        rotation: (n, 3, 3) tool axes: z out of the torch, x along the seam where a tangent is given.
        speed_mm_s: (n,) welding speed on the way to each point, None where the table says nothing.
    """

    source: Source
    rows: tuple[Span, ...]
    place_mm: Array
    rotation: Array
    speed_mm_s: Array | None = None

    def finding(self, code: str, index: int, message: str, help_: str = "", severity: Severity = "error") -> Diagnostic:
        """A diagnostic about the point of that index (from 0), placed at its row."""
        row = self.source.row(self.rows[index][0])
        return Diagnostic(code, severity, f"row {row}: {message}", self.source, self.rows[index], help_)

    def doubts(self) -> list[Diagnostic]:
        """SEA010 (warning) for points where the seam turns by more than 120 deg, or the torch by more than 90 deg."""
        way = np.diff(self.place_mm, axis=0)
        length = np.linalg.norm(way, axis=1)
        bend = np.arccos(np.clip(np.sum(way[1:] * way[:-1], axis=1) / (length[1:] * length[:-1]), -1.0, 1.0))
        turn = Rotation.from_matrix(np.swapaxes(self.rotation[:-1], 1, 2) @ self.rotation[1:]).magnitude()
        doubts = [
            (int(i) + 1, f"the seam turns back here, by {math.degrees(bend[i]):.0f} deg", "check the order of the rows")
            for i in np.flatnonzero(bend > BACK)
        ]
        doubts += [
            (int(i) + 1, f"the torch turns by {math.degrees(turn[i]):.0f} deg from the point before", "check its axes")
            for i in np.flatnonzero(turn > TWIST)
        ]
        return [self.finding("SEA010", i, text, help_, "warning") for i, text, help_ in sorted(doubts)]


@dataclass(frozen=True)
class _SeamTable:
    """Cells of a seam table, its lower-case column names, and the findings collected so far."""

    cells: Cells
    header: Sequence[str]
    findings: list[Diagnostic]

    def numbers(self, names: Sequence[str]) -> Array:
        """The named columns as numbers (n, len(names)); a cell that is no number becomes NaN and adds a finding."""
        places = [self.header.index(name) for name in names]
        values = [[self._number(row, at) for at in places] for row in range(len(self.cells.rows))]
        return np.array(values, dtype=float).reshape(-1, len(names))

    def _number(self, row: int, at: int) -> float:
        """The number in row and column (from 0), NaN with a finding SEA002 if it is none or too large."""
        text = self.cells.rows[row][at]
        try:
            value = read_number(as_number(text, self.cells.decimal))
        except ValueError:
            value = math.nan
        if not abs(value) < LARGEST_COORDINATE_MM:
            what = f"`{text}` is not a number" if text else "nothing stands here"
            what = f"`{text}` is too large" if LARGEST_COORDINATE_MM <= abs(value) < math.inf else what
            help_ = "a point needs all its numbers: take the row out or measure it again"
            self.wrong("SEA002", row, at, what, help_)
            return math.nan
        return value

    def wrong(self, code: str, row: int, at: int, what: str, help_: str) -> None:
        """Add an error at a cell, by row and column (from 0); ``what`` says what is wrong, ``help_`` what to do."""
        message = f"row {self.cells.lines[row]}, column `{self.header[at]}`: {what}"
        self.findings.append(Diagnostic(code, "error", message, self.cells.source, self.cells.span(row), help_))


def read_seam_points(source: Source) -> SeamPoints:
    """Read a table of seam points.

    The tool axes follow from tangent t and surface normal n: z = -n, x = t without its part along z, y = z x x.

    Raises:
        PostprocError: every wrong cell and row at once; SEA001 not such a table, SEA002 not a number, SEA003 no
            orientation, SEA004 points too close, SEA005 no welding speed, SEA006 fewer than two points.
    """
    table = _split(source)
    missing = [name for name in POSITION_COLUMNS if name not in table.header]
    turned = all(name in table.header for name in QUATERNION)
    led = all(name in table.header for name in (*TANGENT, *NORMAL))
    if missing or not (turned or led):
        lacks = ", ".join(f"`{name}`" for name in missing) or "the orientation"
        help_ = "columns: x_mm,y_mm,z_mm with qw,qx,qy,qz or with tx,ty,tz,nx,ny,nz; speed_mm_s if it varies"
        finding = Diagnostic("SEA001", "error", f"the table lacks {lacks}", source, (0, 1), help_)
        raise PostprocError([*table.findings, finding])
    place = table.numbers(POSITION_COLUMNS)
    rotation = _by_quaternion(table) if turned else _by_tangent(table)
    speed = None
    if SPEED_COLUMN in table.header:
        speed = table.numbers((SPEED_COLUMN,))[:, 0]
        for i in np.flatnonzero(speed <= 0):
            what = f"{speed[i]:g} mm/s is not a welding speed"
            table.wrong("SEA005", int(i), table.header.index(SPEED_COLUMN), what, "give a positive speed")
    gaps = np.linalg.norm(np.diff(place, axis=0), axis=1)
    close = np.flatnonzero(gaps < NEAREST_MM)
    help_ = "take one of the two rows out"
    if len(close) > max(1, len(gaps) // 2):
        close, help_ = close[:1], "most points are that close: are they in metres? The columns are in millimetres"
    for i in close:
        what = f"only {gaps[i]:.3f} mm from the point before, at least {NEAREST_MM:g} mm are needed"
        table.wrong("SEA004", int(i) + 1, table.header.index("x_mm"), what, help_)
    if len(place) < 2:
        finding = Diagnostic("SEA006", "error", "a seam needs two points or more", source, help="add rows to the table")
        table.findings.append(finding)
    if table.findings:
        raise PostprocError(sorted(table.findings, key=lambda finding: finding.span or (0, 0)))
    return SeamPoints(source, tuple(map(table.cells.span, range(len(place)))), place, rotation, speed)


def _by_quaternion(table: _SeamTable) -> Array:
    """Rotations (n, 3, 3) from the quaternion columns; SEA003 for each whose length is not 1 within 1 %."""
    q = table.numbers(QUATERNION)
    length = np.linalg.norm(q, axis=1)
    for i in np.flatnonzero(np.abs(length - 1.0) > UNIT_NORM_WITHIN):
        what = f"the quaternion has length {length[i]:.4f}, not 1"
        table.wrong("SEA003", int(i), table.header.index("qw"), what, "check the order qw,qx,qy,qz")
    usable = np.abs(length - 1.0) <= UNIT_NORM_WITHIN
    q = np.where(usable[:, None], q, (1.0, 0.0, 0.0, 0.0))
    return np.asarray(Rotation.from_quat(q, scalar_first=True).as_matrix(), dtype=float)


def _by_tangent(table: _SeamTable) -> Array:
    """Rotations (n, 3, 3) from tangent and normal columns; SEA003 for each without length or nearly parallel."""
    t, n = table.numbers(TANGENT), table.numbers(NORMAL)
    lengths = np.linalg.norm(t, axis=1), np.linalg.norm(n, axis=1)
    for name, length in zip(("tx", "nx"), lengths, strict=True):
        for i in np.flatnonzero(length < 1e-6):
            which = "tangent" if name == "tx" else "normal"
            table.wrong("SEA003", int(i), table.header.index(name), f"the {which} has no length", "give a direction")
    safe = [v / np.where(length < 1e-6, np.nan, length)[:, None] for v, length in zip((t, n), lengths, strict=True)]
    z = -safe[1]
    x = safe[0] - np.sum(safe[0] * z, axis=1, keepdims=True) * z
    sine = np.linalg.norm(x, axis=1)
    for i in np.flatnonzero(sine < math.sin(PARALLEL)):
        what = f"the normal stands {math.degrees(math.asin(sine[i])):.1f} deg from the tangent"
        help_ = "the normal of the surface is at a right angle to the seam"
        table.wrong("SEA003", int(i), table.header.index("nx"), what, help_)
    x = x / np.where(sine < 1e-9, np.nan, sine)[:, None]
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _split(source: Source) -> _SeamTable:
    """Header and rows of a seam table, read like a measurement table.

    Raises:
        PostprocError: SEA001, it is no table, or a row does not have all its cells.
    """
    warnings: list[Diagnostic] = []
    try:
        cells = read_cells(source, ColumnMap(), warnings)
    except PostprocError as error:
        raise PostprocError([replace(d, code="SEA001") for d in error.diagnostics]) from None
    help_ = "check for a missing separator or a decimal comma"
    findings = [replace(d, code="SEA001", severity="error", help=help_) for d in warnings if d.severity != "info"]
    if findings:
        raise PostprocError(findings)
    header = [name.strip('"').lower() for name in cells.header]
    for i, name in enumerate(header):
        if name in (*POSITION_COLUMNS, *QUATERNION, *TANGENT, *NORMAL, SPEED_COLUMN) and name in header[:i]:
            text = f"column `{name}` stands twice in the header"
            findings.append(Diagnostic("SEA001", "error", text, source, help="take one of them out"))
    return _SeamTable(cells, header, findings)
