"""Columns in the words of other languages, and the column map that a finding proposes."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.measure.read.columns import STANDARD, bare_name, column_words, named, recognised
from postproc.measure.read.table import read_measurements
from postproc.robot.catalogue import load_robot
from tests.measure.tables import measured


@pytest.mark.parametrize(
    ("joint", "place"),
    [
        ("Gelenk {} Soll [°]", "Messpunkt {} Ist [mm]"),
        ("Achse {} [Grad]", "Koordinate {} [mm]"),
        ("Articulation {} [deg]", "Coordonnée {} [mm]"),
        ("Giunto {} [deg]", "Posizione {} (mm)"),
        ("Articulación {} (deg)", "Posición {} [mm]"),
        ("Junta {} [°]", "Posição {} [mm]"),
        ("关节{} [deg]", "坐标{} [mm]"),
        ("関節{} [deg]", "座標{} [mm]"),
    ],
)
def test_joints_and_coordinates_are_known_in_other_languages(joint: str, place: str) -> None:
    header = [joint.format(k) for k in range(1, 7)] + [place.format(axis) for axis in "XYZ"]
    known = recognised(header, ["deg"] * 6 + ["mm"] * 3)
    assert [known[f"q{k}_deg"].name for k in range(1, 7)] == header[:6]
    assert [known[f"{axis}_mm"].name for axis in "xyz"] == header[6:]


def test_no_word_has_two_meanings() -> None:
    words = column_words()
    every = [*words.columns, *words.possible]
    assert len(every) == len(set(every)) and all(word == bare_name(word) for word in every)
    assert {*words.columns.values(), *words.possible.values()} <= set(STANDARD)
    assert not [word for word in every if words.joint.fullmatch(word) or words.place.fullmatch(word)]
    # Set values are no measured places; speeds and standard names of other quantities are no angles.
    assert not [name for name in ("X Soll", "v1_deg_s", "a1_deg_s2", "mq1_deg", "tool_x_mm", "J7", "P12") if words.place.fullmatch(bare_name(name)) or words.joint.fullmatch(bare_name(name))]  # fmt: skip
    assert named("Luft-Temp. [°C]") == "temperature_C" and named("Wetter") == ""


def test_the_map_that_is_proposed_reads_the_table() -> None:
    q, points = measured(12)
    header = "Punkt;J1 [°];J2 [°];J3 [°];J4 [°];J5 [°];J6 [°];X [mm];Y [mm];Z [mm];Lufttemp;Last [g];U95 [um]"
    rows = [";".join([f"P{k}", *(f"{x:.5f}" for x in [*q[k], *points[k]]), "21.5", "500", "40"]) for k in range(12)]
    table, robot = Source("tisch.csv", "\n".join([header, *rows]).encode()), load_robot("irb4600_60_205")
    (proposed,) = [d for d in read_measurements(table, robot).diagnostics if d.help and "[columns]" in d.help]
    text = proposed.help.partition("lines:\n")[2]
    data = read_measurements(table, robot, column_map=Source("columns.toml", text.encode()))
    assert data.pose_id[:2] == ("P0", "P1") and data.sigma == pytest.approx(np.full(12, 20e-6))
    assert data.state.temperature == pytest.approx(np.full(12, 21.5))
    assert data.state.payload_mass == pytest.approx(np.full(12, 0.5))
    assert not [d for d in data.diagnostics if d.help and "[columns]" in d.help]
