"""Tables as spreadsheets, trackers and robots write them."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.diagnostics import PostprocError, Source
from postproc.measure.read.columns import likely_map
from postproc.measure.read.table import read_measurements
from postproc.robot.catalogue import load_robot
from postproc.robot.kinematics import forward
from tests.build import refused
from tests.measure.tables import HEADER, column_map, points, poses

Q = poses(12)
PLACES = points(Q)


def grouped(x: float, mark: str, decimal: str) -> str:
    return f"{x:,.4f}".replace(".", "d").replace(",", mark).replace("d", decimal)


def table(separator=",", header=HEADER, number=lambda x: f"{x:.5f}", place=None, title="", end="") -> bytes:
    place = place or number
    rows = [separator.join([f"P{i}", *map(number, Q[i]), *map(place, PLACES[i])]) + end for i in range(len(Q))]
    return (title + "\n".join([header.replace(",", separator), *rows]) + "\n").encode()


def read(data: bytes, layout=None):
    return read_measurements(Source("t.csv", data), load_robot("irb4600_60_205"), column_map=column_map(layout))


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
        ("id,joint_1,joint_2,joint_3,joint_4,joint_5,joint_6,tcp_x_m,tcp_y_m,tcp_z_m", (1.0, 1e-3)),
    ],
)
def test_a_map_is_proposed_that_works(header, factor):
    data = table(
        header=header,
        number=lambda x: f"{factor[0] * x:.8f}",
        place=lambda x: f"{factor[1] * x:.8f}",
    )
    proposed = refused(lambda: read(data))[0].help
    assert "[columns]" in proposed
    found = read(data, tomllib.loads(proposed[proposed.index("[columns]") :]))
    np.testing.assert_allclose(1e3 * found.position, PLACES, atol=1e-3)
    np.testing.assert_allclose(np.degrees(found.state.q), Q, atol=1e-4)


@pytest.mark.parametrize(
    "written",
    [
        lambda text: text.encode("utf-16"),
        lambda text: text.replace("\n", "\r").encode(),
        lambda text: ("\ufeff" + text.replace("\n", "\r\n")).encode(),
        lambda text: text.replace("-", "\u2212").encode(),
    ],
    ids=["UTF-16", "old line ends", "BOM", "typographic minus"],
)
def test_encodings_of_spreadsheets_are_read(written):
    found = read(written(table().decode()))
    np.testing.assert_allclose(1e3 * found.position, PLACES, atol=1e-3)
    assert found.line[-1] == len(Q) + 1


def test_a_binary_file_is_called_one():
    with pytest.raises(PostprocError, match="no whole workbook"):
        read(b"PK\x03\x04" + bytes(range(256)))
    with pytest.raises(PostprocError, match="no text"):
        read(b"\xd0\xcf\x11\xe0" + bytes(range(256)))


def test_names_that_state_their_unit_need_no_map():
    header = "name,J1 (rad),J2 (rad),J3 (rad),J4 (rad),J5 (rad),J6 (rad),X [m],Y [m],Z [m]"
    found = read(table(header=header, number=lambda x: f"{np.radians(x):.8f}", place=lambda x: f"{x / 1e3:.8f}"))
    np.testing.assert_allclose(1e3 * found.position, PLACES, atol=1e-3)
    np.testing.assert_allclose(np.degrees(found.state.q), Q, atol=1e-4)
    said = [d.message for d in found.diagnostics if d.code == "DAT015"]
    assert "`J1 (rad)` as `q1_deg`" in said[0] and "`X [m]` as `x_mm`" in said[0]


@pytest.mark.parametrize(
    ("header", "first", "place"),
    [
        ("Point,base,shoulder,elbow,wrist1,wrist 2,wrist_3,X,Y,Z", 'q6_deg = "wrist_3"', 'z_mm = "Z"'),
        (
            "Point ID,Robot J1,Robot J2,Robot J3,Robot J4,Robot J5,Robot J6,Actual X,Actual Y,Actual Z",
            'q6_deg = "Robot J6"',
            'z_mm = "Actual Z"',
        ),
        ("Name,A1,A2,A3,A4,A5,A6,X meas,Y meas,Z meas", 'q6_deg = "A6"', 'z_mm = "Z meas"'),
    ],
    ids=["UR", "whose", "meas"],
)
def test_names_that_robots_and_trackers_use_are_proposed(header, first, place):
    lines = refused(lambda: read(table(header=header)))[0].help.splitlines()
    assert {first, place} <= set(lines)


def with_columns(names, cells) -> bytes:
    """The table with further columns."""
    lines = table().decode().splitlines()
    return "\n".join(
        [f"{lines[0]},{names}", *(f"{line},{c}" for line, c in zip(lines[1:], cells, strict=True))]
    ).encode()


@pytest.mark.parametrize(
    ("name", "stamp"),
    [
        ("time_s", lambda s: f"2026-03-12T14:{s // 60:02d}:{s % 60:02d}.5"),
        ("time_s", lambda s: f"2026-03-12 14:{s // 60:02d}:{s % 60:02d}+01:00"),
        ("Timestamp", lambda s: f"12.03.2026 14:{s // 60:02d}:{s % 60:02d}"),
        ("Zeit", lambda s: f"14:{s // 60:02d}:{s % 60:02d}"),
        ("date time", lambda s: f"3/12/2026 2:{s // 60:02d}:{s % 60:02d} PM"),
        ("time", lambda s: f"{(23 + (s + 3500) // 3600) % 24:02d}:{(s + 3500) // 60 % 60:02d}:{(s + 3500) % 60:02d}"),
    ],
    ids=["ISO", "zone", "points", "German", "slashes", "over midnight"],
)
def test_time_stamps_become_seconds(name, stamp):
    found = read(with_columns(name, [stamp(17 * i) for i in range(len(Q))]))
    np.testing.assert_allclose(found.state.time, 17.0 * np.arange(len(Q)))
    assert [d.severity for d in found.diagnostics if d.severity != "info"] == []


def test_days_of_spreadsheets():
    found = read(
        with_columns("day", [f"{46093 + i / 96:.9f}" for i in range(len(Q))]),
        {"columns": {"time_s": {"name": "day", "unit": "d"}}},
    )
    np.testing.assert_allclose(found.state.time, 900.0 * np.arange(len(Q)), atol=1e-3)


def orientations() -> Rotation:
    """Of a tool that is turned on the flange, in the instrument's frame."""
    flange = Rotation.from_matrix(forward(load_robot("irb4600_60_205"), np.radians(Q))[:, :3, :3])
    return Rotation.from_euler("z", 0.7) * flange * Rotation.from_euler("xyz", [0.3, -1.1, 0.4])


