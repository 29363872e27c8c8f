"""Tables that say something else than their names: never read in silence."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.diagnostics import PostprocError
from postproc.measure.read.table import read_measurements
from postproc.robot.catalogue import load_robot
from postproc.robot.kinematics import forward
from tests.build import refused
from tests.measure.tables import HEADER, column_map, edited, poses, source, table

ARM = load_robot("irb4600_60_205")
N = 40
LOADED = [float(20 * (i % 2)) for i in range(N)]


def beside(names: str, *columns, units: str = "") -> list[str]:
    """The table with further columns, and a row of units where one is given."""
    lines = table(N)
    body = [",".join([line, *(f"{c[i]:.8g}" for c in columns)]) for i, line in enumerate(lines[1:])]
    return [f"{lines[0]},{names}", *([units] if units else []), *body]


def read(lines, layout=None, **more):
    return read_measurements(source(lines), ARM, column_map=column_map(layout), **more)


def said(lines, severity: str, **more) -> str:
    """What is said with that severity."""
    try:
        found = read(lines, **more).diagnostics
    except PostprocError as error:
        found = tuple(error.diagnostics)
    return " ".join(d.message for d in found if d.severity == severity)


@pytest.mark.parametrize(
    ("lines", "severity", "says"),
    [
        (
            beside(",".join(f"dir{j}" for j in range(1, 7)), *[np.arange(N) % 2] * 6),
            "warning",
            "sides of approach are 1 and 0 and never -1",
        ),
        (beside("x_mm", np.arange(N)), "error", "columns 8 and 11 are both called `x_mm`"),
        (beside("payload_kg", 1e3 * np.array(LOADED)), "error", "`irb4600_60_205` carries 60 kg (rows 2 and 19 more)"),
        (beside("payload_kg", 6 * np.array(LOADED)), "warning", "`payload_kg` is 120, and `irb4600_60_205` carries 60 kg"),
        (beside("payload_kg", [-1.0, *LOADED[1:]]), "error", "no mass is negative"),
        (
            beside("payload_kg,payload_x_mm,payload_y_mm,payload_z_mm", LOADED, *np.outer([0.04, 0, 0.12], np.ones(N))),
            "error",
            "centre is 0.13 mm from the flange at the most",
        ),
        (beside("payload_x_mm,payload_y_mm,payload_z_mm", *np.outer([40, 0, 120], np.ones(N))), "warning", "centre of the payload"),
        (beside("temperature_C", [1e300, *np.linspace(20, 25, N - 1)]), "warning", "is no measured number"),
        (beside("sigma_mm", [30.0] * N), "error", "`sigma_mm` is 30"),
        (beside("sigma_mm", [3e-5] * N), "error", "`sigma_mm` is 3e-05"),
        (beside("sigma_mm", [0.0] * N), "warning", "`sigma_mm` is 0 in 40 of 40 rows; no instrument has none"),
        (beside("temperature_C", np.linspace(293, 297, N)), "warning", "`temperature_C` is 293"),
        (beside("temperature_C", [9999.0, *np.linspace(20, 25, N - 1)]), "warning", "`9999` in column `temperature_C`"),
        (beside(",".join(f"mq{j}_deg" for j in range(1, 7)), *np.radians(poses(N)).T), "error", "`mq1_deg` is 64 deg from `q1_deg`"),
        (beside("q7_deg", np.arange(N)), "warning", "`q7_deg` is a channel like others: an arm has six joints"),
        (edited(table(N), [7, 8, 9], lambda x: 1e-3 * x)[:6] + table(N)[6:], "error", "5 of 40 rows look like metres"),
        ([table(N)[0], *(",".join([*line.split(",")[:7], "NaN", "", "-"]) for line in table(N)[1:])], "error", "no row can be used"),
        ([f"{table(N)[0]},dir1", *(f"{line},up" for line in table(N)[1:])], "error", "(and 39 more) in column `dir1`"),
    ],
    ids=[
        "sides", "twice", "grams", "pounds", "negative", "centre in m", "no mass", "1e300", "sigma in um", "sigma in m", "sigma 0", "kelvin", "9999",
        "mq in rad", "seven joints", "some in m", "nothing seen", "words",
    ],
)  # fmt: skip
def test_what_cannot_be_is_said(lines, severity, says):
    assert says in said(lines, severity)


def test_a_coarse_instrument_is_one():
    assert read(beside("sigma_mm", [1.5] * N)).diagnostics == ()


def test_the_same_column_twice_does_no_harm():
    lines = table(N)
    body = [f"{line},{line.split(',')[7]}" for line in lines[1:]]
    assert read([f"{lines[0]},x_mm", *body]).diagnostics == ()


def test_a_column_is_read_in_the_unit_that_it_states():
    seconds, mass = np.arange(N) * 60.0, np.array(LOADED)
    lines = beside("Time [ms],Mass [lb],v1 [rad/s]", 1e3 * seconds, mass / 0.45359237, np.full(N, 0.5))
    speeds = {f"v{j}_deg_s": "v1 [rad/s]" for j in range(1, 7)}
    found = read(lines, {"columns": {"time_s": "Time [ms]", "payload_kg": "Mass [lb]", **speeds}})
    np.testing.assert_allclose(found.state.time, seconds)
    np.testing.assert_allclose(found.state.payload_mass, mass, atol=1e-6)
    np.testing.assert_allclose(found.state.v, 0.5)


def test_a_unit_that_is_not_known_is_said():
    lines = beside("Temp [F]", np.full(N, 70.0))
    assert "states the unit `F`" in said(lines, "warning", layout={"columns": {"temperature_C": "Temp [F]"}})


def test_masses_that_nobody_reads_are_said():
    assert "`Last [kg]` holds masses" in said(beside("Last [kg]", LOADED), "warning")
    found = read(beside("Last [kg]", LOADED), {"columns": {"payload_kg": "Last [kg]"}})
    np.testing.assert_allclose(found.state.payload_mass, LOADED)


def test_commanded_angles_beside_those_that_were_reached():
    lines = table(N)
    names = [f"J{j} {what} [deg]" for what in ("cmd", "act") for j in range(1, 7)]
    body = [",".join([line, *line.split(",")[1:7]]) for line in lines[1:]]
    found = read([",".join(["pose_id", *names[:6], "x_mm,y_mm,z_mm", *names[6:]]), *body])
    np.testing.assert_array_equal(found.state.q, read(lines).state.q)


def test_a_row_of_units_below_the_names_is_read():
    lines = beside("time_s", 1e3 * np.arange(N), units="-,deg,deg,deg,deg,deg,deg,mm,mm,mm,ms")
    found = read(lines)
    np.testing.assert_allclose(found.state.time, np.arange(N))
    assert len(found) == N and found.line[0] == 3


def test_names_below_a_line_of_merged_cells():
    found = read([",Joints,,,,,,Position,,", *table(N)])
    assert len(found) == N and [d.severity for d in found.diagnostics] == ["info"]


def test_quoted_decimal_commas_between_commas():
    lines = table(N)
    body = [
        ",".join([line.split(",")[0], *(f'"{c.replace(".", ",")}"' for c in line.split(",")[1:])]) for line in lines[1:]
    ]
    np.testing.assert_array_equal(read([lines[0], *body]).position, read(lines).position)


def turned(order) -> list[str]:
    """Angles and orientations alone, in an instrument's axes, their four numbers in some order."""
    q = np.round(poses(N), 5)
    seen = Rotation.from_euler("xyz", [0.3, -0.8, 2.0]) * Rotation.from_matrix(forward(ARM, np.radians(q))[:, :3, :3])
    numbers = (seen * Rotation.from_euler("xyz", [1.0, 0.2, 0.5])).as_quat()[:, order]
    names = ",".join(HEADER.split(",")[:7])
    return [f"{names},qw,qx,qy,qz", *(f"P{i}," + ",".join(f"{x:.7f}" for x in (*q[i], *numbers[i])) for i in range(N))]


