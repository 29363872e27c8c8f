"""Files as trackers, controllers and spreadsheets write them."""

from __future__ import annotations

import io
from datetime import datetime, timedelta

import numpy as np
import openpyxl
import pytest
from scipy.spatial.transform import Rotation

from postproc.diagnostics import PostprocError, Source
from postproc.measure.read.columns import likely_map
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.robot.catalogue import load_robot
from postproc.robot.kinematics import forward
from tests.build import refused
from tests.measure.tables import column_map, points, source, table

ARM = load_robot("irb4600_60_205")
JOINTS = tuple(f"q{j}_deg" for j in range(1, 7))


def cells(lines):
    return [line.split(",") for line in lines]


def workbook(**sheets) -> Source:
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    out = io.BytesIO()
    book.save(out)
    return Source("cell.xlsx", out.getvalue())


def test_a_workbook_is_read_like_its_text():
    lines = table()
    rows = [[*row[:1], *(float(x) for x in row[1:])] if i else row for i, row in enumerate(cells(lines))]
    start = datetime(2026, 3, 12, 14, 2, 7)
    rows = [[*row, start + timedelta(seconds=30 * i) if i else "Timestamp"] for i, row in enumerate(rows)]
    found = read_measurements(workbook(notes=[["cell 4"]], data=rows), ARM)
    plain = read_measurements(source(lines), ARM)
    np.testing.assert_allclose(found.position, plain.position)
    np.testing.assert_allclose(np.diff(found.state.time), 30.0)
    assert any("sheet `data` is read" in d.message for d in found.diagnostics)


def split(lines):
    """The same table as one of the tracker and one of the controller."""
    rows = cells(lines)
    tracker = [",".join([row[0], *row[7:]]) for row in rows]
    return tracker, [",".join(row[:7]) for row in rows]


@pytest.mark.parametrize("how", ["row", "name", "decimal comma"])
def test_a_file_of_joints_stands_beside_the_trackers(how):
    lines = table()
    plain = read_measurements(source(lines), ARM)
    tracker, joints = split(lines)
    if how == "row":
        joints = [row.partition(",")[2] for row in joints]
    else:
        joints = [joints[0], *joints[:0:-1]]
        joints[0] = joints[0].replace("pose_id", "Point")
    if how == "decimal comma":
        joints = [row.replace(",", ";").replace(".", ",") for row in joints]
    beside = Source("joints.csv", "\n".join(joints).encode())
    found = read_measurements(source(tracker), ARM, terms=Reading(joints=beside))
    np.testing.assert_allclose(found.state.q, plain.state.q)
    np.testing.assert_allclose(found.position, plain.position)
    (said,) = (d for d in found.diagnostics if d.code == "DAT033")
    assert ("by the names in `pose_id` and `Point`" if how != "row" else "row by row") in said.message


def test_files_that_do_not_belong_together_are_refused():
    tracker, joints = split(table())
    joints = [row.partition(",")[2] for row in joints]
    beside = Source("joints.csv", "\n".join(joints[:-1]).encode())
    with pytest.raises(PostprocError, match="39 rows"):
        read_measurements(source(tracker), ARM, terms=Reading(joints=beside))


def test_a_measured_place_may_be_a_difference_of_columns():
    lines = table()
    plain = read_measurements(source(lines), ARM)
    rows = cells(lines)
    rows[0][7] = " x_t "
    rows = [[*row, "x_dif" if i == 0 else "1.25"] for i, row in enumerate(rows)]
    for row in rows[1:]:
        row[7] = f"{float(row[7]) + 1.25:.4f}"
    layout = {"columns": {"x_mm": {"name": " x_t", "minus": "x_dif "}}}
    found = read_measurements(source([",".join(row) for row in rows]), ARM, None, column_map(layout))
    np.testing.assert_allclose(found.position, plain.position, atol=1e-9)
    assert found.state.channels == {}
    with pytest.raises(PostprocError, match="`nowhere`"):
        layout = {"columns": {"x_mm": {"name": "x_t", "minus": "nowhere"}}}
        read_measurements(source([",".join(row) for row in rows]), ARM, None, column_map(layout))


def test_an_expanded_uncertainty_is_noise_by_its_factor():
    lines = table()
    lines = [f"{line},{'U(95)' if i == 0 else '0.060'}" for i, line in enumerate(lines)]
    (said,) = (d for d in read_measurements(source(lines), ARM).diagnostics if "U(95)" in d.message)
    assert 'sigma_mm = { name = "U(95)", unit = "mm", factor = 0.5 }' in said.help
    layout = {"columns": {"sigma_mm": {"name": "U(95)", "unit": "mm", "factor": 0.5}}}
    found = read_measurements(source(lines), ARM, None, column_map(layout))
    np.testing.assert_allclose(found.sigma, 3e-5)


