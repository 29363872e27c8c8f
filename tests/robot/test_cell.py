"""Tracks, gantries and positioners beside closed forms in plain numpy, and beside numbers of public cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

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
FOLDER = Path(__file__).parent / "configurations"
TRACKS, GANTRY, POSITIONER, SYS = (
    (FOLDER / f"{name}.cfg").read_text("utf-8") for name in ("tracks", "gantry", "positioner", "sys")
)
STATED = (FOLDER / "stated.toml").read_text("utf-8")


def cell(moc: str, system: str = "") -> Cell:
    return read_cell(Backup(system=read_entries(system), motion=read_entries(moc)))


def station(moc: str | Cell, arm: str = ROBOT) -> Station:
    """An arm whose task has all units of the cell."""
    found = cell(moc) if isinstance(moc, str) else moc
    return Station(found, arm, tuple(found.units))


def quaternion(*numbers: float) -> np.ndarray:
    return Rotation.from_quat(numbers, scalar_first=True).as_matrix()


def about(axis: str, angle: float) -> np.ndarray:
    return Rotation.from_euler(axis, angle).as_matrix()


def positions(*rows: list[float]) -> np.ndarray:
    return np.array([[*row, *[np.nan] * (6 - len(row))] for row in rows])


def near(T: np.ndarray, place: object, turn: np.ndarray, within: float = 1e-6) -> bool:
    """Whether a frame (4, 4) has this place (3,) [m] and these axes (3, 3)."""
    return bool(np.abs(T[:3, 3] - np.asarray(place)).max() < within and np.abs(T[:3, :3] - turn).max() < within)


def test_a_track_carries_its_arm_as_a_stored_target_says() -> None:
    """Public backup: jointtarget and robtarget of one place, tool0 and wobj0, 437.111 mm along the track.

    The script that stored the target takes 50 mm off x; the rest agrees to 0.07 mm and 0.0004 deg.
    """
    found = cell(TRACKS, SYS)
    task = found.tasks["t_rob1"]
    assert (task.arm, task.units, task.moves) == ("ROB_1", ("TRACK_1",), True) and not found.tasks["t_back"].moves
    at = axis_positions(found, task.units, np.array([[437.111, *[9e9] * 5]]))
    q = np.radians([-90.3902, 25.9625, -1.81017, 397.771, 2.4839, 395.773])
    T = station(found, "ROB_1").base(at)[0] @ forward(load_robot("irb4600_40_255"), q[None])[0]
    assert T[:3, 3] * 1e3 - [50, 0, 0] == pytest.approx([1204.87, 3460.46, 1074.55], abs=0.08)
    turned = quaternion(0.323552, 0.682651, -0.504563, -0.417993)
    assert np.degrees(np.arccos((np.trace(turned.T @ T[:3, :3]) - 1) / 2)) < 0.001
    joint = found.unit("track_1").joints[0]
    assert (joint.axis, joint.kind, joint.lower, joint.upper) == ("a", "linear", -0.001, 3.901)
    assert found.unit("TRACK_1").active and not found.unit("TRACK_2").active


def test_an_arm_on_a_track_keeps_its_orientation_and_moves_along_the_track() -> None:
    bases = station(TRACKS, "rob_1").base(positions([0.0], [1.5], [-0.3]))
    along = quaternion(8.91218e-06, -0.000726608, 0.000932384, 0.999999)[:, 0]
    turn = quaternion(0.707061, 0.000751788, -0.000145575, -0.707152)
    for T, e in zip(bases, (0.0, 1.5, -0.3), strict=True):
        assert near(T, np.array([3.69928, 3.45103, 0.0175951]) + e * along, turn, 1e-12)
    assert np.isnan(station(TRACKS, "rob_1").base(positions([np.nan]))).any()


def test_a_gantry_runs_along_the_axes_of_the_world_as_its_programs_say() -> None:
    """Public ship-hull cell: X along +x, Y along +y, Z along +z, R about +z; eax_a = X - 9500 and so on."""
    found = cell(GANTRY)
    g = np.random.default_rng(3)
    floor = g.uniform([500, 300, 1200], [21000, 5300, 2100], (20, 3))  # X, Y, Z of the work object on the floor [mm]
    turned = g.uniform(-1.7, 1.7, 20)
    eax = np.column_stack([floor[:, 0] - 9500, 5300 - floor[:, 1], 2100 - floor[:, 2], np.degrees(turned)])
    at = axis_positions(found, ("Gantry",), np.hstack([eax, np.full((20, 2), 9e9)]))
    start = station(found).world("Gantry", positions([0.0] * 4))[0]
    assert np.linalg.norm(start[:3, 3]) == pytest.approx(0.488) and start[2, 3] == pytest.approx(0.0, abs=1e-6)
    column = np.array([-9.5, 5.3, 2.1]) + floor * [1e-3, -1e-3, -1e-3]  # turned by 180 deg about x
    for place, r, T in zip(column, turned, station(found).world("Gantry", at), strict=True):
        assert near(T, place + about("z", r) @ start[:3, 3], about("z", r) @ start[:3, :3])
    joints = found.unit("Gantry").joints
    assert [(j.axis, j.kind) for j in joints[3:]] == [("d", "rotary"), (None, "fixed")]
    assert joints[3].speed == pytest.approx(np.radians(275.17), rel=1e-4)


@pytest.mark.parametrize("first", [(1.0, 0.0, 0.0, 0.0), (0.707107, 0.707107, 0.0, 0.0), (0.5, 0.5, -0.5, 0.5)])
def test_a_gantry_beside_the_modified_denavit_hartenberg_product(first: tuple[float, ...]) -> None:
    """Rot(x, attitude) Trans(x, length) Rot(z, home + q) Trans(z, offset + d), row by row, written out.

    ``base_pose_rot`` of its ROBOT_TYPE turns the first row in the base frame.
    """
    keys = " ".join(f"-base_pose_rot_u{i} {u}" for i, u in enumerate(first))
    kind = '-type "GEN_KIN" -no_of_joints 5'
    gantry = station(GANTRY.replace(kind, f"{kind} {keys}"), "ROB_1")
    half, at = np.pi / 2, [3.0, 1.5, 0.4, 0.7]
    rows = [(0, 0, at[0]), (half, half, at[1]), (half, 0, at[2]), (0, at[3] - half, 0)]  # attitude, turn about z, d
    R, p = quaternion(0, 0.707107, 0, 0.707107) @ quaternion(*first), np.zeros(3)
    for attitude, turn, d in rows:
        R = R @ about("x", attitude) @ about("z", turn)
        p = p + d * R[:, 2]
    T = gantry.world("Gantry", positions(at))[0]
    assert near(T, p + 0.488 * R[:, 0], R @ about("z", np.pi), 5e-6)  # -3.14159 of six digits
    assert np.abs(gantry.base(positions(at)) - T).max() < 1e-12


def test_a_follower_goes_with_its_leader_where_it_is_not_stated() -> None:
    unit = station(GANTRY).world("ELM_X", np.array([[2.5, *[np.nan] * 5], [2.5, *[np.nan] * 4, 1.0]]))
    assert unit[:, :3, 3].tolist() == pytest.approx(np.array([[2.5, 0, 0], [1.0, 0, 0]]))


def test_a_two_axis_positioner_turns_its_plate() -> None:
    """Axis 1 along world -y at 0.843 m, axis 2 along +x at zero, the plate 153 mm out."""
    found = station(POSITIONER)
    for tilt, turn in np.radians([[0, 0], [30, 0], [0, 40], [25, -70]]):
        still, T = found.world("STN1", positions([tilt, 0.0], [tilt, turn]))
        lean = about("y", -tilt)
        axis = lean @ np.array([1.0, 0, 0])
        assert near(
            T,
            np.array([0, 0, 0.84317]) + 0.153 * axis,
            Rotation.from_rotvec(turn * axis).as_matrix() @ still[:3, :3],
            1e-5,
        )
        assert T[:3, 2] == pytest.approx(axis, abs=1e-5)
    unit = found.cell.unit("STN1")
    assert unit.joints[0].upper == pytest.approx(3.159) and not unit.active


@pytest.mark.parametrize(
    ("angles", "gravity", "findings"),
    [
        ("-gravity_beta 3.14159", [0, 0, 9.81], []),
        ("-gravity_beta 1.5708", [9.81, 0, 0], []),
        ("-gravity_alpha 0.63 -gravity_beta 0.95", None, ["KIN015"]),
    ],
)
def test_gravity_in_base_axes(angles: str, gravity: list[float] | None, findings: list[str]) -> None:
    hung = station(GANTRY.replace("-gravity_beta 3.14159", angles), "rob_1")
    assert [d.code for d in hung.findings] == findings
    pull = hung.gravity(positions([0, 0, 0, 0], [1, 2, 0.3, 0]))
    assert pull is None if gravity is None else pull == pytest.approx(np.tile(gravity, (2, 1)), abs=1e-6)


def test_what_is_not_understood_is_a_finding() -> None:
    odd = station(TRACKS.replace("IRBT4004_2", "IRBP_L_1").replace('-base_frame_coordinated "TRACK_2"', ""))
    assert [(name, d.code) for name, d in odd.cell.findings] == [("TRACK_2", "KIN014")]
    assert np.isnan(odd.world("TRACK_2", positions([0.1]))).any()
    place = "-base_frame_pos_x 3.69928", "-base_frame_pos_y 3.45103", "-base_frame_pos_z 0.0175951"
    same = TRACKS.replace(place[0], "").replace(place[1], "").replace(place[2], "")
    assert any("at one place" in d.message for _, d in cell(same).findings)


def written(tmp_path: Path, text: str) -> Path:
    (tmp_path / "cell.toml").write_text(text, encoding="utf-8")
    return tmp_path / "cell.toml"


def test_a_cell_that_a_file_states(tmp_path: Path) -> None:
    found = read_cell_file(written(tmp_path, STATED))
    at = axis_positions(found, ("GANTRY", "STN1"), np.array([[250.0, 400.0, 30.0, 9e9, 9e9, 9e9]]))
    assert at[0, :3] == pytest.approx([0.25, 0.4, np.pi / 6])
    assert near(station(found).base(at)[0], [0.25, 0.4, 0.0], np.eye(3))
    assert near(station(found).world("stn1", at)[0], [2.0, -0.5, 0.7], about("z", np.pi / 6))
    assert found.arms[ROBOT].gravity == pytest.approx([0, 0, 9.81], abs=1e-12)
    joints = found.joints(("GANTRY", "STN1"))
    assert (joints["a"].lower, joints["a"].upper, joints["a"].speed) == pytest.approx((-0.5, 9.0, 0.8))
    assert joints["c"].speed == pytest.approx(np.pi / 2)


def test_an_axis_on_the_axis_of_another_unit_goes_with_it(tmp_path: Path) -> None:
    text = STATED.replace('unit = "STN1"', 'unit = "STN1"\nparent = "b"').replace(
        'carries = "work"', 'carries = "nothing"'
    )
    found = station(read_cell_file(written(tmp_path, text)))
    moved = found.world("STN1", positions([0.25, 0.4, 0.0])) - found.world("STN1", positions([0.0, 0.0, 0.0]))
    assert near(moved[0], [0.25, 0.4, 0.0], np.zeros((3, 3)))


def test_a_model_file_describes_its_cell_and_keeps_it() -> None:
    axes = STATED.partition("\n\n")[2]
    text = f'robot = "irb4600_60_205"\n\n[mounting]\nrpy_deg = [180, 0, 0]\n\n[effects.joint_compliance]\n\n{axes}'
    model = parse_model(Source("m.toml", text.encode()))
    again = parse_model(Source("m.toml", render_model(model, text).encode()))
    for read in (model, again):
        assert read.station is not None and set(read.station.cell.units) == {"gantry", "stn1"}
        assert read.station.cell.arms[ROBOT].gravity == pytest.approx(model.gravity)
    odd = text.replace("[-500, 9000]", "[9000, -500]").encode()
    assert refused(lambda: parse_model(Source("m.toml", odd)))[0].place == "m.toml:14:1"


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
    finding = refused(lambda: read_cell_file(written(tmp_path, STATED.replace(old, new))))[0]
    assert (finding.code, finding.place) == ("KIN016", f"{tmp_path}/cell.toml:{place}") and said in finding.message


def test_a_backup_and_its_configuration_say_the_same(tmp_path: Path) -> None:
    folder = tmp_path / "backup" / "SYSPAR"
    folder.mkdir(parents=True)
    (folder / "MOC.cfg").write_text(TRACKS)
    (folder / "SYS.cfg").write_text(SYS)
    full, moc = read_cell_file(tmp_path / "backup"), read_cell_file(folder / "MOC.cfg")
    assert set(full.units) == set(moc.units) == {"track_1", "track_2"} and set(full.tasks) == {"t_rob1", "t_back"}
    assert not moc.tasks
