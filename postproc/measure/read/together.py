"""Several tables of one arm as one: rows in the order of the tables, each table read with columns of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import PurePath
from typing import Any

import numpy as np

from postproc.arrays import Array, numbered
from postproc.channels.state import State
from postproc.diagnostics import Diagnostic, PostprocError, Source, has_errors
from postproc.measure.alignment import align
from postproc.measure.checks.readings import CLEARER, SUSPICIOUS_M, PlacedArm, align_arm
from postproc.measure.kinds.base import Readings
from postproc.measure.measurements import FEWEST_ROWS_JUDGED, OF_ROWS, Measurements
from postproc.measure.read.cells import read_cells
from postproc.measure.read.layout import read_column_map
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import AS_IT_IS, Reading, accepted
from postproc.measure.trajectory import going_on
from postproc.robot.arm import Robot
from postproc.robot.pose import transform

ZERO_WHERE_MISSING = ("v", "a", "approach", "payload_mass", "payload_center", "wrench")
PLACED = ("external_axes", "work", "T_reference_base")
"""What a table leaves out where there was none of it (or nobody knows the side); others were not recorded."""


def read_tables(
    sources: Sequence[Source],
    robot: Robot,
    program: Sequence[Source] | None = None,
    column_map: Source | None = None,
    measured: bool = True,
    *,
    terms: Reading = AS_IT_IS,
) -> Measurements:
    """Read tables of one arm as one; arguments as `read_measurements`.

    Args:
        column_map: of several tables, it counts for those that have one of its columns.

    Raises:
        PostprocError: what is wrong with one of them; DAT031 where they do not belong together.
    """
    if len(sources) == 1:
        return read_measurements(sources[0], robot, program, column_map, measured, terms=terms)
    if terms.joints is not None:
        message = f"`{terms.joints.path}` can stand beside one table, and {len(sources)} are named"
        raise PostprocError.of("DAT033", message, help="name one table, or put its angles into each")
    maps = [column_map if column_map is not None and _concerns(column_map, source) else None for source in sources]
    pairs = zip(sources, maps, strict=True)
    tables = [read_measurements(source, robot, program, part, measured, terms=terms) for source, part in pairs]
    return together(tables, robot)


def together(tables: Sequence[Measurements], robot: Robot) -> Measurements:
    """Join tables of one arm into one.

    A table that names no session is one of its own, called as its file; sessions of one name are one session. What was
    recorded in some tables alone is no channel; no payload, force or speed in a table means that there was none.
    Times that begin anew go on after those of the table before.

    Args:
        tables: each read from a file; the tool, unless a program tells it, is the same in all.

    Raises:
        PostprocError: DAT031 where one stands there twice, where tools differ or are known in some of them only, where
            sessions of one name saw the arm from two places.
    """
    findings: list[Diagnostic] = []
    sources = [source for table in tables for source in table.sources]
    for a, b in combinations(sources, 2):
        if a.data == b.data:
            message = f"`{a.path}` and `{b.path}` are the same table, twice"
            raise PostprocError.of("DAT031", message, help="name it once")
    if len({table.tool_known for table in tables}) > 1:
        message = "a program tells the tool of some of the tables, and of others nobody"
        help_ = "give joint angles in all of them, or targets in all; or state the tool in columns `tool_x_mm` .."
        raise PostprocError.of("DAT031", message, help=help_)
    stems = [PurePath(source.path).stem for source in sources]
    files = stems if len(set(stems)) == len(stems) else [source.path for source in sources]
    names = [table.state.session_names or (name,) for table, name in zip(tables, files, strict=True)]
    for (one, names_a), (other, names_b) in combinations(zip(tables, names, strict=True), 2):
        setup = _check_setup(one, other, robot, shared=sorted(set(names_a) & set(names_b)))
        findings += accepted([] if setup is None else [setup], tables[0].accepted)
    if has_errors(findings):
        raise PostprocError(findings)
    arrays: dict[str, Any] = {n: _stacked([getattr(t, n) for t in tables], tables, np.nan) for n in OF_ROWS}
    labels: dict[str, Any] = {n: tuple(x for t in tables for x in getattr(t, n)) for n in ("pose_id", "row", "line")}
    data = Measurements(
        state=_state(tables, names, findings),
        **(arrays | labels),
        readings=_readings(tables),
        sigma_stated=any(table.sigma_stated for table in tables if table.sigma is not None),
        tool_known=tables[0].tool_known,
        references=frozenset().union(*(table.references for table in tables)),
        sides_from=next(filter(None, (table.sides_from for table in tables)), ""),
        counted=all(table.counted for table in tables),
        accepted=tables[0].accepted,
        wrong=frozenset((k, row) for k, table in enumerate(tables) for _, row in table.wrong),
        sources=tuple(sources),
        file=tuple(k for k, table in enumerate(tables) for _ in range(len(table))),
    )
    return replace(data, diagnostics=(*(d for table in tables for d in table.diagnostics), *findings))


def _concerns(column_map: Source, source: Source) -> bool:
    """Return whether a table has a column that a column map names, or the map names none; False if it is no table."""
    layout = read_column_map(column_map)
    columns = [*(mapped.name for mapped in layout.columns.values()), *layout.orientation_columns]
    try:
        cells = read_cells(source, layout, [])
    except PostprocError:
        return False
    return not columns or any(cells.at(name) >= 0 for name in columns)


def _stacked(parts: Sequence[Array | None], tables: Sequence[Measurements], fill: float) -> Array | None:
    """Return the arrays of tables one below the other, ``fill`` in the rows of those without; None if none has one."""
    known = next((part for part in parts if part is not None), None)
    if known is None:
        return None
    pairs = zip(parts, tables, strict=True)
    return np.concatenate([np.full((len(t), *known.shape[1:]), fill) if p is None else p for p, t in pairs])


def _readings(tables: Sequence[Measurements]) -> Readings | None:
    """Return the readings of all tables; None where none has any."""
    parts = [table.readings for table in tables]
    numbers, direction, sign = (
        _stacked([None if part is None else getattr(part, name) for part in parts], tables, fill)
        for name, fill in (("numbers", np.nan), ("direction", np.nan), ("sign", 0.0))
    )
    if numbers is None or direction is None or sign is None:
        return None
    return Readings(numbers, direction, sign, any(part.zero_open for part in parts if part is not None))


def _state(tables: Sequence[Measurements], names: Sequence[tuple[str, ...]], findings: list[Diagnostic]) -> State:
    """Return the states of all tables as one.

    Args:
        names: session names of each table; found: findings, appended to where tables lack a channel.
    """
    states = [table.state for table in tables]
    pairs = zip(states, names, strict=True)
    sessions = [some * len(s) if s.session is None else s.session_of_rows for s, some in pairs]
    session, every = numbered([name for of_rows in sessions for name in of_rows])
    reflector, points = numbered([name for s in states for name in s.reflector_of_rows.tolist()])
    setup, setups = numbered(["", *(name for s in states for name in s.setup_of_rows.tolist())])
    assert setup is not None
    channels: dict[str, Array] = {}
    for name in dict.fromkeys(name for s in states for name in s.channels):
        known = [s.channels.get(name) for s in states]
        # The word of a column stands nowhere in a table that has no such word.
        column = _stacked(known, tables, 0.0) if "=" in name else _shared(name, known, tables, findings)
        channels |= {} if column is None else {name: column}
    state = State(
        q=np.vstack([s.q for s in states]),
        session=session,
        session_names=every,
        reflector=None if points == ("",) else reflector,
        reflector_names=() if points == ("",) else points,
        setup=setup[1:] - 1 if setups[1:] else None,
        setup_names=setups[1:],
        touches=any(s.touches for s in states),
        temperature=_shared("temperature_C", [s.temperature for s in states], tables, findings),
        time=_shared("time_s", going_on([s.time for s in states]), tables, findings),
        channels=channels,
    )
    fills = dict.fromkeys(ZERO_WHERE_MISSING, 0.0) | dict.fromkeys(PLACED, np.nan)
    parts = {name: _stacked([getattr(s, name) for s in states], tables, fill) for name, fill in fills.items()}
    # A cell is that of all tables, or of none.
    state = state.with_(station=states[0].station, **parts)
    by_row = states[0].gravity.ndim == 2
    state = state.with_(gravity=np.vstack([s.gravity for s in states]) if by_row else states[0].gravity)
    if tables[0].tool_known:
        state = state.with_(T_flange_tcp=np.concatenate([s.T_flange_tcp for s in states]))
    return state


def _shared(
    name: str, parts: Sequence[Array | None], tables: Sequence[Measurements], findings: list[Diagnostic]
) -> Array | None:
    """Return a channel (n,) that every table has recorded; None if not all have, with a warning if some have.

    Args:
        name: of the channel; parts: its values in each table; found: gets the warning.
    """
    lacking = [table for part, table in zip(parts, tables, strict=True) if part is None]
    if lacking and len(lacking) < len(tables):
        message = f"`{lacking[0].sources[0].path}` has no `{name}`, which other tables have: it is not used"
        help_ = "what follows it can be tried on the tables that have it"
        findings.append(Diagnostic("DAT031", "warning", message, help=help_))
    return None if lacking else _stacked(parts, tables, np.nan)


def _check_setup(one: Measurements, other: Measurements, robot: Robot, shared: Sequence[str]) -> Diagnostic | None:
    """Return DAT031 where two tables measured different points of the flange, or one session from two places.

    Args:
        shared: names of sessions in both.
    """
    one, other = (table.rows(table.state.reflector_of_rows == _shared_reflector(one, other)) for table in (one, other))
    if one.tool_known or min(_located(one).sum(), _located(other).sum()) < FEWEST_ROWS_JUDGED:
        return None
    (q, y), (q_other, y_other) = ((t.state.q[_located(t)], t.position[_located(t)]) for t in (one, other))
    arm, other_arm = (PlacedArm(robot, t.state.T_reference_base).rows(_located(t)) for t in (one, other))
    first, second = align_arm(arm, q, y), align_arm(other_arm, q_other, y_other)
    T = other_arm.flange(q_other) @ transform(first.tool)
    same = align(T, y_other, tool=False)
    paths = f"`{one.sources[0].path}` and `{other.sources[0].path}`"
    if same.typical > max(SUSPICIOUS_M, CLEARER * second.typical):
        message = f"the points of {paths} are not one point of the flange: {1e3 * same.typical:.0f} mm apart"
        return Diagnostic("DAT031", "error", message, help="fit a model to each, or state the tools in a program")
    frame = first.T_instrument_base
    distance = float(np.median(np.linalg.norm(y_other - T[:, :3, 3] @ frame[:3, :3].T - frame[:3, 3], axis=1)))
    if shared and distance > max(SUSPICIOUS_M, CLEARER * same.typical):
        message = f"the instrument stood elsewhere in {paths} ({1e3 * distance:.0f} mm), and both name session "
        message += f"`{shared[0]}`"
        return Diagnostic("DAT031", "error", message, help="give them different names in column `session`")
    return None


def _shared_reflector(one: Measurements, other: Measurements) -> str | None:
    """Return the name of the reflector of most rows of one table among those that both have; None for none."""
    theirs = set(other.state.reflector_of_rows.tolist())
    names = Counter(name for name in one.state.reflector_of_rows.tolist() if name in theirs)
    return names.most_common(1)[0][0] if names else None


def _located(table: Measurements) -> Array:
    """Return (n,) mask of usable rows with a whole measured position."""
    return np.asarray(table.usable & np.isfinite(table.position).all(axis=1))
