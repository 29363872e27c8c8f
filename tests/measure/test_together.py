"""Several tables count as one: rows in their order, each found again in its file, what differs between them is said."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.measure.read.terms import Reading
from postproc.measure.read.together import read_tables
from tests.build import refused
from tests.measure.tables import ARM, TOOL, columns, lines, measured, points, source

Q, SEEN = measured(20, seed=1)
Q2, SEEN2 = measured(15, seed=2)


def first(**more):
    return columns(Q, SEEN, **more)


def later(seen=SEEN2, **more):
    return columns(Q2, seen, **more)


def read(*tables, **more):
    return read_tables([source(lines(t), f"{name}.csv") for name, t in zip("ab", tables, strict=False)], ARM, **more)


def refusal(*tables) -> str:
    (finding,) = refused(lambda: read(*tables))
    assert finding.code == "DAT031" and finding.help
    return finding.message


def test_rows_stand_in_the_order_of_the_tables_and_are_found_in_their_files():
    data = read(first(), later())
    assert len(data) == 35 and data.row[20] == 1
    np.testing.assert_allclose(1e3 * data.position[20:], SEEN2, atol=6e-5)
    assert data.name(3) == "row 4 of a.csv" and data.name(20) == "row 1 of b.csv"
    file, span = data.rows([0, 22]).where(1)
    assert file is not None and span is not None
    assert file.path == "b.csv" and file.data[slice(*span)].decode() == lines(later())[3]


def test_one_table_alone_is_read_as_ever():
    data = read(first())
    assert data.state.session is None and data.name(3) == "row 4" and data.where(3)[0] is data.source


def test_a_row_that_cannot_be_right_is_left_out_in_its_own_file():
    seen = SEEN2.copy()
    seen[4] += [0.0, 90.0, 0.0]
    assert np.flatnonzero(~read(first(), later(seen)).usable).tolist() == [24]


def test_a_table_without_sessions_is_one_and_stated_names_are_kept():
    data = read(first(), later(session=["day 2"] * 5 + ["day 3"] * 10))
    assert data.state.session_names == ("a", "day 2", "day 3")
    assert data.state.session.tolist() == [0] * 20 + [1] * 5 + [2] * 10
    assert data.state.session.dtype.kind == "i"


def test_no_payload_means_none_and_what_was_not_recorded_everywhere_is_not_used():
    load = {"payload_kg": [30] * 20, "payload_x_mm": [0] * 20, "payload_y_mm": [0] * 20, "payload_z_mm": [120] * 20}
    channels = {"temperature_C": range(20, 40), "wind": [i % 3 for i in range(20)], "hall": ["north"] * 20}
    data = read(first(**load, sigma_mm=[0.02] * 20, **channels), later())
    assert data.state.payload_mass.tolist() == [30.0] * 20 + [0.0] * 15
    assert np.isnan(data.sigma[20:]).all() and data.sigma[0] == pytest.approx(2e-5)
    assert data.state.temperature is None and "wind" not in data.state.channels
    assert data.state.channels["hall=north"].tolist() == [1.0] * 20 + [0.0] * 15
    wind, temperature = (d.message for d in data.diagnostics if (d.code, d.severity) == ("DAT031", "warning"))
    assert wind == "`b.csv` has no `wind`, which other tables have: it is not used" and "`temperature_C`" in temperature


def test_a_clock_that_begins_anew_goes_on_and_rows_are_numbered_in_each_file():
    minutes = 60 * np.arange(20)
    time = read(first(time_s=minutes), later(time_s=minutes[:15])).state.time
    assert (np.diff(time) > 0).all() and np.ptp(time[20:]) == 60 * 14
    assert read(first(time_s=minutes), later(time_s=90000 + minutes[:15])).state.time[20] == 90000
    assert "row" not in read(first(), later()).state.channels
    steps = np.diff(read(first(), later(), terms=Reading(rows_in_order=True)).state.channels["row"])
    assert (np.delete(steps, 19) == 1).all() and steps[19] < 0  # never across files


def test_what_cannot_belong_together_is_refused():
    assert refusal(first(), first()) == "`a.csv` and `b.csv` are the same table, twice"
    other_point = points(Q2, TOOL + np.array([0.0, 0.04, 0.0]))
    apart = "the points of `a.csv` and `b.csv` are not one point of the flange: 37 mm apart"
    assert refusal(first(), later(other_point)) == apart
    moved = SEEN2 + np.array([500.0, 0.0, 0.0])
    elsewhere = "the instrument stood elsewhere in `a.csv` and `b.csv` (500 mm), and both name session `1`"
    assert refusal(first(session=[1] * 20), later(moved, session=[1] * 15)) == elsewhere
    assert len(read(first(), later(moved))) == 35


def test_a_column_map_counts_for_the_tables_that_have_its_columns():
    names = {"q1_deg": "A1", "x_mm": "east"}
    other = {names.get(name, name): cells for name, cells in first().items()}
    column_map = Source("map.toml", b'[columns]\nq1_deg = "A1"\nx_mm = "east"\n')
    data, plain = read(other, later(), column_map=column_map), read(first(), later())
    np.testing.assert_array_equal(data.state.q, plain.state.q)
    np.testing.assert_array_equal(data.position, plain.position)
