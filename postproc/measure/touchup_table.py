"""Touch-ups as a measurement table, and what they can tell of an arm whose work may stand elsewhere."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterator, Sequence

import numpy as np

from postproc.arrays import Array, invert
from postproc.compensation.correction.rigid_shift import fit_rigid
from postproc.diagnostics import Diagnostic, Source
from postproc.grouping import grouped
from postproc.measure.read import columns as names
from postproc.measure.touchups import TouchUp, TouchUps
from postproc.model.arm import Model
from postproc.model.equilibrium import predict
from postproc.motion.path.places import NOWHERE, unit_of
from postproc.rapid.data.records import NO_AXIS, Pose
from postproc.rapid.motions.units import matrix_pose, object_matrix
from postproc.robot.cells.station import Station
from postproc.robot.kinematics import forward

UNKNOWN_SHARE = 0.5
"""Standard deviation of the share of the deflection that touch-ups tell, from which they tell little."""


def touchup_table(touchups: TouchUps, sources: Sequence[Source], noise_mm: float, free: bool) -> str:
    """Return the rows of touch-ups as a measurement table (CSV), headed by the programs that they came from.

    Args:
        sources: files of the touched programs. noise_mm: standard deviation of a touch-up per axis.
        free: points are in their work objects, each of which is a session with a place of its own; else in the frame in
            which the work objects stand.
    """
    axes = [k for k in range(6) if any(_axis(use, k) != "" for use in touchups.rows)]
    header = ["pose_id", *names.JOINT_COLUMNS, *names.POSITION, *names.TOOL_POSITION, *names.TOOL_ORIENTATION]
    header += [*names.PAYLOAD_COLUMNS, "sigma_mm", *(names.EXTERNAL_AXES[k] for k in axes)]
    header += [*names.OBJECT_POSITION, *names.OBJECT_ORIENTATION, *(["session"] if free else [])]
    out = io.StringIO()
    out.writelines(f"# touched-up program: {_short(source.path)} sha256 {_hash(source)}\n" for source in sources)
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(header)
    for use in touchups.rows:
        assert use.move is not None
        wobj = use.event.wobj
        T_object, point = _placed(use, touchups.station), use.nominal
        if not free:
            T_object, point = np.eye(4), (T_object @ [*point * 1e-3, 1.0])[:3] * 1e3
        cells = [use.name, *_numbers(np.degrees(use.move.q), 6), *_numbers(point, 4)]
        cells += [*_pose(matrix_pose(use.move.T_mount_tcp)), f"{use.move.payload_mass:.6g}"]
        cells += [*_numbers(use.move.payload_center * 1e3, 3), f"{noise_mm:g}"]
        cells += [_axis(use, k) for k in axes]
        rows.writerow([*cells, *_pose(matrix_pose(T_object)), *([wobj.name] if free else [])])
    return out.getvalue()


def share_deviation(touchups: TouchUps, model: Model, noise_mm: float, free: bool) -> float:
    """Return the standard deviation of the share of the arm's expected deflection that touch-ups tell.

    With d_i the deflection of the model at a row, less the rigid motion of its work object that fits them best where
    that is free, and s the noise, a factor k of all deflections is known to s / sqrt(sum |d_i|^2).
    """
    squares = 0.0
    for rows in grouped((use.event.wobj.name, use) for use in touchups.rows).values():
        nominal, deflection = _deflections(rows, model)
        if free:
            center, shift, turn = fit_rigid(nominal, deflection)
            deflection = deflection - shift - np.cross(turn, nominal - center) if len(rows) > 1 else 0.0 * deflection
        squares += float(np.sum(deflection**2))
    return noise_mm * 1e-3 / np.sqrt(squares) if squares > 0 else np.inf


def touchup_findings(touchups: TouchUps, deviation: float | None, sources: Sequence[Source]) -> Iterator[Diagnostic]:
    """Yield what touch-ups cannot tell: targets that were moved together (DAT050), too few postures (DAT051).

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
        span = some[0].event.statement.span
        yield Diagnostic("DAT050", "warning", message, some[0].event.statement.source, span, help_)
    if deviation is not None and touchups.rows and deviation > UNKNOWN_SHARE:
        message = (
            f"these {len(touchups.rows)} postures hardly tell the arm from the place of its work: how far the arm "
        )
        message += (
            f"yields is known to {100 * min(deviation, 9.99):.0f} % of itself, for a shift of the work does the same"
        )
        help_ = "add targets near and far, high and low; or say `--wobj-fixed` where the place of the work was measured"
        yield Diagnostic("DAT051", "warning", message, sources[0] if sources else None, help=help_)


def _deflections(rows: Sequence[TouchUp], model: Model) -> tuple[Array, Array]:
    """Return nominal places (n, 3) of the TCP in the base, and how far the model's arm deflects there (n, 3) [m]."""
    moves = [use.move for use in rows if use.move is not None]
    q, T_flange_tcp = np.array([m.q for m in moves]), np.array([m.T_mount_tcp for m in moves])
    center = np.array([m.payload_center for m in moves])
    mass = np.array([m.payload_mass for m in moves])
    state = model.state(q, payload_mass=mass, payload_center=center, T_flange_tcp=T_flange_tcp)
    nominal = (forward(model.robot, q) @ T_flange_tcp)[:, :3, 3]
    return nominal, predict(Model(model.robot, model.effects, model.R_world_base), state)[:, :3, 3] - nominal


def _placed(use: TouchUp, station: Station) -> Array:
    """Return the work object (4, 4) [m] of a touch-up in the frame of tables: the unit that carries work, or the world.

    Axes that nobody states stand at 0, as for a table without their columns.
    """
    positions = station.positions(np.nan_to_num([use.event.axes or NOWHERE]))
    units = unit_of(use.event), station.work
    frame, reference = (np.eye(4) if unit is None else station.world(unit, positions)[0] for unit in units)
    return np.asarray(invert(reference) @ frame @ object_matrix(use.event.wobj))


def _axis(use: TouchUp, k: int) -> str:
    """Return where external axis number k stands at a touch-up [mm] or [deg]; empty where nobody states it."""
    value = np.nan if use.event.axes is None else use.event.axes[k]
    return f"{value:.6g}" if np.isfinite(value) and value < NO_AXIS else ""


def _numbers(values: Array, digits: int) -> list[str]:
    """Return numbers as text with so many decimals."""
    return [f"{value:.{digits}f}" for value in values]


def _pose(pose: Pose) -> list[str]:
    """Return position [mm] and quaternion as text."""
    return [*_numbers(np.array(pose.trans), 4), *_numbers(np.array(pose.rot), 9)]


def _short(path: str) -> str:
    """Return the name of a file without its folders."""
    return path.replace("\\", "/").rsplit("/", 1)[-1]


def _hash(source: Source) -> str:
    """Return the hash (SHA-256) of the bytes of a file."""
    return hashlib.sha256(source.data).hexdigest()