@pytest.mark.parametrize(
    ("form", "numbers", "unit"),
    [
        ("xyz", lambda R: R.as_euler("xyz", degrees=True), None),
        ("ZYX", lambda R: R.as_euler("ZYX"), "rad"),
        ("ZYZ", lambda R: R.as_euler("ZYZ", degrees=True), "deg"),
        ("rotvec", lambda R: R.as_rotvec(), None),
        ("wxyz", lambda R: R.as_quat()[:, [3, 0, 1, 2]], None),
        ("xyzw", lambda R: -R.as_quat(), None),
    ],
)
def test_orientations_in_the_form_of_the_map(form, numbers, unit):
    R = orientations()
    cells = numbers(R)
    columns = ["u", "v", "w", "t"][: cells.shape[1]]
    layout = {"orientation": {"columns": columns, "form": form} | ({"unit": unit} if unit else {})}
    found = read(with_columns(",".join(columns), [",".join(f"{x:.9f}" for x in row) for row in cells]), layout)
    np.testing.assert_allclose(found.rotation, R.as_matrix(), atol=1e-7)
    assert found.diagnostics == () and list(found.state.channels) == []


@pytest.mark.parametrize(
    ("stated", "numbers", "means"),
    [
        ({"form": "ZYX"}, lambda R: R.as_euler("xyz", degrees=True), 'form = "xyz", unit = "deg"'),
        ({"form": "xyz"}, lambda R: R.as_euler("ZYZ"), 'form = "ZYZ", unit = "rad"'),
        ({"form": "xyz"}, lambda R: R.as_euler("yxz", degrees=True), 'form = "yxz", unit = "deg"'),
        ({"form": "ZYX"}, lambda R: R.as_rotvec(), 'form = "rotvec", unit = "rad"'),
        ({"form": "rotvec"}, lambda R: R.as_rotvec(degrees=True), 'form = "rotvec", unit = "deg"'),
        ({"form": "wxyz"}, lambda R: R.as_quat(), 'form = "xyzw"'),
        ({"form": "xyzw"}, lambda R: -R.as_quat()[:, [3, 0, 1, 2]], 'form = "wxyz"'),
        ({"form": "wxyz"}, lambda R: R.inv().as_quat()[:, [3, 0, 1, 2]], "export the tool as the instrument sees it"),
    ],
)
def test_orientations_in_another_form_than_the_map_says_are_recognised(stated, numbers, means):
    cells = numbers(orientations())
    columns = ["u", "v", "w", "t"][: cells.shape[1]]
    lines = with_columns(",".join(columns), [",".join(f"{x:.9f}" for x in row) for row in cells])
    with pytest.raises(PostprocError) as error:
        read(lines, {"orientation": {"columns": columns} | stated})
    (found,) = [d for d in error.value.diagnostics if d.severity == "error"]
    assert found.code == "DAT009" and "orientations do not follow the arm" in found.message
    assert "they follow it to 0.0" in found.message and means in found.help