def test_stamps_behind_an_apostrophe_are_times():
    lines = table(12)
    stamps = [f"'11.10.2022 15:{i:02d}:48.043" for i in range(12)]
    lines = [f"{lines[0]},Timestamp", *(f"{row},{stamp}" for row, stamp in zip(lines[1:], stamps, strict=True))]
    np.testing.assert_allclose(np.diff(read_measurements(source(lines), ARM).state.time), 60.0)


def test_parts_of_a_quaternion_are_no_joints():
    assert "q1_deg" not in likely_map(("X", "Y", "Z", "Q0", "Q1", "Q2", "Q3"), ("",) * 7)
    assert "q1_deg" not in likely_map(("X", "Y", "Z", "q1", "q2", "q3", "q4"), ("",) * 7)
    lines = table()
    q = np.radians(np.array([[float(x) for x in row[1:7]] for row in cells(lines)[1:]]))
    turns = Rotation.from_euler("z", 0.7) * Rotation.from_matrix(forward(ARM, q)[:, :3, :3])
    numbers = turns.as_quat()[:, [3, 0, 1, 2]]
    told = ["Q0,Q1,Q2,Q3", *(",".join(f"{x:.8f}" for x in row) for row in numbers)]
    found = read_measurements(source([f"{a},{b}" for a, b in zip(lines, told, strict=True)]), ARM)
    (said,) = (d for d in found.diagnostics if "look like an orientation" in d.message)
    assert 'form = "wxyz"' in said.help


@pytest.mark.parametrize(
    ("names", "unit"),
    [
        (("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", *(f"wrist_{j}_joint" for j in (1, 2, 3))), "rad"),
        (tuple(f"actual_q_{j}" for j in range(6)), "rad"),
        (tuple(f"joint_a{j}" for j in range(1, 7)), "rad"),
        (tuple(f"J{j}" for j in range(1, 7)), ""),
    ],
)
def test_joints_as_drivers_call_them_are_proposed(names, unit):
    header = ("measurement_x", "measurement_y", "measurement_z", *names)
    lines = likely_map(header, ("",) * len(header)).splitlines()
    assert 'x_mm = "measurement_x"' in lines
    for name, theirs in zip(JOINTS, names, strict=True):
        assert (f'{name} = {{ name = "{theirs}", unit = "{unit}" }}' if unit else f'{name} = "{theirs}"') in lines


def test_rows_of_another_length_stay_where_every_row_is_asked_about():
    lines = table(12)
    lines[4] += ",7"
    assert len(read_measurements(source(lines), ARM)) == 11
    asked = read_measurements(source(lines), ARM, measured=False)
    assert len(asked) == 12 and asked.pose_id[3] == lines[4].split(",")[0]
    assert np.isnan(asked.state.q[3]).all()
    assert any("nothing is told of it" in d.help for d in asked.diagnostics)


def contradicting() -> list[str]:
    """Points as if joint 6 counted the other way, orientations that say that it does not."""
    rows = np.array([[float(x) for x in row[1:7]] for row in cells(table(40))[1:]])
    other = rows * [1, 1, 1, 1, 1, -1]
    places = points(other, np.array([0.15, -0.1, 0.35]))
    turns = Rotation.from_euler("z", 0.7) * Rotation.from_matrix(forward(ARM, np.radians(rows))[:, :3, :3])
    numbers = np.hstack([rows, places, turns.as_quat()[:, [3, 0, 1, 2]]])
    header = ",".join(["pose_id", *JOINTS, "x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"])
    return [header, *(f"P{i}," + ",".join(f"{x:.7f}" for x in row) for i, row in enumerate(numbers))]


def test_what_orientations_refute_is_not_asserted_from_positions():
    lines = contradicting()
    with pytest.raises(PostprocError) as error:
        read_measurements(source(lines), ARM)
    assert "negated" not in str(error.value)
    bare = [",".join(line.split(",")[:10]) for line in lines]
    with pytest.raises(PostprocError, match="`q6_deg` looks negated"):
        read_measurements(source(bare), ARM)


def test_a_finding_that_the_user_knows_better_is_accepted():
    assert "--accept DAT009" in refused(lambda: read_measurements(source(contradicting()), ARM))[-1].help
    found = read_measurements(source(contradicting()), ARM, terms=Reading(accept=frozenset({"DAT009"})))
    (said,) = (d for d in found.diagnostics if d.code == "DAT009")
    assert said.severity == "warning" and said.help.startswith("accepted")
