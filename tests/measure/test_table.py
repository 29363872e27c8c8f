"""Tables are read as they are meant, and what is wrong with them is named by row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.diagnostics import PostprocError, Source
from postproc.identification.compare import compare
from postproc.measure.alignment import align
from postproc.measure.checks.readings import PlacedArm, zero_errors
from postproc.measure.checks.repeats import estimate_noise
from postproc.measure.iso9283 import iso9283
from postproc.measure.read.table import read_measurements
from postproc.measure.read.terms import Reading
from postproc.model.arm import Model
from postproc.results.comparison import comparison_values
from postproc.robot.catalogue import load_robot
from postproc.robot.kinematics import forward
from tests.build import refused
from tests.measure.tables import TOOL, edited, points, poses, source, table

ARM = load_robot("irb4600_60_205")
IN_ORDER = Reading(rows_in_order=True)
ANGLES, PLACES = range(1, 7), range(7, 10)


def codes(lines, **more):
    try:
        return [d.code for d in read_measurements(source(lines), ARM, **more).diagnostics]
    except PostprocError as error:
        return [d.code for d in error.diagnostics]


def test_a_good_table_has_no_findings_and_si_units():
    lines = table()
    data = read_measurements(source(lines), ARM)
    assert data.diagnostics == ()
    cells = [float(c) for c in lines[3].split(",")[1:]]
    np.testing.assert_allclose(np.degrees(data.state.q[2]), cells[:6], atol=1e-9)
    np.testing.assert_allclose(data.position[2] * 1e3, cells[6:], atol=1e-9)
    assert data.row[2] == 3 and data.line[2] == 4


def test_frame_and_tool_are_found_without_a_guess():
    q = poses(60, seed=3)
    found = align(forward(ARM, np.radians(q)), points(q) * 1e-3)
    np.testing.assert_allclose(found.tool, TOOL, atol=1e-9)
    np.testing.assert_allclose(found.T_instrument_base[:3, 3], [1.5, -2.0, 0.3], atol=1e-9)
    assert found.scale == pytest.approx(1.0, abs=1e-9) and not found.mirrored


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda t: edited(t, ANGLES, np.radians), "radians"),
        (lambda t: edited(t, PLACES, lambda x: x / 1e3), "metres"),
        (lambda t: edited(t, PLACES, lambda x: x / 25.4), "inches"),
        (lambda t: [t[0].replace("x_mm,y_mm", "y_mm,x_mm"), *t[1:]], "two of `x_mm`, `y_mm`, `z_mm` are swapped"),
        (lambda t: [t[0].replace("q2_deg,q3_deg", "q3_deg,q2_deg"), *t[1:]], "`q2_deg` and `q3_deg` look swapped"),
        (lambda t: edited(t, [5], lambda x: -x), "`q5_deg` looks negated"),
        (
            lambda t: edited(edited(t, ANGLES, np.radians), PLACES, lambda x: x / 1e3),
            "they look like radians, not degrees and the positions look like metres",
        ),
        (lambda t: edited(t, [3], lambda x: x - 90), "joint 3 looks counted from a zero 90 deg away"),
        (lambda t: edited(t, [1, 4, 6], lambda x: -x), "columns `q1_deg`, `q4_deg`, `q6_deg` count the other way, or"),
        (
            lambda t: [t[0], *[_joined(a, b) for a, b in zip(t[1:], t[:0:-1], strict=True)]],
            "do not fit the nominal arm",
        ),
    ],
)
def test_wrong_units_and_columns_are_recognised(change, says):
    (finding,) = refused(lambda: read_measurements(source(change(table())), ARM))
    assert finding.code == "DAT009" and says in finding.message


def _joined(angles: str, place: str) -> str:
    """Angles of one row with the place of another."""
    return ",".join([*angles.split(",")[:7], *place.split(",")[7:]])


def test_another_arm_of_the_library_is_named():
    help_ = refused(lambda: read_measurements(source(table()), load_robot("irb4600_40_255")))[0].help
    assert help_.startswith("they fit `irb4600_45_205` or `irb4600_60_205`: check the robot's name")


def test_joint_zeros_are_for_the_fit():
    data = read_measurements(source(edited(table(), [2], lambda x: x + 3)), ARM)
    (finding,) = data.diagnostics
    assert (finding.code, finding.severity) == ("DAT009", "warning")
    assert "joint 2 by -3.0 deg" in finding.help


def test_joint_zeros_that_are_turns_of_instrument_or_tool_stay_where_they_are():
    """Nothing tells joint 1 from the instrument or joint 6 from the tool: rounding must not carry them away."""
    rng = np.random.default_rng(8)
    q, arm = rng.uniform(-1.2, 1.2, (40, 6)), PlacedArm(load_robot("irb4600_60_205"))
    zeros = np.radians([0.0, -2.0, 0.0, 0.0, 1.0, 0.0])
    T = arm.flange(q + zeros)
    point = T[:, :3, :3] @ [0.1, -0.2, 0.3] + T[:, :3, 3] + rng.normal(scale=3e-5, size=(40, 3))
    offset, left = zero_errors(arm, q, point)
    np.testing.assert_allclose(np.degrees(offset), np.degrees(zeros), atol=0.02)
    assert left < 1e-4


def test_lost_beams_do_not_hide_that_the_others_fit():
    lines = table()
    for i, place in ((3, "0,0,0"), (9, "1e9,1e9,1e9"), (17, "0,0,0")):
        lines[i] = _joined(lines[i], ",,,,,,," + place)
    data = read_measurements(source(lines), ARM)
    assert [d.code for d in data.diagnostics] == ["DAT005", "DAT005", "DAT007"]
    assert "0 in 2 of 40 rows" in data.diagnostics[0].message
    assert "row 9 lies" in data.diagnostics[2].message
    assert np.flatnonzero(~data.usable).tolist() == [2, 8, 16]


def test_a_typing_error_names_its_row_and_axis():
    lines = table()
    cells = lines[18].split(",")
    cells[8] = f"{float(cells[8]) + 99:.4f}"
    lines[18] = ",".join(cells)
    data = read_measurements(source(lines), ARM)
    (finding,) = data.diagnostics
    assert finding.code == "DAT007" and "row 18" in finding.message and "`y_mm` alone is off by 99" in finding.message
    assert finding.place == "cell.csv:19:1"
    assert len(data) == 40


def test_copies_rounding_gaps_and_words_are_named():
    lines = table()
    assert codes([*lines, lines[4]]) == ["DAT006"]
    assert "DAT010" in codes([lines[0], *edited([lines[0], *lines[1:]], [], float)[1:]][:1] + _rounded(lines))
    broken = [lines[0], lines[1].replace(lines[1].split(",")[7], "12x"), *lines[2:]]
    assert codes(broken) == ["DAT003"]
    assert codes([*lines[:5], "P9,1,2", *lines[5:]]) == ["DAT004"]  # it counts as empty
    empty = lines[7].split(",")
    empty[2] = ""
    data = read_measurements(source([*lines[:7], ",".join(empty), *lines[8:]]), ARM)
    assert [d.code for d in data.diagnostics] == ["DAT005"]
    assert len(data) == 40 and not data.usable[6] and data.usable.sum() == 39


def _rounded(lines):
    return [",".join(f"{float(c):.1f}" if k in ANGLES else c for k, c in enumerate(x.split(","))) for x in lines[1:]]


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas_are_found_out(separator):
    lines = [line.replace(",", separator).replace(".", ",") for line in table()]
    plain, other = read_measurements(source(table()), ARM), read_measurements(source(lines), ARM)
    np.testing.assert_array_equal(plain.position, other.position)


def test_a_column_map_reads_another_layout():
    lines = edited(table(), [1], lambda x: 90 - x)
    lines = edited(lines, PLACES, lambda x: x / 1e3)
    lines[0] = lines[0].replace("q1_deg", "A1").replace("x_mm,y_mm,z_mm", "X,Y,Z")
    layout = b"""
        [columns]
        q1_deg = { name = "A1", sign = -1, offset = 90 }
        x_mm = { name = "X", unit = "m" }
        y_mm = { name = "Y", unit = "m" }
        z_mm = { name = "Z", unit = "m" }
    """
    data = read_measurements(source(lines), ARM, column_map=Source("map.toml", layout))
    plain = read_measurements(source(table()), ARM)
    np.testing.assert_allclose(data.state.q, plain.state.q, atol=1e-7)
    np.testing.assert_allclose(data.position, plain.position, atol=1e-7)


@pytest.mark.parametrize(
    "lines", [[""], ["pose_id,q1_deg"], ["1,2,3", "4,5,6"], ["pose_id,x_mm,y_mm,z_mm", "a,1,2,3"], table()[1:]]
)
def test_what_is_no_table_is_a_finding_not_a_traceback(lines):
    found = codes(lines)
    assert set(found) <= {"DAT001", "DAT002"} and found


def test_commanded_poses_become_joints():
    q = np.radians(poses(20, seed=5))
    T = forward(ARM, q)
    from scipy.spatial.transform import Rotation

    from postproc.robot.configuration import confdata

    quaternion = Rotation.from_matrix(T[:, :3, :3]).as_quat()[:, [3, 0, 1, 2]]
    conf = confdata(ARM, q)
    header = "cmd_x_mm,cmd_y_mm,cmd_z_mm,cmd_qw,cmd_qx,cmd_qy,cmd_qz,cf1,cf4,cf6,cfx,x_mm,y_mm,z_mm"
    rows = [
        ",".join(map(str, [*T[i, :3, 3] * 1e3, *quaternion[i], *conf[i], *points(np.degrees(q[i : i + 1]))[0]]))
        for i in range(20)
    ]
    data = read_measurements(source([header, *rows]), ARM)
    np.testing.assert_allclose(data.state.q, q, atol=1e-8)


def test_targets_come_from_the_program_that_was_run(samples):
    module = Source("corner_arc.mod", (samples / "paper_case.mod").read_bytes())
    from postproc.rapid.execution.walk import walk
    from postproc.rapid.program.program import read_program

    named = [e.statement.argument("to") for e in walk(read_program(module)) if e.target is not None]
    names = list(dict.fromkeys(a.text for a in named if a is not None and a.text.isidentifier()))
    lines = ["target,x_mm,y_mm,z_mm", *(f"{n},1,2,{i}" for i, n in enumerate(names))]
    data = read_measurements(source(lines), ARM, program=module)
    assert data.tool_known and len(data) == len(names) and np.isfinite(data.state.q).all()
    assert (
        refused(lambda: read_measurements(source(["target,x_mm,y_mm,z_mm", "pNowhere,1,2,3"]), ARM, program=module))[
            0
        ].code
        == "DAT012"
    )
    both = read_measurements(
        source([f"{table()[0]},target", *(f"{x},{names[0]}" for x in table()[1:])]), ARM, program=module
    )
    assert "the angles are taken" in both.diagnostics[0].message


def test_a_tool_that_no_file_declares_is_no_tool0():
    target = "CONST robtarget p:=[[1000,0,1200],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];"
    module = f"MODULE M\n {target}\n PROC main()\n  MoveJ p,v200,fine,tProbe\\WObj:=wJig;\n ENDPROC\nENDMODULE\n"
    with pytest.raises(PostprocError) as caught:
        read_measurements(source(["target,x_mm,y_mm,z_mm", "p,1,2,3"]), ARM, program=Source("M.mod", module.encode()))
    assert [d.code for d in caught.value.diagnostics] == ["RAP020", "RAP020"]
    assert "`tProbe`" in str(caught.value) and "--with" in caught.value.diagnostics[0].help
    tool = "PERS tooldata tProbe:=[TRUE,[[0,0,200],[1,0,0,0]],[2,[0,0,90],[1,0,0,0],0,0,0]];"
    frame = 'PERS wobjdata wJig:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];'
    beside = Source("user.sys", f"MODULE user\n {tool}\n {frame}\nENDMODULE\n".encode(), read_only=True)
    rows = source(["target,x_mm,y_mm,z_mm", "p,1,2,3"])
    found = read_measurements(rows, ARM, program=[Source("M.mod", module.encode()), beside], measured=False)
    np.testing.assert_allclose(found.state.T_flange_tcp[0, :3, 3], [0, 0, 0.2])


@pytest.mark.parametrize("dock_names", ["12", ("left", "right")])
@pytest.mark.parametrize(("shift_mm", "dof"), [(0.5, 20 * 2 * 3), (0.0, 20 * 3 * 3)])
def test_repeats_that_differ_in_a_column_of_the_users_are_none_where_it_matters(shift_mm, dof, dock_names):
    """Two docks, each twice at every pose, the points at the second shifted; and docks that do nothing."""
    g = np.random.default_rng(8)
    lines, rows = table(20, 0.0), []
    for line in lines[1:]:
        cells = line.split(",")
        for dock in (1, 2, 1, 2):
            moved = g.normal([0, shift_mm * (dock - 1), 0], 0.05)
            rows.append(",".join([*cells[:7], *(f"{float(c) + d:.6f}" for c, d in zip(cells[7:], moved, strict=True))]))
            rows[-1] += f",{dock_names[dock - 1]}"
    noise = estimate_noise(read_measurements(source([f"{lines[0]},dock", *rows]), ARM), ARM)
    assert noise.sigma == pytest.approx(5e-5, rel=0.15)
    assert noise.dof == dof


def test_repeats_that_follow_a_number_of_the_users_are_no_noise():
    """A gripper bends by 0.4 um/N, the force another one each time; and in the second round alone."""
    g = np.random.default_rng(5)
    lines, rows = table(24, 0.0), []
    for round_ in range(3):
        for line in lines[1:]:
            cells, force = line.split(","), g.uniform(0, 800)
            moved = g.normal([0, 4e-4 * force, 0], 0.02)
            seen = [f"{float(c) + d:.6f}" for c, d in zip(cells[7:], moved, strict=True)]
            rows.append(",".join([*cells[:7], *seen, f"{force:.1f}", f"{20 + 5 * (round_ == 2)}"]))
    noise = estimate_noise(read_measurements(source([f"{lines[0]},grip_N,temperature_C", *rows]), ARM), ARM)
    assert noise.sigma == pytest.approx(2e-5, rel=0.2)
    assert noise.dof == 24 * 3


def test_repeats_agree_in_words_where_every_one_of_them_does():
    """Three reflectors seated 0.1 mm apart, three measurements of each pose with one, two or three of them."""
    g = np.random.default_rng(3)
    lines, rows = table(30, 0.0), []
    for i, line in enumerate(lines[1:]):
        cells = line.split(",")
        for k in (i % 3, i // 3 % 3, i // 9 % 3):
            moved = g.normal([0.1 * (k == 0), 0.1 * (k == 1), 0.1 * (k == 2)], 0.02)
            seen = [f"{float(c) + d:.6f}" for c, d in zip(cells[7:], moved, strict=True)]
            rows.append(",".join([*cells[:7], *seen, ("A1", "B2", "C3")[k]]))
    noise = estimate_noise(read_measurements(source([f"{lines[0]},smr", *rows]), ARM), ARM)
    assert noise.sigma == pytest.approx(2e-5, rel=0.2)


def test_one_coordinate_tells_its_noise():
    """A laser that measures heights: rows measured three times, x and y empty, the poses without names."""
    g = np.random.default_rng(6)
    lines = table(20, 0.0)
    rows = [
        ",".join([*cells[1:7], "", "", f"{float(cells[9]) + g.normal(0, 0.05):.6f}"])
        for _ in range(3)
        for cells in (line.split(",") for line in lines[1:])
    ]
    data = read_measurements(source([lines[0].removeprefix("pose_id,"), *rows]), ARM)
    noise = estimate_noise(data, ARM)
    assert noise.origin == "repeats" and noise.dof == 20 * 2
    assert noise.sigma == pytest.approx(5e-5, rel=0.25)
    assert data.pose_id[:2] == data.pose_id[20:22] == ("1", "2")
    found = comparison_values(compare(Model(ARM), data))
    assert list(found["per_axis_mm"]) == ["z"] and found["mean_mm"] > 0


def test_noise_and_iso_figures_from_repeats():
    g = np.random.default_rng(4)
    lines = table(30, 0.0)
    rows = []
    for line in lines[1:]:
        cells = line.split(",")
        for _ in range(4):
            shaken = [f"{float(c) + d:.6f}" for c, d in zip(cells[7:], g.normal(0, 0.05, 3), strict=True)]
            rows.append(",".join([*cells[:7], *shaken]))
    data = read_measurements(source([lines[0], *rows]), ARM)
    noise = estimate_noise(data, ARM)
    assert noise.origin == "repeats" and noise.dof == 30 * 3 * 3
    assert noise.sigma == pytest.approx(5e-5, rel=0.15)
    stray = rows[9].split(",")
    stray[8] = f"{float(stray[8]) + 99:.4f}"
    strayed = read_measurements(source([lines[0], *rows[:9], ",".join(stray), *rows[10:]]), ARM)
    assert estimate_noise(strayed, ARM).sigma == pytest.approx(5e-5, rel=0.15)
    figures = iso9283(np.tile([1e-3, 0, 0], (4, 1)), np.zeros(4, dtype=int))
    assert figures.accuracy_mean == pytest.approx(1.0) and figures.repeatability_max == pytest.approx(0.0, abs=1e-12)
    spread = iso9283(np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]) * 1e-3, np.zeros(4, dtype=int))
    assert spread.accuracy_mean == pytest.approx(0.0) and spread.repeatability_max == pytest.approx(1.0)
    # Distances 1, 1, 2 mm from the barycentre: 4/3 + 3 sqrt(1/3).
    uneven = iso9283(np.array([[0, 0, 0], [0, 0, 0], [3, 0, 0]]) * 1e-3, np.zeros(3, dtype=int))
    assert uneven.repeatability_median == pytest.approx(4 / 3 + 3 * np.sqrt(1 / 3))
    assert uneven.accuracy_max == pytest.approx(1.0)


def test_the_row_stands_in_for_a_time_where_the_user_says_that_rows_are_in_order():
    lines = table(12)
    lines = [lines[0], *(row.partition(",")[2].join(("P,", "")) for row in lines[1:])]
    assert "row" not in read_measurements(source(lines), ARM).state.channels
    order = read_measurements(source(lines), ARM, terms=IN_ORDER).state.channels["row"]
    np.testing.assert_array_equal(order, np.arange(1, 13))
    timed = [f"{lines[0]},time_s", *(f"{row},{60 * (i % 5)}" for i, row in enumerate(lines[1:]))]
    assert "row" not in read_measurements(source(timed), ARM, terms=IN_ORDER).state.channels


def test_names_of_poses_that_rise_tell_the_row_where_some_were_left_out():
    lines = table(12)
    some = [lines[0], *lines[4:7], *lines[9:]]
    numbers = [int(row.split(",")[0].lstrip("P")) for row in some[1:]]
    found = read_measurements(source(some), ARM, terms=IN_ORDER).state.channels["row"]
    np.testing.assert_array_equal(found, numbers)
    for other in ([lines[0], *lines[:4:-1]], [lines[0], "Q" + lines[1], *lines[2:]], [lines[0], lines[1], *lines[1:]]):
        found = read_measurements(source(other), ARM, terms=IN_ORDER).state.channels["row"]
        np.testing.assert_array_equal(found, np.arange(1, len(other)))


@pytest.mark.parametrize("column", ["", "time_s", "session"])
def test_sorted_and_shuffled_rows_come_in_one_order(column):
    lines = table(30)
    if column:
        told = [f"{60 * i}" if column == "time_s" else "ab"[i % 2] for i in range(30)]
        lines = [f"{lines[0]},{column}", *(f"{row},{x}" for row, x in zip(lines[1:], told, strict=True))]
    first = read_measurements(source(lines), ARM).in_order
    shuffled = [lines[0], *(lines[1 + i] for i in np.random.default_rng(5).permutation(30))]
    by_joint = [lines[0], *sorted(lines[1:], key=lambda row: float(row.split(",")[4]))]
    for other in (shuffled, by_joint):
        found = read_measurements(source(other), ARM).in_order
        np.testing.assert_array_equal(found.position, first.position)
        assert found.pose_id == first.pose_id and found.row != first.row
    if column == "time_s":
        assert first.row == tuple(range(1, 31))


def test_poses_that_are_only_asked_about_need_no_measurement() -> None:
    header = "pose_id," + ",".join(f"q{j}_deg" for j in range(1, 7))
    source = Source("poses.csv", f"{header}\nA,0,10,20,30,40,50\nB,5,10,20,30,40,50\n".encode())
    robot = load_robot("irb4600_60_205")
    with pytest.raises(PostprocError):
        read_measurements(source, robot)
    asked = read_measurements(source, robot, measured=False)
    assert np.degrees(asked.state.q[:, 0]) == pytest.approx([0.0, 5.0])
    assert np.isnan(asked.position).all()


def gauge(step_mm: float, seed: int) -> list[str]:
    """Lines of a table of 12 poses, three readings of z each with 0.015 mm of noise, in steps of the gauge."""
    rng = np.random.default_rng(seed)
    header, *rows = [line.split(",") for line in table(12)]
    lines = [",".join([*header[:7], "z_mm"])]
    for row in rows:
        read = np.round((float(row[9]) + rng.normal(scale=0.015, size=3)) / step_mm) * step_mm
        lines += [",".join([*row[:7], f"{z:.4f}"]) for z in read]
    return lines


@pytest.mark.parametrize("step_mm", [0.001, 0.002, 0.01, 0.1])
def test_a_gauge_reads_the_same_twice_and_a_copied_row_of_a_tracker_is_no_chance(step_mm):
    said = [code for seed in range(20) for code in codes(gauge(step_mm, seed))]
    assert "DAT006" not in said
    header, *rows = table(12)
    noise = np.random.default_rng(2).normal(scale=0.015, size=(12, 3))
    again = [
        ",".join([*row.split(",")[:7], *(f"{float(x) + e:.4f}" for x, e in zip(row.split(",")[7:], off, strict=True))])
        for row, off in zip(rows, noise, strict=True)
    ]
    assert "DAT006" not in codes([header, *rows, *again])
    assert "DAT006" in codes([header, *rows, *again, again[3]])
    copied = [header, *rows, *again, *again[:2]]
    assert codes(copied).count("DAT006") == 2


@pytest.mark.parametrize(("scatter_mm", "rp_mm"), [(0.001, 0.06), (0.001, None), (0.006, 0.06), (0.03, 0.06)])
def test_readings_of_a_standing_arm_do_not_say_how_well_it_comes_back(scatter_mm, rp_mm):
    """Where repeats scatter far less than the data sheet, the noise has the arm's share: RP / 3.62 per axis."""
    g = np.random.default_rng(8)
    away = np.linalg.norm(g.normal(0, 1, (400_000, 3)), axis=1)
    per_axis = (rp_mm or 0.0) / (away.mean() + 3 * away.std())  # RP of ISO 9283, l + 3 S
    lines, rows = table(30, 0.0), []
    for line in lines[1:]:
        cells = line.split(",")
        for _ in range(3):
            shaken = [f"{float(c) + d:.6f}" for c, d in zip(cells[7:], g.normal(0, scatter_mm, 3), strict=True)]
            rows.append(",".join([*cells[:7], *shaken]))
    arm = replace(ARM, repeatability=None if rp_mm is None else 1e-3 * rp_mm)
    expected = np.hypot(scatter_mm, per_axis) if scatter_mm < 0.004 else scatter_mm
    for order in (np.arange(90), g.permutation(90)):
        data = read_measurements(source([lines[0], *(rows[i] for i in order)]), arm)
        assert 1e3 * estimate_noise(data, arm).sigma == pytest.approx(expected, rel=0.15)
