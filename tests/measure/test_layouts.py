"""Tables as spreadsheets, trackers and robots write them."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from postproc.diagnostics import PostprocError, Source
from postproc.measure.table import read_measurements
from postproc.robot.catalogue import load_robot
from tests.measure.tables import HEADER, points, poses

Q = poses(12)
PLACES = points(Q)


def grouped(x: float, mark: str, decimal: str) -> str:
    return f"{x:,.4f}".replace(".", "d").replace(",", mark).replace("d", decimal)


def table(separator=",", header=HEADER, number=lambda x: f"{x:.5f}", place=None, title="", end="") -> bytes:
    place = place or number
    rows = [separator.join([f"P{i}", *map(number, Q[i]), *map(place, PLACES[i])]) + end for i in range(len(Q))]
    return (title + "\n".join([header.replace(",", separator), *rows]) + "\n").encode()


def read(data: bytes, column_map=None):
    return read_measurements(Source("t.csv", data), load_robot("irb4600_60_205"), column_map=column_map)


@pytest.mark.parametrize(
    "data",
    [
        table("\t", place=lambda x: grouped(x, "'", ".")),
        table(";", place=lambda x: grouped(x, ",", ".")),
        table(";", number=lambda x: f"{x:.5f}".replace(".", ","), place=lambda x: grouped(x, ".", ",")),
        table(";", number=lambda x: f"{x:.5f}".replace(".", ","), place=lambda x: grouped(x, " ", ",")),
        table(header=HEADER.upper()),
        table(end=","),
        table(title="Tracker AT960\nDate 2024-05-01, 20 C\n\n"),
    ],
    ids=["1'234.5", "1,234.5", "1.234,5", "1 234,5", "capitals", "comma at the end", "title"],
)
def test_layouts_that_need_no_map(data):
    found = read(data)
    np.testing.assert_allclose(1e3 * found.position, PLACES, atol=1e-3)
    np.testing.assert_allclose(np.degrees(found.state.q), Q, atol=1e-4)
    assert [d.severity for d in found.diagnostics if d.severity != "info"] == []


def test_a_title_is_said():
    (found,) = read(table(title="Tracker AT960\nDate 2024-05-01, 20 C\n\n")).diagnostics
    assert (found.code, found.message) == ("DAT004", "2 lines before the column names are taken for a title")


def test_a_number_that_may_be_either_is_not_guessed():
    found = read(table(";", place=lambda x: "1,193" if 1000 < x < 1400 else f"{x:.4f}"))
    assert {d.code for d in found.diagnostics} >= {"DAT003"}


@pytest.mark.parametrize(
    ("header", "factor"),
    [
        ("Nr,A1,A2,A3,A4,A5,A6,X [mm],Y [mm],Z [mm]", (1.0, 1.0)),
        ("name,J1 (rad),J2 (rad),J3 (rad),J4 (rad),J5 (rad),J6 (rad),px,py,pz", (np.pi / 180, 1.0)),
        ("id,joint_1,joint_2,joint_3,joint_4,joint_5,joint_6,tcp_x_m,tcp_y_m,tcp_z_m", (1.0, 1e-3)),
    ],
)
def test_a_map_is_proposed_that_works(header, factor):
    data = table(
        header=header,
        number=lambda x: f"{factor[0] * x:.8f}",
        place=lambda x: f"{factor[1] * x:.8f}",
    )
    with pytest.raises(PostprocError) as error:
        read(data)
    proposed = error.value.diagnostics[0].help
    assert "[columns]" in proposed
    found = read(data, tomllib.loads(proposed[proposed.index("[columns]") :]))
    np.testing.assert_allclose(1e3 * found.position, PLACES, atol=1e-3)
    np.testing.assert_allclose(np.degrees(found.state.q), Q, atol=1e-4)


def test_utf16_is_called_by_its_name():
    with pytest.raises(PostprocError, match="UTF-16"):
        read(table().decode().encode("utf-16"))
