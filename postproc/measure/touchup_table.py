"""Touch-ups as a measurement table, and what they can tell of an arm whose work may stand elsewhere."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from hashlib import sha256
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from postproc.arrays import Array, invert
from postproc.compensation.correction.rigid_shift import fit_rigid
from postproc.diagnostics import Diagnostic, Source
from postproc.grouping import grouped
from postproc.measure.read import columns as names
from postproc.measure.touchups import TouchUp, TouchUps
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.motion.path.places import NOWHERE, unit_of
from postproc.rapid.motions.units import MM, object_matrix
from postproc.robot.cells.station import Station
from postproc.robot.kinematics import forward
from postproc.robot.pose import transform

UNKNOWN_SHARE = 0.5
"""Standard deviation of the share of the deflection that touch-ups tell, from which they tell little."""


def touchup_table(touchups: TouchUps, sources: Sequence[Source], noise_mm: float, free: bool) -> str:
    """Return the rows of touch-ups as a measurement table (CSV), headed by the programs that they came from.

    Args:
        sources: files of the touched programs. noise_mm: standard deviation of a touch-up per axis.
        free: points are in their work objects, each of which is a session with a place of its own; else in the frame in
            which the work objects stand.
    """
    state = touchups.state
    T_object = np.array([_placed(use, touchups.station) for use in touchups.rows])
    T_point = transform(np.array([use.nominal for use in touchups.rows]) * MM)
    if not free:
        T_object, T_point = np.tile(np.eye(4), (len(state), 1, 1)), T_object @ T_point
    blocks = [
        (names.JOINT_COLUMNS, np.degrees(state.q), ".6f"),
        (names.POSITION, T_point[:, :3, 3] / MM, ".4f"),
        (names.TOOL_POSITION, state.T_flange_tcp[:, :3, 3] / MM, ".4f"),
        (names.TOOL_ORIENTATION, _quaternions(state.T_flange_tcp), ".9f"),
        (names.PAYLOAD_COLUMNS[:1], np.asarray(state.payload_mass)[:, None], ".6g"),
        (names.PAYLOAD_COLUMNS[1:], np.asarray(state.payload_center) / MM, ".3f"),
        (("sigma_mm",), np.full((len(state), 1), noise_mm), "g"),
        (names.EXTERNAL_AXES, np.array([use.event.axes or NOWHERE for use in touchups.rows]), ".6g"),
        (names.OBJECT_POSITION, T_object[:, :3, 3] / MM, ".4f"),
        (names.OBJECT_ORIENTATION, _quaternions(T_object), ".9f"),
    ]
    columns = {"pose_id": [use.name for use in touchups.rows]}
    for header, values, form in blocks:
        cells = [[format(x, form) if np.isfinite(x) else "" for x in column] for column in values.T.tolist()]
        columns |= {name: column for name, column in zip(header, cells, strict=True) if any(column)}
    if free:
        columns["session"] = [use.event.wobj.name for use in touchups.rows]
    out = io.StringIO()
    for source in sources:
        out.write(f"# touched-up program: {Path(source.path).name} sha256 {sha256(source.data).hexdigest()}\n")
    csv.writer(out, lineterminator="\n").writerows([columns, *zip(*columns.values(), strict=True)])
    return out.getvalue()


def share_deviation(touchups: TouchUps, model: Model, noise_mm: float, free: bool) -> float:
    """Return the standard deviation of the share of the arm's expected deflection that touch-ups tell.

    With d_i the deflection of the model at a row, less the rigid motion of its work object that fits them best where
    that is free, and s the noise, a factor k of all deflections is known to s / sqrt(sum |d_i|^2).
    """
    state, wobj = touchups.state, np.array([use.event.wobj.name for use in touchups.rows])
    nominal = (forward(model.robot, state.q) @ state.T_flange_tcp)[:, :3, 3]
    deflection = predict(Model(model.robot, model.effects, model.R_world_base), state)[:, :3, 3] - nominal
    for rows in (wobj == name for name in set(wobj.tolist()) if free):
        center, shift, turn = fit_rigid(nominal[rows], deflection[rows])
        deflection[rows] -= shift + np.cross(turn, nominal[rows] - center)
    squares = np.sum(deflection**2)
    return float(noise_mm * MM / np.sqrt(squares)) if squares > 0 else np.inf


def touchup_findings(touchups: TouchUps, deviation: float | None, sources: Sequence[Source]) -> Iterator[Diagnostic]:
    """Yield what touch-ups cannot tell: targets that were moved together (DAT050), too few postures (DAT051).

    DAT052 (error) where no target was touched up.

    Args:
        deviation: of `share_deviation`, None where no model is known. sources: files of the touched programs.
    """
    moves = grouped(((u.event.wobj.name, tuple(np.round(u.moved, 2).tolist())), u) for u in touchups.shifted)
    for (wobj, vector), some in moves.items():
        message = (
            f"{len(some)} targets in `{wobj}` were moved by the same vector {list(vector)} mm: whether the arm or "
        )
        message += "the work was off cannot be told, and they give no rows"
        help_ = "touch up each of these targets by itself, or correct the work object in place of its targets"
        statement = some[0].event.statement
        yield Diagnostic("DAT050", "warning", message, statement.source, statement.span, help_)
    if not touchups.rows and not moves:
        reasons = "; ".join(f"{count} {reason}" for reason, count in touchups.omitted.items())
        message = f"none of {touchups.compared} targets was touched up" + (f": {reasons}" if reasons else "")
        help_ = "name the version before and the one after touching up, in this order; both need the same routines"
        yield Diagnostic("DAT052", "error", message, help=help_)
    if deviation is not None and deviation > UNKNOWN_SHARE:
        message = (
            f"these {len(touchups.rows)} postures hardly tell the arm from the place of its work: how far the arm "
        )
        message += (
            f"yields is known to {100 * min(deviation, 9.99):.0f} % of itself, for a shift of the work does the same"
        )
        help_ = "add targets near and far, high and low; or say `--wobj-fixed` where the place of the work was measured"
        yield Diagnostic("DAT051", "warning", message, next(iter(sources), None), help=help_)


def _placed(use: TouchUp, station: Station) -> Array:
    """Return the work object (4, 4) [m] of a touch-up in the frame of tables: the unit that carries work, or the world.

    Axes that nobody states stand at 0, as for a table without their columns.
    """
    positions = station.positions(np.nan_to_num([use.event.axes or NOWHERE]))
    units = unit_of(use.event), station.work
    frame, reference = (np.eye(4) if unit is None else station.world(unit, positions)[0] for unit in units)
    return np.asarray(invert(reference) @ frame @ object_matrix(use.event.wobj))


def _quaternions(T: Array) -> Array:
    """Return the orientations (n, 4) of poses (n, 4, 4), scalar first."""
    return np.asarray(Rotation.from_matrix(T[:, :3, :3]).as_quat(canonical=True, scalar_first=True))