def test_orientations_alone_must_follow_the_arm():
    assert read(turned([3, 0, 1, 2])).diagnostics == ()
    assert "orientations do not follow the arm" in said(turned([0, 1, 2, 3]), "error")
    assert "read as `xyzw` they follow it" in said(turned([0, 1, 2, 3]), "error")


def test_positions_of_the_controller_itself():
    q = np.round(poses(N), 5)
    places = 1e3 * forward(ARM, np.radians(q))[:, :3, 3]
    lines = [
        HEADER,
        *(
            f"P{i}," + ",".join(f"{x:.3f}" if k > 5 else f"{x:.5f}" for k, x in enumerate((*q[i], *places[i])))
            for i in range(N)
        ),
    ]
    assert "no arm is so exact" in said(lines, "warning")


def test_poses_of_a_program_in_radians():
    lines = [
        ",".join(f"q{j}_deg" for j in range(1, 7)),
        *(",".join(f"{x:.6f}" for x in row) for row in np.radians(poses(N))),
    ]
    assert "look like radians" in said(lines, "warning", measured=False)
    lines = [lines[0], *(",".join(f"{x:.6f}" for x in row) for row in poses(N))]
    assert read(lines, measured=False).diagnostics == ()


def test_commanded_poses_that_no_arm_reaches_are_one_error():
    q = poses(N)
    T = forward(ARM, np.radians(q))
    turn = Rotation.from_matrix(T[:, :3, :3]).as_quat()[:, [3, 0, 1, 2]]
    names = "cmd_x_mm,cmd_y_mm,cmd_z_mm,cmd_qw,cmd_qx,cmd_qy,cmd_qz,x_mm,y_mm,z_mm"
    rows = [",".join(f"{x:.6f}" for x in (*T[i, :3, 3], *turn[i], 1.0, 2.0, i)) for i in range(N)]
    with pytest.raises(PostprocError, match="of 40 commanded poses cannot be reached"):
        read([names, *rows])


