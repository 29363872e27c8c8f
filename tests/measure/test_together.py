"""Several tables count as one: rows in their order, each found again in its file, what differs between them is said."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.measure.read.terms import Reading
from postproc.measure.read.together import read_tables
from postproc.robot.catalogue import load_robot
from tests.build import refused
from tests.measure.tables import TOOL, edited, points, table

ARM = load_robot("irb4600_60_205")
FIRST, LATER = table(20, seed=1), table(15, seed=2)
PLACES = range(7, 10)


def with_columns(lines, **columns):
    """The table with further columns, a value for every row or a function of its number."""
    body = [
        ",".join([line, *(str(value(i) if callable(value) else value) for value in columns.values())])
        for i, line in enumerate(lines[1:])
    ]
    return [",".join([lines[0], *columns]), *body]


def read(*tables, **more):
    return read_tables([Source(f"{'ab'[k]}.csv", "\n".join(t).encode()) for k, t in enumerate(tables)], ARM, **more)


def refusal(*tables):
    (found,) = refused(lambda: read(*tables))
    assert found.code == "DAT031" and found.help
    return found.message


def test_rows_stand_in_the_order_of_the_tables_and_are_found_in_their_files():
    data = read(FIRST, LATER)
    assert len(data) == 35 and data.row[20] == 1
    np.testing.assert_allclose(1e3 * data.position[20], [float(x) for x in LATER[1].split(",")[7:]], atol=1e-9)
    assert data.name(3) == "row 4 of a.csv" and data.name(20) == "row 1 of b.csv"
    some = data.rows([0, 22])
    source, span = some.where(1)
    assert source is not None and span is not None
    assert source.path == "b.csv" and source.data[slice(*span)].decode() == LATER[3]


def test_one_table_alone_is_read_as_ever():
    data = read(FIRST)
    assert data.state.session is None and data.name(3) == "row 4" and data.where(3)[0] is data.source


def test_a_table_without_sessions_is_one_and_stated_names_are_kept():
    data = read(FIRST, with_columns(LATER, session=lambda i: "day 2" if i < 5 else "day 3"))
    assert data.state.session_names == ("a", "day 2", "day 3")
    assert data.state.session.tolist() == [0] * 20 + [1] * 5 + [2] * 10
    assert data.state.session.dtype.kind == "i"


def test_no_payload_means_none_and_what_was_not_recorded_everywhere_is_not_used():
    more = with_columns(
        FIRST, payload_kg=30, payload_x_mm=0, payload_y_mm=0, payload_z_mm=120, dir2="+1", sigma_mm=0.02
    )
    data = read(with_columns(more, temperature_C=lambda i: 20 + i, wind=lambda i: i % 3, hall="north"), LATER)
    assert data.state.payload_mass.tolist() == [30.0] * 20 + [0.0] * 15
    assert data.state.approach is None or not data.state.approach[20:].any()
    assert np.isnan(data.sigma[20:]).all() and data.sigma[0] == pytest.approx(2e-5)
    assert data.state.temperature is None and "wind" not in data.state.channels
    assert data.state.channels["hall=north"].tolist() == [1.0] * 20 + [0.0] * 15
    said = [d for d in data.diagnostics if d.code == "DAT031"]
    assert [d.severity for d in said] == ["warning"] * 2
    assert "`b.csv` has no `wind`" in said[0].message and "`temperature_C`" in said[1].message


def test_a_clock_that_begins_anew_goes_on_and_rows_are_numbered_in_each_file():
    timed = [with_columns(t, time_s=lambda i: 60 * i) for t in (FIRST, LATER)]
    time = read(*timed).state.time
    assert (np.diff(time) > 0).all() and np.ptp(time[20:]) == 60 * 14
    later = with_columns(LATER, time_s=lambda i: 90000 + 60 * i)
    assert read(timed[0], later).state.time[20] == 90000
    assert "row" not in read(FIRST, LATER).state.channels
    ordered = read(FIRST, LATER, terms=Reading(rows_in_order=True))
    steps = np.diff(ordered.state.channels["row"])
    assert (np.delete(steps, 19) == 1).all() and steps[19] < 0  # never across files


def test_what_cannot_belong_together_is_refused():
    assert "same table" in refusal(FIRST, FIRST)
    joints = np.array([[float(x) for x in line.split(",")[1:7]] for line in LATER[1:]])
    other = points(joints, TOOL + np.array([0.0, 0.04, 0.0]))
    longer = [
        LATER[0],
        *(",".join([*line.split(",")[:7], *map(str, p)]) for line, p in zip(LATER[1:], other, strict=True)),
    ]
    assert "not one point of the flange" in refusal(FIRST, longer)
    moved = edited(LATER, PLACES[:1], lambda x: x + 500)
    assert "both name session `1`" in refusal(with_columns(FIRST, session=1), with_columns(moved, session=1))
    assert len(read(FIRST, moved)) == 35


def test_a_column_map_counts_for_the_tables_that_have_its_columns():
    theirs = [FIRST[0].replace("q1_deg", "A1").replace("x_mm", "east"), *FIRST[1:]]
    column_map = Source("map.toml", b'[columns]\nq1_deg = "A1"\nx_mm = "east"\n')
    data, plain = read(theirs, LATER, column_map=column_map), read(FIRST, LATER)
    np.testing.assert_array_equal(data.state.q, plain.state.q)
    np.testing.assert_array_equal(data.position, plain.position)
