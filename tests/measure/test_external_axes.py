"""Tables with columns of external axes: where they put the arm, units, and what is wrong with them."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.diagnostics import PostprocError, Source
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.measure.read.together import read_tables
from postproc.model.file import parse_model
from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import rapid as R
from tests.measure.tables import ARM, columns, lines, source

TRACK = '[[external_axes]]\naxis = "a"\nkind = "linear"\ncarries = "robot"\nlimits = [-100, 4000]\n'
TABLE = '[[external_axes]]\naxis = "b"\nkind = "rotary"\ncarries = "{}"\nunit = "STN1"\nxyz_mm = [1200, 0, 500]\n'
WORK = TRACK + TABLE.format("work")
G = np.random.default_rng(4)
Q = np.degrees(G.uniform(-0.9, 0.9, (24, 6)) + np.array([0, 0, 0, 0, 0.5, 0]))
E = np.column_stack([G.uniform(0, 3000, 24), G.uniform(-120, 120, 24)])


def turned(angles_deg: np.ndarray) -> np.ndarray:
    return A.transform(A.rotation(np.array([0, 0, 1.0]), np.radians(angles_deg)), np.zeros(3))


def table(on_work: bool = False, track: bool = True, **axes) -> dict[str, list[str]]:
    """Points of the nominal arm, in the world or on the turning table, and the axes as they stand in the table."""
    slide = A.transform(np.eye(3), E[:, :1] / 1e3 * [float(track), 0.0, 0.0])
    T = slide @ A.irb4600().forward(np.radians(Q), A.shift(0.02, 0, 0.3)).tcp
    T = np.linalg.inv(A.shift(1.2, 0, 0.5) @ turned(E[:, 1])) @ T if on_work else T
    return columns(Q, 1e3 * T[:, :3, 3] + np.random.default_rng(5).normal(0, 0.3, (24, 3)), **axes)


def terms(cell: str, **more) -> Reading:
    return Reading(station=parse_model(Source("m.toml", f'robot = "irb4600_60_205"\n{cell}'.encode())).station, **more)


def read(cells: dict[str, list[str]], cell: str, layout: bytes = b"", **more) -> Measurements:
    column_map = Source("c.toml", layout) if layout else None
    return read_measurements(source(lines(cells)), ARM, column_map=column_map, terms=terms(cell, **more))


def test_the_track_carries_the_base_and_the_work_carries_the_points() -> None:
    state = read(table(on_work=True, eax_a=E[:, 0], eax_b=E[:, 1]), WORK).state
    assert state.external_axes is not None and state.T_reference_base is not None and state.work is not None
    assert state.external_axes[:, :2] == pytest.approx(E * [1e-3, np.pi / 180])
    assert np.isnan(state.external_axes[:, 2:]).all()
    assert state.channels["eax_a"] == pytest.approx(E[:, 0])
    base = turned(-E[:1, 1])[0] @ A.shift(-1.2 + 1e-3 * E[0, 0], 0, -0.5)
    assert state.T_reference_base[0] == pytest.approx(base, abs=1e-12)
    assert set(state.work) == {"STN1"}


BOTH, RAIL = table(eax_a=E[:, 0], eax_b=E[:, 1]), table(rail=E[:, 0] / 1e3)
BEYOND = table(eax_a=np.where(np.arange(24) == 3, 4200.0, E[:, 0]))
MAP = b'[columns]\neax_a = {name = "rail", unit = "%b"}\n'
# The table, the cell, the unit of its rail in a column map, and all that is reported.
REPORTS = [
    (table(True, eax_a=E[:, 0], eax_b=E[:, 1]), WORK, b"", ""),
    (BOTH, TRACK + TABLE.format("nothing"), b"", ""),
    (BOTH, WORK, b"", "the points do not move with the work on `STN1`: in the world they fit to 0.43 mm"),
    (table(eax_a=E[:, 0], eax_c=["9E9"] * 24, eax_d=[0] * 24), TRACK, b"", ""),
    (BOTH, TRACK, b"", "the table has `eax_b`, and the cell has no such axis: it has `eax_a`"),
    (BEYOND, TRACK, b"", "`eax_a` stands at 4200 mm, outside its limits -100 .. 4000 mm"),
    (RAIL, TRACK, b"m", ""),
    (RAIL, TRACK, b"deg", "`eax_a` is in deg, and the cell has a linear axis there"),
    (RAIL, TRACK, b"", "the cell has an axis `eax_a` and the table no such column: it is taken to stand at 0 mm"),
    (BEYOND, "", b"", "the table has `eax_a`, and no cell says what it carries: the arm is taken to stand still"),
]


@pytest.mark.parametrize(("cells", "cell", "unit", "message"), REPORTS)
def test_what_is_wrong_with_external_axes_is_said(cells, cell: str, unit: bytes, message: str) -> None:
    try:
        findings = read(cells, cell, MAP % unit if unit else b"", accept=frozenset({"DAT009"})).diagnostics
    except PostprocError as error:
        findings = tuple(error.diagnostics)
    assert [d.message for d in findings if d.code == "DAT038"] == ([message] if message else [])


def test_columns_state_where_axes_stood_and_others_stand_at_zero() -> None:
    rail = read(RAIL, TRACK, MAP % b"m")
    assert rail.state.channels["eax_a"] == pytest.approx(E[:, 0])
    zero = read(table(track=False), TRACK).state.external_axes
    assert zero is not None and (zero[:, 0] == 0).all()
    alone = read(table(track=False, eax_a=E[:, 0]), "").state
    assert alone.external_axes is None and alone.channels["eax_a"] == pytest.approx(E[:, 0])


def test_the_same_angles_at_another_place_of_the_axes_are_no_repeat() -> None:
    cells = {name: [*values, values[0], values[0]] for name, values in table(eax_a=E[:, 0]).items()}
    cells["eax_a"][-1] = "700"
    *_, same, elsewhere = read(cells, TRACK).repeats.tolist()
    assert same == 0 and elsewhere == 24


def test_tables_of_one_cell_go_together() -> None:
    head, *rows = lines(table(eax_a=E[:, 0]))
    parts = source([head, *rows[:12]], "a.csv"), source([head, *rows[12:]], "b.csv")
    both = read_tables(parts, ARM, terms=terms(TRACK))
    assert both.state.T_reference_base is not None
    assert both.state.T_reference_base[:, 0, 3] == pytest.approx(E[:, 0] / 1e3)


def test_targets_of_a_program_stand_where_its_axes_are() -> None:
    """A robtarget of the world, reached from a track at 1500 mm: the joints are those of a base 1500 mm farther on."""
    joints = np.radians([[10.0, 20, -10, 30, 50, -20]])
    T = A.irb4600().forward(joints, np.eye(4)).flange[0]
    place, turn = 1e3 * T[:3, 3] + [1500, 0, 0], R.matrix_quaternion(T[:3, :3])
    conf = list(map(int, I.confdata(A.irb4600(), joints[0])[0]))
    numbers = f"[{','.join(f'{x:.6f}' for x in place)}],[{','.join(f'{x:.12f}' for x in turn)}],{conf}"
    target = f"CONST robtarget p1:=[{numbers},[1500,9E9,9E9,9E9,9E9,9E9]];"
    program = f"MODULE M\n{target}\nPROC main()\nMoveJ p1,v100,fine,tool0;\nENDPROC\nENDMODULE\n"
    rows = source(["target,x_mm,y_mm,z_mm", "p1,1,2,3"])
    data = read_measurements(rows, ARM, Source("m.mod", program.encode()), terms=terms(TRACK))
    assert data.state.q == pytest.approx(joints, abs=1e-6) and not data.diagnostics
    assert data.state.channels["eax_a"] == pytest.approx([1500.0])