def test_lines_of_separators_alone_are_no_rows():
    data = read([*table(N)[:20], ",,,,,,,,,", *table(N)[20:], ";;;", " , ,"])
    assert len(data) == N and data.diagnostics == ()


def test_one_pose_measured_often_is_no_wrong_arm():
    lines = table(N)
    body = [",".join([*lines[1].split(",")[:7], f"{100 + 0.01 * i:.3f},{200 - 0.01 * i:.3f},300"]) for i in range(30)]
    assert read([lines[0], *body]).diagnostics == ()


def beside_others(points: list[int]) -> list[str]:
    """The table with the points of other rows beside its joint angles."""
    head, *rows = table(N)
    cells = [row.split(",") for row in rows]
    return [head, *(",".join([*mine[:7], *cells[k][7:]]) for mine, k in zip(cells, points, strict=False))]


@pytest.mark.parametrize(
    ("points", "says", "line"),
    [
        ([*range(25), *range(26, N)], "from row 26 on every point belongs to the joint angles of the next row", 27),
        ([*range(6), *range(7, N)], "from row 7 on every point belongs to the joint angles of the next row", 8),
        (
            [*range(12), *range(11, N - 1)],
            "from row 13 on every point belongs to the joint angles of the row before",
            14,
        ),
        ([*range(1, 31), *range(30, N)], "up to row 30 every point belongs to the joint angles of the next row", 2),
        ([N - 1, *range(N - 1)], "every point belongs to the joint angles of the row before", 2),
    ],
    ids=["missed", "early", "twice", "late", "all"],
)
def test_points_beside_the_angles_of_other_rows_are_told(points, says, line):
    (found,) = refused(lambda: read(beside_others(points)))
    assert found.code == "DAT009"
    assert found.message.startswith(says)
    assert found.as_json()["line"] == line


def test_a_few_points_of_other_rows_are_told_one_by_one():
    found = read(beside_others([*range(20), 21, 20, *range(22, N)])).diagnostics
    assert sorted(d.message.split(" lies ")[0] for d in found) == ["row 21", "row 22"]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("x_mm,y_mm,z_mm", "X [m],Y [m],Z [m]", ("positions look like millimetres, not metres", "unit = 'mm'")),
        (
            "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg",
            ",".join(f"J{j} [rad]" for j in range(1, 7)),
            ("the joint angles look like degrees, not radians", "unit = 'deg'"),
        ),
    ],
)
def test_a_unit_that_a_name_states_wrongly_is_told_as_what_it_is(old, new, says):
    head, *rows = table(N)
    found = refused(lambda: read([head.replace(old, new), *rows]))[-1]
    assert says[0] in found.message
    assert says[1] in found.help


def test_the_columns_of_an_instrument_alone_lack_the_joint_angles():
    rows = table(N)[1:]
    layout = {"columns": {"x_mm": "X", "y_mm": "Y", "z_mm": "Z"}}
    (found,) = refused(
        lambda: read(["Point,X,Y,Z", *(",".join([row.split(",")[0], *row.split(",")[7:10]]) for row in rows)], layout)
    )
    assert "there are no commanded joint angles" in found.message
    assert "put the joint angles that the controller commanded beside the points" in found.help


def test_units_and_commas_within_cells_are_told():
    head, *rows = table(N)
    raised = refused(lambda: read([head, *(f"{row} mm" for row in rows)]))
    assert any("write the number alone, and its unit behind the column's name" in d.help for d in raised)
    assert (
        "is the comma the decimal sign, too?"
        in refused(lambda: read([head, *(row.replace(".", ",") for row in rows)]))[0].help
    )


def test_rows_without_a_point_are_listed_once():
    lines = [line if k % 5 != 3 else ",".join([*line.split(",")[:7], "", "", ""]) for k, line in enumerate(table(N))]
    (found,) = read(lines).diagnostics
    assert found.message == "rows 3, 8, 13, 18, 23 and 3 more of 40 have nothing measured: not used"
