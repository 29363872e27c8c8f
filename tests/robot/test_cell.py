"""Tracks, gantries and positioners beside closed forms in plain numpy, and beside numbers of public cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.diagnostics import Source
from postproc.model.file import parse_model
from postproc.model.rewrite import render_model
from postproc.robot.catalogue import load_robot
from postproc.robot.cells.cell import Cell, axis_positions
from postproc.robot.cells.cell_file import ROBOT, read_cell_file
from postproc.robot.cells.mechanical_units import read_cell
from postproc.robot.cells.station import Station
from postproc.robot.controller import Backup, read_entries
from postproc.robot.kinematics import forward
from tests.build import refused

# The numbers of four public cells (docs/robot.md), in MOC.cfg's own form: only what carries the geometry.
TRACKS, GANTRY, POSITIONER, SYS = (
    (Path(__file__).parent / "configurations" / f"{name}.cfg").read_text("utf-8")
    for name in ("tracks", "gantry", "positioner", "sys")
)


def alone(found: Cell, arm: str = ROBOT) -> Station:
    """An arm whose task has all units of the cell."""
    return Station(found, arm, tuple(found.units))


def cell(moc: str, system: str = "") -> Cell:
    return read_cell(Backup(system=read_entries(system), motion=read_entries(moc)))


def quaternion(u0: float, u1: float, u2: float, u3: float) -> np.ndarray:
    """Rotation matrix of a quaternion, normalised (plain formula)."""
    w, x, y, z = np.array([u0, u1, u2, u3]) / np.sqrt(u0**2 + u1**2 + u2**2 + u3**2)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def positions(*rows: list[float]) -> np.ndarray:
    return np.array([[*row, *[np.nan] * (6 - len(row))] for row in rows])


def test_a_track_carries_its_arm_as_a_stored_target_says() -> None:
    """Public backup: jointtarget and robtarget of one place, tool0 and wobj0, 437.111 mm along the track.

    The script that stored the target takes 50 mm off x; the rest agrees to 0.07 mm and 0.0004 deg.
    """
    found = cell(TRACKS, SYS)
    task = found.tasks["t_rob1"]
    assert (task.arm, task.units, task.moves) == ("ROB_1", ("TRACK_1",), True) and not found.tasks["t_back"].moves
    at = axis_positions(found, task.units, np.array([[437.111, *[9e9] * 5]]))
    q = np.radians([-90.3902, 25.9625, -1.81017, 397.771, 2.4839, 395.773])
    T = alone(found, "ROB_1").base(at)[0] @ forward(load_robot("irb4600_40_255"), q[None])[0]
    assert T[:3, 3] * 1e3 - [50, 0, 0] == pytest.approx([1204.87, 3460.46, 1074.55], abs=0.08)
    turned = quaternion(0.323552, 0.682651, -0.504563, -0.417993)
    angle = np.arccos((np.trace(turned.T @ T[:3, :3]) - 1) / 2)
    assert np.degrees(angle) < 0.001
    joint = found.unit("track_1").joints[0]
    assert (joint.axis, joint.kind, joint.lower, joint.upper) == ("a", "linear", -0.001, 3.901)
    assert found.unit("TRACK_1").active and not found.unit("TRACK_2").active


def test_an_arm_on_a_track_keeps_its_orientation_and_moves_along_the_track() -> None:
    found = cell(TRACKS)
    T = alone(found, "rob_1").base(positions([0.0], [1.5], [-0.3]))
    along = quaternion(8.91218e-06, -0.000726608, 0.000932384, 0.999999)[:, 0]
    start = np.array([3.69928, 3.45103, 0.0175951])
    for row, e in enumerate((0.0, 1.5, -0.3)):
        assert T[row, :3, 3] == pytest.approx(start + e * along, abs=1e-12)
        assert np.abs(T[row, :3, :3] - quaternion(0.707061, 0.000751788, -0.000145575, -0.707152)).max() < 1e-12
    assert np.isnan(alone(found, "rob_1").base(positions([np.nan]))).any()


def test_a_gantry_runs_along_the_axes_of_the_world_as_its_programs_say() -> None:
    """Public ship-hull cell: X along +x, Y along +y, Z along +z, R about +z; eax_a = X - 9500 and so on."""
    found = cell(GANTRY)
    g = np.random.default_rng(3)
    floor = g.uniform([500, 300, 1200], [21000, 5300, 2100], (20, 3))  # X, Y, Z of the work object on the floor [mm]
    turned = g.uniform(-1.7, 1.7, 20)
    eax = np.column_stack([floor[:, 0] - 9500, 5300 - floor[:, 1], 2100 - floor[:, 2], np.degrees(turned)])
    at = axis_positions(found, ("Gantry",), np.hstack([eax, np.full((20, 2), 9e9)]))
    T = alone(found).world("Gantry", at)
    column = np.array([-9.5, 5.3, 2.1]) + floor * [1e-3, -1e-3, -1e-3]  # turned by 180 deg about x
    start = alone(found).world("Gantry", positions([0.0, 0.0, 0.0, 0.0]))[0]
    assert np.linalg.norm(start[:3, 3]) == pytest.approx(0.488) and start[2, 3] == pytest.approx(0.0, abs=1e-6)
    for place, r, frame in zip(column, turned, T, strict=True):
        turn = np.array([[np.cos(r), -np.sin(r), 0], [np.sin(r), np.cos(r), 0], [0, 0, 1.0]])
        assert frame[:3, 3] == pytest.approx(place + turn @ start[:3, 3], abs=1e-6)
        assert frame[:3, :3] == pytest.approx(turn @ start[:3, :3], abs=1e-6)
    arm_base = alone(found, "ROB_1").base(positions([1.0, 2.0, 0.5, 0.0]))[0]
    assert np.abs(arm_base - alone(found).world("GANTRY", positions([1.0, 2.0, 0.5, 0.0]))[0]).max() < 1e-12
    joints = found.unit("Gantry").joints
    assert [(j.axis, j.kind) for j in joints] == [
        ("a", "linear"), ("b", "linear"), ("c", "linear"), ("d", "rotary"), (None, "fixed")
    ]  # fmt: skip
    assert joints[3].speed == pytest.approx(np.radians(275.17), rel=1e-4)


@pytest.mark.parametrize("first", [(1.0, 0.0, 0.0, 0.0), (0.707107, 0.707107, 0.0, 0.0), (0.5, 0.5, -0.5, 0.5)])
def test_a_gantry_beside_the_modified_denavit_hartenberg_product(first: tuple[float, ...]) -> None:
    """Rot(x, attitude) Trans(x, length) Rot(z, home + q) Trans(z, offset + d), row by row, written out.

    ``base_pose_rot`` of its ROBOT_TYPE turns the first row in the base frame.
    """
    turned = " ".join(f"-base_pose_rot_u{i} {u}" for i, u in enumerate(first))
    found = cell(GANTRY.replace('-type "GEN_KIN" -no_of_joints 5', f'-type "GEN_KIN" -no_of_joints 5 {turned}'))
    rows = [(0, 0, 0, 0), (np.pi / 2, 0, np.pi / 2, 0), (np.pi / 2, 0, 0, 0), (0, 0, -np.pi / 2, 0)]
    at = np.array([3.0, 1.5, 0.4, 0.7])
    T = np.eye(4)
    T[:3, :3] = quaternion(0, 0.707107, 0, 0.707107) @ quaternion(*first)
    for i, (alpha, a, theta, d) in enumerate(rows):
        turn, shift = (at[i], 0.0) if i == 3 else (0.0, at[i])
        ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(theta + turn), np.sin(theta + turn)
        T = T @ [
            [ct, -st, 0, a],
            [st * ca, ct * ca, -sa, -(d + shift) * sa],
            [st * sa, ct * sa, ca, (d + shift) * ca],
            [0, 0, 0, 1],
        ]
    T = T @ [[-1, 0, 0, 0.488], [0, -1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    assert np.abs(alone(found).world("Gantry", positions(at.tolist()))[0] - T).max() < 5e-6  # -3.14159 of six digits


def test_a_follower_goes_with_its_leader_where_it_is_not_stated() -> None:
    found = cell(GANTRY)
    led = alone(found).world("ELM_X", np.array([[2.5, np.nan, np.nan, np.nan, np.nan, np.nan]]))[0]
    own = alone(found).world("ELM_X", np.array([[2.5, np.nan, np.nan, np.nan, np.nan, 1.0]]))[0]
    assert led[:3, 3] == pytest.approx([2.5, 0, 0]) and own[:3, 3] == pytest.approx([1.0, 0, 0])


def test_a_two_axis_positioner_turns_its_plate() -> None:
    """Axis 1 along world -y at 0.843 m, axis 2 along +x at zero, the plate 153 mm out."""
    found = cell(POSITIONER)
    at = np.radians([[0, 0], [30, 0], [0, 40], [25, -70]])
    T = alone(found).world("STN1", np.hstack([at, np.full((4, 4), np.nan)]))
    foot = np.array([0, 0, 0.84317])
    for (tilt, turn), frame in zip(at, T, strict=True):
        c, s = np.cos(-tilt), np.sin(-tilt)
        lean = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])  # about -y by the tilt
        assert frame[:3, 3] == pytest.approx(foot + lean @ [0.153, 0, 0], abs=1e-6)
        axis = lean @ np.array([1.0, 0, 0])
        assert frame[:3, 2] == pytest.approx(axis, abs=1e-5)
        still = alone(found).world("STN1", positions([tilt, 0.0]))[0]
        K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        spin = np.eye(3) + np.sin(turn) * K + (1 - np.cos(turn)) * K @ K
        assert frame[:3, :3] == pytest.approx(spin @ still[:3, :3], abs=1e-5)
    assert found.unit("STN1").joints[0].upper == pytest.approx(3.159) and not found.unit("STN1").active


def test_gravity_in_base_axes() -> None:
    hanging = cell(GANTRY).arms["rob_1"].gravity
    assert hanging == pytest.approx([0, 0, 9.81], abs=1e-12)
    wall = GANTRY.replace("-gravity_beta 3.14159", "-gravity_beta 1.5708")
    assert cell(wall).arms["rob_1"].gravity == pytest.approx([9.81, 0, 0], abs=1e-12)
    both = cell(GANTRY.replace("-gravity_beta 3.14159", "-gravity_alpha 0.63 -gravity_beta 0.95"))
    assert both.arms["rob_1"].gravity is None and [d.code for _, d in both.findings] == ["KIN015"]
    turned = alone(cell(GANTRY), "rob_1").gravity(positions([0, 0, 0, 0.5], [1, 2, 0.3, -1.2]))
    assert turned is not None and turned == pytest.approx(np.tile([0, 0, 9.81], (2, 1)), abs=1e-6)


def test_what_is_not_understood_is_a_finding() -> None:
    odd = TRACKS.replace("IRBT4004_2", "IRBP_L_1").replace('-base_frame_coordinated "TRACK_2"', "")
    found = cell(odd)
    assert [(name, d.code) for name, d in found.findings] == [("TRACK_2", "KIN014")]
    assert np.isnan(alone(found).world("TRACK_2", positions([0.1]))).any()
    place = TRACKS.replace("-base_frame_pos_x 3.69928", "").replace("-base_frame_pos_y 3.45103", "")
    same = cell(place.replace("-base_frame_pos_z 0.0175951", ""))
    assert any("at one place" in d.message for _, d in same.findings)


STATED = (Path(__file__).parent / "configurations" / "stated.toml").read_text("utf-8")


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "cell.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_cell_that_a_file_states(tmp_path: Path) -> None:
    found = read_cell_file(written(tmp_path, STATED))
    at = axis_positions(found, ("GANTRY", "STN1"), np.array([[250.0, 400.0, 30.0, 9e9, 9e9, 9e9]]))
    assert at[0, :3] == pytest.approx([0.25, 0.4, np.pi / 6])
    base = alone(found, ROBOT).base(at)[0]
    assert base[:3, 3] == pytest.approx([0.25, 0.4, 0.0]) and np.abs(base[:3, :3] - np.eye(3)).max() < 1e-7
    plate = alone(found).world("stn1", at)[0]
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    assert plate[:3, 3] == pytest.approx([2.0, -0.5, 0.7])
    assert plate[:3, :3] == pytest.approx(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]))
    assert found.arms[ROBOT].gravity == pytest.approx([0, 0, 9.81], abs=1e-12)
    joints = found.joints(("GANTRY", "STN1"))
    assert (joints["a"].lower, joints["a"].upper, joints["a"].speed) == pytest.approx((-0.5, 9.0, 0.8))
    assert joints["c"].speed == pytest.approx(np.pi / 2)


def test_a_model_file_describes_its_cell_and_keeps_it() -> None:
    axes = STATED.partition("\n\n")[2]
    text = f'robot = "irb4600_60_205"\n\n[mounting]\nrpy_deg = [180, 0, 0]\n\n[effects.joint_compliance]\n\n{axes}'
    model = parse_model(Source("m.toml", text.encode()))
    assert model.station is not None and set(model.station.cell.units) == {"gantry", "stn1"}
    assert model.station.cell.arms[ROBOT].gravity == pytest.approx(model.gravity)
    again = parse_model(Source("m.toml", render_model(model, text).encode()))
    assert again.station is not None and set(again.station.cell.units) == {"gantry", "stn1"}
    odd = text.replace("[-500, 9000]", "[9000, -500]").encode()
    caught = refused(lambda: parse_model(Source("m.toml", odd)))
    assert (caught[0].code, caught[0].place) == ("KIN016", "m.toml:14:1")


@pytest.mark.parametrize(
    ("old", "new", "place", "said"),
    [
        ('axis = "b"', 'axis = "a"', "14:1", "twice"),
        ('unit = "STN1"', 'parent = "e"', "25:1", "eax_e"),
        ('carries = "work"', 'carries = "robot"', "24:1", "both carry the robot"),
        ("quat = [0.7071068, 0, 0, 0.7071068]", "quat = [0.7, 0, 0, 0]", "19:1", "length 1"),
        ("limits = [-180, 180]", "limits = [180, -180]", "27:1", "lower limit"),
        ('kind = "rotary"', 'kind = "round"', "23:8", "kind"),
        ("speed = 90", "sped = 90", "28:1", "sped"),
    ],
)
def test_mistakes_in_a_cell_file_are_found_at_their_place(
    tmp_path: Path, old: str, new: str, place: str, said: str
) -> None:
    found = refused(lambda: read_cell_file(written(tmp_path, STATED.replace(old, new))))[0]
    assert (found.code, found.place) == ("KIN016", f"{tmp_path}/cell.toml:{place}") and said in found.message


def test_a_backup_and_its_configuration_say_the_same(tmp_path: Path) -> None:
    folder = tmp_path / "backup" / "SYSPAR"
    folder.mkdir(parents=True)
    (folder / "MOC.cfg").write_text(TRACKS)
    (folder / "SYS.cfg").write_text(SYS)
    whole, moc = read_cell_file(tmp_path / "backup"), read_cell_file(folder / "MOC.cfg")
    assert set(whole.units) == set(moc.units) == {"track_1", "track_2"} and set(whole.tasks) == {"t_rob1", "t_back"}
    assert not moc.tasks