def test_orientations_that_no_form_explains_say_so():
    cells = np.random.default_rng(3).uniform(-90, 90, (len(Q), 3))
    lines = with_columns("u,v,w", [",".join(f"{x:.4f}" for x in row) for row in cells])
    with pytest.raises(PostprocError) as error:
        read(lines, {"orientation": {"columns": ["u", "v", "w"], "form": "xyz"}})
    assert "read as" not in str(error.value) and "check `form`" in str(error.value)


@pytest.mark.parametrize(
    "layout",
    [
        {"form": "xxy", "columns": ["u", "v", "w"]},
        {"form": "rpy", "columns": ["u", "v", "w"]},
        {"form": "xyz", "columns": ["u", "v"]},
        {"form": "xyz", "columns": "u"},
        {"form": "xyz", "columns": ["u", "v", "w"], "unit": "grad"},
        {"form": "xyz", "columns": ["u", "v", "nowhere"]},
        "xyz",
    ],
)
def test_a_wrong_orientation_map_is_a_finding(layout):
    assert [
        d.code for d in refused(lambda: read(with_columns("u,v,w", ["1,2,3"] * len(Q)), {"orientation": layout}))
    ] == ["DAT002"]


@pytest.mark.parametrize(
    ("text", "place", "says"),
    [
        ("seperator = ';'", "1:1", "did you mean `separator`?"),
        ("separator = 5", "1:13", "valid string"),
        ("decimal = ':'", "1:11", "'.' or ','"),
        ("header = 'no heading'", "1:10", "boolean"),
        ("[columns]\nq1_deg = 1.5", "2:10", "`columns.q1_deg`"),
        ("[columns]\nx_mm = { name = 'X', unit = 'furlong' }", "2:8", "known are deg, rad"),
        ("[columns]\nx_mm = { name = 'X', sgin = -1 }", "2:1", "did you mean `sign`?"),
        ("[columns]\nx_mm = { name = 'X', sign = 'minus' }", "2:8", "valid number"),
        ("[columns", "1:9", "not TOML"),
    ],
)
def test_a_wrong_map_says_where_and_what_is_allowed(text, place, says):
    (found,) = refused(
        lambda: read_measurements(
            Source("t.csv", table()), load_robot("irb4600_60_205"), None, Source("m.toml", text.encode())
        )
    )
    assert (found.code, found.place) == ("DAT002", f"m.toml:{place}")
    assert says in found.message + found.help


@pytest.mark.parametrize(("name", "meant"), [("paylod_kg", "payload_kg"), ("tempeature_C", "temperature_C")])
def test_misspelt_names_are_warned_of(name, meant):
    in_table = read(with_columns(name, ["5"] * len(Q)))
    in_map = read(with_columns("M", ["5"] * len(Q)), {"columns": {name: "M"}})
    for found in (in_table, in_map):
        (said,) = (d for d in found.diagnostics if d.code == "DAT015")
        assert said.severity == "warning" and said.help == f"did you mean `{meant}`?"
        assert list(found.state.channels) == [name]


def test_what_is_not_used_is_said():
    found = read(with_columns("wind,q7_deg", [",1"] * (len(Q) - 1) + ["2,1"]))
    assert [d.message for d in found.diagnostics] == ["column `wind` holds empty cells and is not used"]
    assert list(found.state.channels) == ["q7_deg"]


