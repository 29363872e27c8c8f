"""Tables with columns of external axes: where they put the arm, units, and what is wrong with them."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.diagnostics import PostprocError, Source
from postproc.measure.measurements import Measurements
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.measure.read.together import read_tables
from postproc.model.arm import Model
from postproc.model.file import parse_model
from tests.independent import arm as A
from tests.independent import inverse as I
from tests.independent import rapid as R

TRACK = '[[external_axes]]\naxis = "a"\nkind = "linear"\ncarries = "robot"\nlimits = [-100, 4000]\n'
TABLE = '[[external_axes]]\naxis = "b"\nkind = "rotary"\ncarries = "{}"\nunit = "STN1"\nxyz_mm = [1200, 0, 500]\n'
G = np.random.default_rng(4)
Q = G.uniform(-0.9, 0.9, (24, 6)) + np.array([0, 0, 0, 0, 0.5, 0])
E = np.column_stack([G.uniform(0, 3000, 24), G.uniform(-120, 120, 24)])


def model(axes: str) -> Model:
    return parse_model(Source("m.toml", f'robot = "irb4600_60_205"\n{axes}'.encode()))


def places(on_work: bool = True, track: bool = True) -> np.ndarray:
    """(n, 3) [m] of the nominal arm, on the table or in the world, beside a millimetre of noise."""
    slide = A.transform(np.eye(3), E[:, :1] / 1e3 * [float(track), 0.0, 0.0])
    turn = A.shift(1.2, 0, 0.5) @ A.transform(A.rotation(np.array([0, 0, 1.0]), np.radians(E[:, 1])), np.zeros(3))
    T = slide @ A.irb4600().forward(Q, A.shift(0.02, 0, 0.3)).tcp
    T = np.linalg.inv(turn) @ T if on_work else T
    return T[:, :3, 3] + np.random.default_rng(5).normal(0, 3e-4, (24, 3))


def text(seen: np.ndarray, columns: dict[str, np.ndarray | list[str]]) -> str:
    names = [*(f"q{j}_deg" for j in range(1, 7)), "x_mm", "y_mm", "z_mm", *columns]
    rows = [
        [
            *(f"{x:.5f}" for x in np.degrees(Q[i])),
            *(f"{x:.4f}" for x in 1e3 * seen[i]),
            *(str(c[i]) for c in columns.values()),
        ]
        for i in range(24)
    ]
    return "\n".join(",".join(row) for row in [names, *rows]) + "\n"


def read(content: str, arm: Model) -> Measurements:
    return read_measurements(Source("t.csv", content.encode()), arm.robot, terms=Reading(station=arm.station))


def words(data: Measurements) -> str:
    return "; ".join(d.message for d in data.diagnostics if d.code == "DAT038")


def test_the_track_carries_the_base_and_the_work_carries_the_points() -> None:
    data = read(text(places(), {"eax_a": E[:, 0], "eax_b": E[:, 1]}), model(TRACK + TABLE.format("work")))
    assert not data.diagnostics
    assert data.state.external_axes is not None and data.state.T_reference_base is not None
    assert data.state.external_axes[:, :2] == pytest.approx(E * [1e-3, np.pi / 180])
    assert np.isnan(data.state.external_axes[:, 2:]).all()
    assert data.state.channels["eax_a"] == pytest.approx(E[:, 0])
    expected = A.shift(-1.2 + 1e-3 * E[0, 0], 0, -0.5)
    turn = A.transform(A.rotation(np.array([0, 0, 1.0]), -np.radians(E[0, 1])), np.zeros(3))
    assert data.state.T_reference_base[0] == pytest.approx(turn @ expected, abs=1e-12)
    assert data.state.work is not None and set(data.state.work) == {"STN1"}


def test_units_are_those_that_a_column_map_states() -> None:
    content = text(places(False), {"rail": E[:, 0] / 1e3})
    layout = Source("c.toml", b'[columns]\neax_a = { name = "rail", unit = "m" }\n')
    arm = model(TRACK)
    data = read_measurements(
        Source("t.csv", content.encode()), arm.robot, None, layout, terms=Reading(station=arm.station)
    )
    assert data.state.channels["eax_a"] == pytest.approx(E[:, 0]) and not words(data)
    wrong = Source("c.toml", b'[columns]\neax_a = { name = "rail", unit = "deg" }\n')
    with pytest.raises(PostprocError, match="`eax_a` is in deg, and the cell has a linear axis"):
        read_measurements(Source("t.csv", content.encode()), arm.robot, None, wrong, terms=Reading(station=arm.station))


def test_an_axis_that_the_cell_has_not_is_an_error() -> None:
    with pytest.raises(PostprocError) as raised:
        read(text(places(), {"eax_a": E[:, 0], "eax_c": E[:, 1]}), model(TRACK))
    assert "the table has `eax_c`, and the cell has no such axis: it has `eax_a`" in str(raised.value)
    idle = read(text(places(False), {"eax_a": E[:, 0], "eax_c": ["9E9"] * 24, "eax_d": [0] * 24}), model(TRACK))
    assert not words(idle)


def test_an_axis_without_a_column_stands_at_zero_and_that_is_said() -> None:
    data = read(text(places(False, track=False), {}), model(TRACK))
    assert "the cell has an axis `eax_a` and the table no such column: it is taken to stand at 0 mm" in words(data)
    assert data.state.external_axes is not None and (data.state.external_axes[:, 0] == 0).all()


def test_a_table_without_a_cell_keeps_the_axis_as_a_channel() -> None:
    data = read(text(places(False, track=False), {"eax_a": E[:, 0]}), model(""))
    assert "no cell says what it carries" in words(data)
    assert data.state.external_axes is None and data.state.channels["eax_a"] == pytest.approx(E[:, 0])


def test_beyond_the_limits_is_said() -> None:
    far = np.where(np.arange(24) == 3, 4200.0, E[:, 0])
    assert "`eax_a` stands at 4200 mm, outside its limits -100 .. 4000 mm" in words(
        read(text(places(False), {"eax_a": far}), model(TRACK))
    )


def test_points_in_the_world_are_no_points_on_the_work() -> None:
    content = text(places(False), {"eax_a": E[:, 0], "eax_b": E[:, 1]})
    with pytest.raises(PostprocError, match="the points do not move with the work on `STN1`"):
        read(content, model(TRACK + TABLE.format("work")))
    assert not words(read(content, model(TRACK + TABLE.format("nothing"))))


def test_the_same_angles_at_another_place_of_the_axes_are_no_repeat() -> None:
    arm = model(TRACK)
    rows = text(places(False), {"eax_a": E[:, 0]}).split("\n")
    again = rows[1].rpartition(",")[0]
    content = "\n".join([*rows[:-1], f"{again},{E[0, 0]}", f"{again},700", ""])
    *_, same, elsewhere = read(content, arm).repeats.tolist()
    assert same == 0 and elsewhere == 24


def test_tables_of_one_cell_go_together() -> None:
    arm, head = model(TRACK), text(places(False), {"eax_a": E[:, 0]}).split("\n")
    parts = ["\n".join([head[0], *rows, ""]) for rows in (head[1:13], head[13:25])]
    sources = [Source(f"{i}.csv", part.encode()) for i, part in enumerate(parts)]
    both = read_tables(sources, arm.robot, terms=Reading(station=arm.station))
    assert both.state.T_reference_base is not None
    assert both.state.T_reference_base[:, 0, 3] == pytest.approx(E[:, 0] / 1e3)


def test_targets_of_a_program_stand_where_its_axes_are() -> None:
    """A robtarget of the world, reached from a track at 1500 mm: the joints are those of a base 1500 mm farther on."""
    arm = model(TRACK)
    joints = np.radians([[10.0, 20, -10, 30, 50, -20]])
    T = A.irb4600().forward(joints, np.eye(4)).flange[0]
    place, turn = 1e3 * T[:3, 3] + [1500, 0, 0], R.matrix_quaternion(T[:3, :3])
    conf = I.confdata(A.irb4600(), joints[0])[0]
    target = f"[[{','.join(f'{x:.6f}' for x in place)}],[{','.join(f'{x:.12f}' for x in turn)}],{list(map(int, conf))},[1500,9E9,9E9,9E9,9E9,9E9]]"
    program = f"MODULE M\nCONST robtarget p1:={target};\nPROC main()\nMoveJ p1,v100,fine,tool0;\nENDPROC\nENDMODULE\n"
    content = "target,x_mm,y_mm,z_mm\np1,1,2,3\n"
    data = read_measurements(
        Source("t.csv", content.encode()),
        arm.robot,
        Source("m.mod", program.encode()),
        terms=Reading(station=arm.station),
    )
    assert data.state.q == pytest.approx(joints, abs=1e-6)
    assert data.state.channels["eax_a"] == pytest.approx([1500.0]) and not words(data)
