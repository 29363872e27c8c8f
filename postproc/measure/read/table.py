"""Reading a measurement table into one value, with the joint angles of a second file if they stand there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.arrays import Array, numbered
from postproc.channels.state import State
from postproc.diagnostics import Diagnostic, PostprocError, Source, has_errors
from postproc.measure.checks.likely_wrong import check_measurements
from postproc.measure.checks.references import with_references
from postproc.measure.checks.setups import check_setups
from postproc.measure.consensus import LEAST_M, TIMES, Agreement, agreement
from postproc.measure.measurements import Measurements
from postproc.measure.read import columns as names
from postproc.measure.read.cells import Cells, read_cells
from postproc.measure.read.channels import channels_of, pose_numbers, row_order
from postproc.measure.read.commanded import Commanded, commanded_joints, program_targets
from postproc.measure.read.external_axes import check_work, with_external_axes
from postproc.measure.read.layout import read_column_map
from postproc.measure.read.lookup import Table, missing_help
from postproc.measure.read.setups import with_setups
from postproc.measure.read.terms import AS_IT_IS, Reading, accepted
from postproc.measure.read.values import as_number, is_number
from postproc.measure.trajectory import sides_from_before, with_motion
from postproc.robot.arm import Robot
from postproc.robot.cells.station import Station
from postproc.robot.pose import transform

ANGLES = (
    "an instrument alone does not know them: put the joint angles that the controller commanded beside the points, row "
    "by row, or name the program's targets in a column `target` and give the program (`--program`)"
)


def read_measurements(
    source: Source,
    robot: Robot,
    program: Source | Sequence[Source] | None = None,
    column_map: Source | None = None,
    measured: bool = True,
    *,
    terms: Reading = AS_IT_IS,
) -> Measurements:
    """Read a measurement table and check it against the arm.

    Args:
        source: the table; comma, dot decimals and the standard column names unless the column map says otherwise.
        robot: gives the nominal kinematics for commanded poses and for the checks of units and columns.
        program: the RAPID program that was run, for tables with a ``target`` column; and files read with it.
        column_map: a TOML file (`ColumnMap`) that says how another layout writes its columns.
        measured: False for poses that are only asked about, or have yet to be measured: then every row stays.
        terms: what the user says of the table beside that.

    Raises:
        PostprocError: DAT001 to DAT009, where the table cannot be what it says.
    """
    layout = read_column_map(column_map)
    diagnostics: list[Diagnostic] = []
    cells = read_cells(source, layout, diagnostics, every=not measured)
    if terms.joints is not None:
        cells = join(cells, read_cells(terms.joints, layout, diagnostics), layout.header, diagnostics)
    table = Table(cells, layout, diagnostics)
    turns = table.turns(names.ORIENTATION, layout.orientation)
    read = {*names.POSITION, *names.MEASURED_JOINTS, *names.SETUPS}
    if measured and turns is None and not read & table.place.keys():
        message = "nothing was measured: there is no column `x_mm`, `y_mm`, `z_mm`, nor `qw`, nor `mq1_deg`"
        message += ", nor `tip`, `plane`, `anchor`, `gauge`, `from`"
        raise PostprocError.of("DAT002", message, source, help=missing_help(cells))
    data = _rows(table, robot, program, terms, None if turns is None else turns.matrix)
    data = with_setups(data, table, measured)
    data, still = with_references(data, robot, layout.references)
    diagnostics += still
    unit = table.place["x_mm"].unit if "x_mm" in table.place else "mm"
    data, agreed = _without_lost(data, agreement(data, robot), table, robot)
    check_work(data.state, table, robot, data.position)
    findings = check_measurements(data, robot, cells, turns, agreed, measured=measured, unit=unit)
    read_set_ups = measured and data.readings is not None
    odd, misread = check_setups(data, robot, cells, terms.tool) if read_set_ups else ([], frozenset())
    findings = accepted([*diagnostics, *findings, *odd], terms.accept)
    if has_errors(findings):
        raise PostprocError(findings)
    wrong = agreed.rows[agreed.wrong] if agreed.near and "DAT007" not in terms.accept else ()
    return replace(data, wrong=misread | {(0, data.row[i]) for i in wrong}, diagnostics=tuple(findings))


def _rows(
    table: Table, robot: Robot, program: Source | Sequence[Source] | None, terms: Reading, rotation: Array | None
) -> Measurements:
    """Return the rows of a table, before anything in them is checked.

    Args:
        program, terms: as in `read_measurements`; rotation: (n, 3, 3) as measured, None where it was not.
    """
    commanded = _commanded(table, robot, program, terms.station or Station())
    state = with_external_axes(_state(table, commanded), table, terms.station, commanded.extax)
    if terms.gravity is not None and state.gravity.ndim == 1:
        state = state.with_(gravity=terms.gravity)
    state, sides_from = _followed(state, table, terms)
    position, T_object = _positions(table), _frames(table, names.OBJECT_POSITION, names.OBJECT_ORIENTATION)
    return Measurements(
        state=state,
        position=position if T_object is None else (T_object @ transform(position))[:, :3, 3],
        T_frame_object=T_object,
        rotation=rotation if T_object is None or rotation is None else T_object[:, :3, :3] @ rotation,
        joint=table.vector(names.MEASURED_JOINTS, partial=True, absent=np.nan),
        sigma=_deviations(table),
        pose_id=tuple(table.text("pose_id") or _labels(state.q)),
        row=tuple(range(1, len(table.cells.rows) + 1)),
        line=table.cells.lines,
        tool_known=commanded.T_flange_tcp is not None,
        counted="time_s" not in table.place and terms.rows_in_order and "row" not in table.place,
        sides_from=sides_from,
        accepted=terms.accept,
        sources=(table.cells.source,),
    )


def _without_lost(data: Measurements, agreed: Agreement, table: Table, robot: Robot) -> tuple[Measurements, Agreement]:
    """Return the rows with no position where a tracker lost its beam and wrote 0, 0, 0, and what the others agree on.

    Where the arm stood at the origin of the instrument's frame, the other rows have it there: that was measured.

    Args:
        agreed: what all rows agree on; table: gets the warning (DAT005).
    """
    zero = (data.position == 0).all(axis=1)
    if not zero.any() or zero.all():
        return data, agreed
    near = np.zeros(len(data), dtype=bool)
    limit = np.maximum(LEAST_M, TIMES * agreed.typical)
    near[agreed.rows] = agreed.near & (np.linalg.norm(agreed.error, axis=1) <= limit)
    lost = zero & ~near
    if not lost.any():
        return data, agreed
    message = f"x, y and z are 0 in {lost.sum()} of {len(lost)} rows, as a tracker writes that lost its beam"
    help_ = "leave such cells empty; they count as not measured"
    table.say("DAT005", "warning", message, help_, int(np.flatnonzero(lost)[0]))
    data = replace(data, position=np.where(lost[:, None], np.nan, data.position))
    return data, agreement(data, robot)


def _followed(state: State, table: Table, terms: Reading) -> tuple[State, str]:
    """Return the state with what the order of rows tells, and what tells that order if sides of approach come from it.

    Times give speeds and sides of a moving arm; where they are missing, and rows are in order, so do row numbers. Sides
    of standing poses are those from the pose before, by the times, the user's word, or names of poses that count up.
    """
    if "time_s" in table.place:
        state, findings = with_motion(state, table.cells.source)
        table.diagnostics.extend(findings)
    elif terms.rows_in_order:
        state = state.with_(channels={**state.channels, **row_order(state, table.text("pose_id"))})
    clocks: dict[str, Array | None] = {
        "the times": state.time,
        "the order of the rows": np.arange(float(len(state))) if terms.rows_in_order else None,
        "the numbers in `pose_id`": pose_numbers(table.text("pose_id")),
    }
    known = next(((name, clock) for name, clock in clocks.items() if clock is not None), None)
    if state.approach is not None or state.v is not None or known is None:
        return state, ""
    sides = sides_from_before(state, known[1])
    return (state.with_(approach=sides), known[0]) if sides.any() else (state, "")


def _state(table: Table, commanded: Commanded) -> State:
    """Return the commanded state with the channels of the table; DAT015 where payload mass or centre is missing."""
    session, session_names = numbered(table.text("session"))
    reflector, reflector_names = numbered(table.text("reflector"))
    state = State(
        q=commanded.q,
        v=table.vector(names.SPEED_COLUMNS, fill=0.0),
        a=table.vector(names.ACCELERATION_COLUMNS, fill=0.0),
        approach=_sides(table),
        payload_mass=table.column("payload_kg", fill=0.0),
        payload_center=table.vector(names.PAYLOAD_COLUMNS[1:], fill=0.0),
        wrench=table.vector(names.WRENCH, fill=0.0, partial=True),
        temperature=table.column("temperature_C", fill="median"),
        time=table.column("time_s", fill="between"),
        session=session,
        session_names=session_names,
        reflector=reflector,
        reflector_names=reflector_names,
        channels=channels_of(table),
    )
    if state.payload_mass is not None and state.payload_center is None and state.payload_mass.any():
        message = "there is `payload_kg` and no `payload_x_mm`, `payload_y_mm`, `payload_z_mm`"
        message += ": the mass is taken in the flange's centre"
        table.say("DAT015", "warning", message, "give its centre in tool0")
    if state.payload_mass is None and state.payload_center is not None:
        table.say("DAT015", "warning", "there is a centre of the payload and no mass", "give `payload_kg`, or map it")
    return state if commanded.T_flange_tcp is None else state.with_(T_flange_tcp=commanded.T_flange_tcp)


def _labels(q: Array) -> list[str]:
    """Return a name for each pose: the number of the first row with the same joint angles."""
    first: dict[bytes, str] = {}
    return [first.setdefault(row.tobytes(), str(i + 1)) for i, row in enumerate(np.round(q, 9))]


def _positions(table: Table) -> Array:
    """Return (n, 3) measured positions [m], NaN along axes that have no column."""
    present = [name for name in names.POSITION if name in table.place]
    if 0 < len(present) < len(names.POSITION):
        missing = " and ".join(f"`{name}`" for name in names.POSITION if name not in present)
        message = f"there is no column {missing}: the places are known along {' and '.join(n[0] for n in present)} "
        message += "alone"
        table.say("DAT002", "warning", message, missing_help(table.cells))
    nothing = np.full(len(table.cells.rows), np.nan)
    return np.stack([nothing if (c := table.column(name)) is None else c for name in names.POSITION], axis=1)


def _deviations(table: Table) -> Array | None:
    """Return (n,) standard deviations [m] that the instrument states, NaN unless positive; None if none is stated."""
    sigma = table.column("sigma_mm")
    if sigma is None:
        return None
    none = np.flatnonzero(sigma <= 0)
    if len(none):
        message = f"`sigma_mm` is {1e3 * sigma[none[0]]:g} in {len(none)} of {len(sigma)} rows; no instrument has none"
        table.say("DAT015", "warning", message, "these rows count as not stated", int(none[0]))
    return np.where(sigma > 0, sigma, np.nan) if (sigma > 0).any() else None


def _sides(table: Table) -> Array | None:
    """Return (n, 6) signs of each joint's last motion before a pose, 0 if not known; None without such columns.

    Other numbers than +1, -1 and 0 count by their sign, with a warning.
    """
    sides = table.vector(names.APPROACH, fill=0.0)
    if sides is None:
        return None
    odd = np.flatnonzero((np.abs(sides) != 1) & (sides != 0))
    if len(odd):
        row, joint = divmod(int(odd[0]), 6)
        message = f"`dir{joint + 1}` holds {sides[row, joint]:g}; its sign is taken"
        table.say("DAT015", "warning", message, "sides of approach are +1, -1 or 0 (not known)", row)
    if (sides > 0).any() and (sides == 0).any() and not (sides < 0).any():
        row, joint = divmod(int(np.flatnonzero(sides == 0)[0]), 6)
        message = f"the sides of approach are 1 and 0 and never -1: `dir{joint + 1}` = 0 is taken for `not known`"
        table.say("DAT015", "warning", message, "if 0 is the other side, write -1 for it", row)
    return np.sign(sides)


def _commanded(table: Table, robot: Robot, program: Source | Sequence[Source] | None, station: Station) -> Commanded:
    """Return what was commanded: joint columns, targets of the program, or commanded poses, in this order.

    Raises:
        PostprocError: DAT002 where the table has none of them.
    """
    q = table.vector(names.JOINT_COLUMNS)
    if q is not None:
        if "target" in table.place and program is not None:
            message = "the table has joint angles and targets of the program: the angles are taken"
            table.say("DAT015", "warning", message, "leave out `q1_deg` .. `q6_deg` if the program is to tell them")
        return Commanded(q, _frames(table, names.TOOL_POSITION, names.TOOL_ORIENTATION))
    cells = table.cells
    if "target" in table.place and program is not None:
        return program_targets(table, program, robot, station)
    position = table.vector(names.COMMAND_POSITION)
    turns = table.turns(names.COMMAND_ORIENTATION, table.layout.cmd_orientation)
    if position is None or turns is None:
        message = "there are no commanded joint angles: neither `q1_deg` .. `q6_deg` nor `cmd_x_mm` .. `cmd_qz`"
        if "target" in table.place:
            message = "column `target` names robtargets, and the program that was run is not given"
        raise PostprocError.of("DAT002", message, cells.source, help=missing_help(cells, names.JOINT_COLUMNS, ANGLES))
    configuration = table.vector(names.CONFIGURATION_COLUMNS, fill=0.0)
    return Commanded(commanded_joints(robot, position, turns.matrix, configuration, table))


def _frames(table: Table, position: Sequence[str], orientation: Sequence[str]) -> Array | None:
    """Return frames (n, 4, 4) [m] that columns state, upright where they state no orientation; None without them."""
    place, turns = table.vector(position), table.turns(orientation, None)
    return None if place is None else transform(place, None if turns is None else turns.matrix)


def join(seen: Cells, angles: Cells, named: bool, diagnostics: list[Diagnostic]) -> Cells:
    """Return the rows of ``seen`` with the columns of ``angles`` added; how they were joined is reported (DAT033).

    They are joined by a column of names (`pose_id`, `Point`, ..) that both have, where most names of the first stand in
    the second, once each; else row by row. A column that both have is taken from the first. Without column names the
    numbers of the second go on where those of the first end.

    Args:
        seen: what the instrument measured; angles: the commanded joint angles; named: whether the files have column
            names; diagnostics: gets the findings.

    Raises:
        PostprocError: DAT033 where neither names nor the number of rows agree.
    """
    if not named:
        first = len(seen.header) + 1
        angles = replace(angles, header=tuple(str(first + k) for k in range(len(angles.header))))
    places, how = _by_name(seen, angles)
    if places is None:
        if len(seen.rows) != len(angles.rows):
            message = f"`{angles.source.path}` has {len(angles.rows)} rows, `{seen.source.path}` has {len(seen.rows)}"
            message += ", and no column of names joins them"
            help_ = "name the rows of both in a column `pose_id`, or leave the same number of rows in both"
            raise PostprocError.of("DAT033", message, seen.source, help=help_)
        places, how = list(range(len(seen.rows))), "row by row"
    new = [k for k, name in enumerate(angles.header) if name not in seen.header]
    empty = tuple("" for _ in new)
    written = [tuple(_as_in(row[k], angles.decimal, seen.decimal) for k in new) for row in angles.rows]
    rows = [(*row, *(empty if at is None else written[at])) for row, at in zip(seen.rows, places, strict=True)]
    message = f"`{angles.source.path}` is read beside `{seen.source.path}`, joined {how}"
    diagnostics.append(seen.finding("DAT033", "info", message, row=None))
    if missing := [i for i, at in enumerate(places) if at is None]:
        message = f"`{angles.source.path}` has no row for {len(missing)} of {len(places)} rows"
        help_ = "check the names of these rows; they are not used"
        diagnostics.append(seen.finding("DAT033", "warning", message, help_, missing[0]))
    header = (*seen.header, *(angles.header[k] for k in new))
    return replace(seen, header=header, units=(*seen.units, *(angles.units[k] for k in new)), rows=tuple(rows))


def _by_name(seen: Cells, angles: Cells) -> tuple[list[int | None] | None, str]:
    """Return the row of ``angles`` for each row of ``seen``, None where it has none, and words for how it was found.

    The list is None, with an empty text, where no two columns of names match.
    """
    labels = [[name for name in cells.header if names.named(name) == "pose_id"] for cells in (seen, angles)]
    for first in labels[0]:
        for theirs in labels[1]:
            known = {name: i for i, name in enumerate(angles.text(theirs))}
            places = [known.get(name) for name in seen.text(first)]
            unique = len(known) == len(angles.rows)
            if unique and 2 * sum(at is not None for at in places) > len(places):
                both = f"`{first}`" if first == theirs else f"`{first}` and `{theirs}`"
                return places, f"by the names in {both}"
    return None, ""


def _as_in(cell: str, decimal: str, wanted: str) -> str:
    """Return a cell with the decimal sign of another table.

    Args:
        decimal: its own sign; wanted: the other's.
    """
    if decimal == wanted or not is_number(cell, decimal):
        return cell
    return as_number(cell, decimal).replace(".", wanted)