def test_remarks_are_not_read():
    rows = table().decode().splitlines()
    lines = [f"{rows[0]},remark", *(f"{row},beam {i} held" for i, row in enumerate(rows[1:] + rows[1:]))]
    found = read("\n".join(lines).encode())
    assert [(d.code, d.severity) for d in found.diagnostics] == [("DAT015", "info")]
    assert "more than 12 different words" in found.diagnostics[0].message and list(found.state.channels) == []


@pytest.mark.parametrize("layout", [None, {"columns": {"shift": "Schicht"}}])
def test_each_of_a_few_words_is_a_channel(layout):
    words = ["spät", "", "früh", "none"] * len(Q)
    found = read(with_columns("Schicht,site", [f"{word},Ulm" for word in words[: len(Q)]]), layout)
    name = "shift" if layout else "Schicht"
    late, early = (np.array([w == word for w in words[: len(Q)]]) for word in ("spät", "früh"))
    assert list(found.state.channels) == [*(f"{name}={w}" for w in ("spät", "früh", "none")), "site=Ulm"]
    np.testing.assert_array_equal(found.state.channels[f"{name}=spät"], late)
    np.testing.assert_array_equal(found.state.channels[f"{name}=früh"], early)
    (said,) = found.diagnostics
    assert said.code == "DAT015" and said.severity == "info" and f"`{name}=früh`" in said.message


@pytest.mark.parametrize("turn", ["W,P,R", "Rx [rad],Ry [rad],Rz [rad]", "A (deg),B (deg),C (deg)"])
def test_what_looks_like_an_orientation_is_said(turn):
    (said,) = read(with_columns(turn, [f"{i},2,3" for i in range(len(Q))])).diagnostics
    assert (said.code, said.severity) == ("DAT015", "info") and "look like an orientation" in said.message
    assert all(f"`{name}`" in said.message for name in turn.split(",")) and "[orientation]" in said.help
    assert read(with_columns("wind,P,R", ["1,2,3"] * len(Q))).diagnostics == ()


def test_signs_alone_are_sides():
    names = ",".join(f"dir{j}" for j in range(1, 7))
    found = read(with_columns(names, ["+,-,+,+,-,0"] * (len(Q) // 2) + ["-,+,+,-,+,+"] * (len(Q) - len(Q) // 2)))
    np.testing.assert_array_equal(found.state.approach[[0, -1]], [[1, -1, 1, 1, -1, 0], [-1, 1, 1, -1, 1, 1]])
    caught = refused(lambda: read(with_columns(names, ["up,up,down,up,up,up"] * len(Q))))
    assert {d.code for d in caught} == {"DAT003"} and "+1, -1" in caught[0].help


@pytest.mark.parametrize("name", ["Achse {} [°]", "Axe {} (deg)", "Gelenk{} [deg]"])
def test_axes_in_other_tongues_are_known(name):
    header = HEADER
    for j in range(1, 7):
        header = header.replace(f"q{j}_deg", name.format(j))
    found = read(table(header=header))
    np.testing.assert_allclose(np.degrees(found.state.q), Q, atol=1e-4)


def test_sides_and_payloads_that_are_guessed_are_said():
    names = ",".join(f"dir{j}" for j in range(1, 7))
    found = read(with_columns(names + ",payload_kg", ["1,-1,0,1,1,2,45"] * len(Q)))
    np.testing.assert_array_equal(found.state.approach[0], [1, -1, 0, 1, 1, 1])
    assert [(d.code, d.severity) for d in found.diagnostics] == [("DAT015", "warning")] * 2
    assert "`dir6` holds 2" in found.diagnostics[0].message
    assert "the mass is taken in the flange's centre" in found.diagnostics[1].message


def test_a_map_is_offered_from_three_known_columns_on() -> None:
    assert likely_map(("J1", "J2"), ("", "")) == ""
    offered = likely_map(("J1", "J2", "J3"), ("", "", ""))
    assert offered.splitlines()[2:] == ['q1_deg = "J1"', 'q2_deg = "J2"', 'q3_deg = "J3"']


def test_the_map_that_a_terminal_shows_can_be_copied() -> None:
    """The lines that are proposed stand as lines of their own, and are a map by which the table is read."""
    data = table(header="pose,A1,A2,A3,A4,A5,A6,X,Y,Z")
    shown = refused(lambda: read(data))[0].render().partition("with the lines:\n")[2]
    np.testing.assert_allclose(1e3 * read(data, tomllib.loads(shown)).position, PLACES, atol=1e-3)
