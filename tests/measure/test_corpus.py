"""Tables as people, instruments and controllers write them: what is read of each and what is reported, in ``corpus.txt``.

A row changes the usual table, 40 poses with their points, and says what becomes of it::

    NAME,.. = EXPR   columns, in Python; ``i`` is the row from 0, ``_`` the column as it was, ``k`` its number here
    head OLD to NEW  a part of the header
    drop NAME ..     columns that the table has not
    lines EXPR       the lines of the file, made of ``lines``; data EXPR: its bytes, made of ``text``
    map TOML         a line of the column map
    joints EXPR      lines of a second file, with the joint angles
    use NAME=VALUE   measured, accept, rows_in_order, robot
    CHANGE => VALUES  as below, in one line
      = VALUES       usable rows, and what is read beside angles and points: the first three rows of each
      ! CODE severity at line: message -> help

``q?_deg`` stands for the six joint angles and ``?_mm`` for the three places.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.diagnostics import Diagnostic, PostprocError, Source
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.robot.catalogue import load_robot
from tests.corpus import option, short
from tests.measure.tables import JOINTS, PLACES, columns, flanges, lines, measured, points

N = 40
Q, SEEN = measured(N)
TURNS, FLANGES = flanges(np.round(Q, 5))
SEEN_TURNS = Rotation.from_euler("z", 0.7) * Rotation.from_matrix(TURNS) * Rotation.from_euler("xyz", [0.3, -1.1, 0.4])
CHANNELS = ("time", "payload_mass", "payload_center", "temperature", "approach", "v", "wrench", "session")


def mixed(rows: list[str], order: Any) -> list[str]:
    """The rows with the points of others beside their joint angles."""
    cells = [row.split(",") for row in rows[1:]]
    return [rows[0], *(",".join([*own[:7], *cells[k][7:]]) for own, k in zip(cells, order, strict=False))]


NAMES = {
    "np": np,
    "i": np.arange(N),
    "turns": SEEN_TURNS,
    "wxyz": SEEN_TURNS.as_quat()[:, [3, 0, 1, 2]],
    "flange_mm": 1e3 * FLANGES,
    "Q": Q,
    "points": points,
    "mixed": mixed,
    "angles": lambda rows: [",".join(row.split(",")[:7]) for row in rows],
    "places": lambda rows: [",".join([row.split(",")[0], *row.split(",")[7:]]) for row in rows],
    "grouped": lambda x, mark, point: [f"{v:,.4f}".replace(".", "d").replace(",", mark).replace("d", point) for v in x],
    "clock": lambda seconds, form: [form.format(h=s // 3600, m=s // 60 % 60, s=s % 60) for s in seconds],
}


def corpus() -> dict[str, tuple[list[str], list[str]]]:
    """Changes of every row and what becomes of it, by the line at which its result begins."""
    rows: dict[str, tuple[list[str], list[str]]] = {}
    changes: list[str] = []
    for number, line in enumerate(Path(__file__).with_name("corpus.txt").read_text("utf-8").splitlines(), start=1):
        change, arrow, values = line.partition(" => ")
        if arrow:
            rows[str(number)] = ([change], [f"  = {values}"])
        elif line.startswith("  "):
            place = str(number) if changes else next(reversed(rows))
            rows.setdefault(place, (changes, []))[1].append(line)
            changes = []
        elif not line.startswith("#"):
            changes = [*changes, line]
    return rows


ROWS = corpus()


@pytest.mark.parametrize("row", ROWS)
def test_a_table_is_read_as_its_row_says(row: str) -> None:
    changes, expected = ROWS[row]
    assert outcome(changes) == expected, "\n".join(changes)


def changed(cells: dict[str, list[str]], names: str, expression: str) -> dict[str, list[str]]:
    """The columns with some that are given by an expression."""
    known = {name: np.array(cells[name], float) for name in (*JOINTS, *PLACES) if name in cells}
    columns = {}
    for k, name in enumerate(names.split(",")):
        values = np.broadcast_to(eval(expression, {**NAMES, **known, "_": known.get(name), "k": k}), N).tolist()
        columns[name] = [value if isinstance(value, str) else f"{value:.8g}" for value in values]
    return cells | columns


def files(changes: list[str]) -> tuple[bytes, Source | None, Source | None, dict[str, Any]]:
    """The table with these changes as a file, its column map, a second file with joint angles, and options."""
    cells, heads, maps, options = columns(Q, SEEN), [], "", {}
    written: Any = None
    joints: Source | None = None
    for change in changes:
        change = change.replace("q?_deg", ",".join(JOINTS)).replace("?_mm", ",".join(PLACES))
        word, _, rest = change.partition(" ")
        if word == "head":
            heads.append(rest.split(" to "))
        elif word == "drop":
            cells = {name: values for name, values in cells.items() if name not in rest.split(",")}
        elif word in ("lines", "joints", "data"):
            before = written or lines(cells)
            value = eval(rest, {**NAMES, "lines": before, "text": "\n".join(before)})
            if word == "joints":
                joints = Source("joints.csv", "\n".join(value).encode())
            else:
                written = value
        elif word == "map":
            maps += rest + "\n"
        elif word == "use":
            options |= dict(map(option, rest.split()))
        else:
            cells = changed(cells, *change.split(" = "))
    text = "\n".join(lines(cells)) if written is None else "\n".join(written) if isinstance(written, list) else written
    for old, new in heads:
        head, *rows = text.split("\n")
        assert old in head
        text = "\n".join([head.replace(old, new), *rows])
    layout = Source("map.toml", maps.encode()) if maps else None
    return text if isinstance(text, bytes) else text.encode(), layout, joints, options


def outcome(changes: list[str]) -> list[str]:
    """What becomes of the usual table with these changes."""
    text, layout, joints, options = files(changes)
    arm, measured = load_robot(options.pop("robot", "irb4600_60_205")), options.pop("measured", True)
    terms = Reading(joints=joints, **{k: frozenset({v}) if k == "accept" else v for k, v in options.items()})
    try:
        data = read_measurements(Source("cell.csv", text), arm, column_map=layout, measured=measured, terms=terms)
    except PostprocError as error:
        return [reported(d) for d in error.diagnostics]
    return [f"  = {shown(data)}", *map(reported, data.diagnostics)]


def reported(d: Diagnostic) -> str:
    """A diagnostic as it is written in a row."""
    place = "" if d.source is None or d.span is None else f" at {d.place.removeprefix('cell.csv:')}"
    return f"  ! {d.code} {d.severity}{place}: {d.message}{f' -> {d.help}' if d.help else ''}".replace("\n", " / ")


def shown(data: Measurements) -> str:
    """What was read, as it is written in a row."""
    usable = int(data.usable.sum())
    parts = [str(usable) if usable == len(data) else f"{usable} of {len(data)}"]
    parts += ["other angles"] if len(data) != N or np.abs(np.degrees(data.state.q) - Q).max() > 2e-5 else []
    near = np.nan_to_num(np.abs(1e3 * data.position[:N] - SEEN[: len(data)]), nan=0.0)
    parts += ["no points"] if np.isnan(data.position).all() else ["other points"] if near.max() > 2e-3 else []
    if data.rotation is not None:
        good = np.isfinite(data.rotation).all(axis=(1, 2))
        off = (Rotation.from_matrix(data.rotation[good]) * SEEN_TURNS[good].inv()).magnitude()
        parts.append(f"{int((off < 1e-6).sum())} turns")
    channels = {name: getattr(data.state, name) for name in CHANNELS} | {"sigma_mm": data.sigma, **data.state.channels}
    if data.sides_from:  # derived, not read
        del channels["approach"]
    for name, values in channels.items():
        if values is not None:
            three = np.asarray(values, dtype=float)[:3] * (1e3 if name == "sigma_mm" else 1.0)
            parts.append(f"{name} {short(tuple(three.round(6).ravel().tolist()))}")
    return " | ".join(parts)
