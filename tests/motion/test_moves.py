"""From RAPID text to moves in SI units: loads, speeds, chains, configurations, and what cannot be reached."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.diagnostics import Diagnostic, Source
from postproc.motion.path.moves import read_moves
from postproc.motion.path.places import place_events
from postproc.motion.path.samples import sample_path
from postproc.motion.values import Move
from postproc.rapid.data.records import RobTarget
from postproc.rapid.execution.walk import walk
from postproc.rapid.motions.units import matrix_pose
from postproc.rapid.program.program import read_program
from postproc.robot.cells.station import Station
from postproc.robot.configuration import confdata
from postproc.robot.kinematics import forward
from tests.motion.build import ROBOT, tcp

E = "[9E9,9E9,9E9,9E9,9E9,9E9]"
P1 = f"[[1000,-200,600],[0,0,1,0],[-1,0,-1,0],{E}]"
P2 = f"[[1000,-100,600],[0,0,1,0],[-1,0,-1,0],{E}]"
DATA = """PERS tooldata t1:=[TRUE,[[0,0,300],[1,0,0,0]],[4,[0,0,100],[1,0,0,0],0,0,0]];
PERS wobjdata w1:=[FALSE,TRUE,"",[[100,0,0],[1,0,0,0]],[[0,50,0],[0.707106781,0,0,0.707106781]]];
PERS loaddata part:=[6,[0,0,50],[1,0,0,0],0,0,0];
PERS welddata wd:=[8,0,[0,0,25,8.4,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
PERS seamdata sm:=[0.5,0.3,[0,0,23,7,0,0,0,0,0],0.2,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.5,[0,0,21,5.8,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.8];
VAR robtarget unknown;
"""


def read(body: str) -> tuple[list[Move], list[Diagnostic], str]:
    text = f"MODULE M\n{DATA}PROC main()\n{body}\nENDPROC\nENDMODULE\n"
    program = read_program([Source("m.mod", text.encode())])
    moves, findings = read_moves(ROBOT, walk(program))
    return moves, findings, text


def test_si_units_and_joint_angles() -> None:
    moves, findings, _ = read(f"MoveJ {P1},v200,fine,t1;\nMoveL {P2},v50,z10,t1;")
    assert findings == []
    assert [m.kind for m in moves] == ["joint", "line"]
    assert [m.first for m in moves] == [True, False]
    assert moves[0].T_work_tcp is not None
    assert moves[0].T_work_tcp[:3, 3] == pytest.approx([1.0, -0.2, 0.6])
    assert np.abs(tcp(moves[1].q[None], moves[1].T_mount_tcp)[0] - moves[1].T_work_tcp).max() < 1e-9
    assert (moves[0].speed, moves[1].speed) == (pytest.approx(0.2), pytest.approx(0.05))
    assert moves[1].rotation_speed == pytest.approx(np.radians(500))
    assert (moves[0].fine, moves[1].fine) == (True, False)
    assert (moves[1].zone, moves[1].zone_rotation) == (pytest.approx(0.010), pytest.approx(0.015))
    assert moves[1].zone_angle == pytest.approx(np.radians(1.5))


def test_tool_and_grip_load_are_one_mass() -> None:
    moves, _, _ = read(f"MoveJ {P1},v200,fine,t1;\nGripLoad part;\nMoveL {P2},v50,fine,t1;")
    assert moves[0].payload_mass == 4.0
    assert moves[0].payload_center == pytest.approx([0, 0, 0.1])
    assert moves[1].payload_mass == 10.0
    # The tool's centre is given in tool0, the part's in the tool frame, 300 mm further out.
    assert moves[1].payload_center == pytest.approx([0, 0, (4 * 0.1 + 6 * 0.35) / 10])


@pytest.mark.parametrize(
    ("load", "found"),
    [
        ("[-1,[0,0,100]", ("MOT011", "error", "its mass is -1 kg")),
        ("[0.001,[0,0,1]", ("MOT012", "info", "weighs nothing")),
        ("[61,[0,0,100]", ("MOT012", "warning", "weigh 61 kg")),
        ("[4,[0,0,1600]", ("MOT012", "warning", "1.6 m away")),
        ("[5600,[0,0,100]", ("MOT011", "error", "weigh 5600 kg")),
        ("[5.6,[-0.02,0,0.131]", ("MOT012", "warning", "5.6 kg is 0.133 mm away")),
    ],
)
def test_loads_that_cannot_be_or_are_hard_to_believe(load: str, found: tuple[str, str, str]) -> None:
    body = f"MoveJ {P1},v200,fine,tX;\nMoveL {P2},v50,fine,tX;"
    data = f"PERS tooldata tX:=[TRUE,[[0,0,300],[1,0,0,0]],{load},[1,0,0,0],0,0,0]];\n"
    text = f"MODULE M\n{data}PROC main()\n{body}\nENDPROC\nENDMODULE\n"
    (finding,) = read_moves(ROBOT, walk(read_program([Source("m.mod", text.encode())])))[1]
    assert (finding.code, finding.severity) == found[:2]
    assert found[2] in finding.message and finding.span == (text.index("tX;"), text.index("tX;") + 2)


@pytest.mark.parametrize("most", [54.0, 58.0])
def test_a_payload_counts_with_its_tool(most: float) -> None:
    text = f"GripLoad [{most},[0,0,50],[1,0,0,0],0,0,0];\nMoveJ {P1},v200,fine,t1;"
    assert [d.code for d in read(text)[1]] == (["MOT012"] if most + 4 > 60 else [])


@pytest.mark.parametrize(("accset", "share"), [("50,100", 0.5), ("100,30", 1.0), ("5,50", 0.2), ("250,100", 1.0)])
def test_accset_leaves_a_share_of_the_accelerations(accset: str, share: float) -> None:
    moves, _, _ = read(f"MoveJ {P1},v200,fine,t1;\nAccSet {accset};\nMoveL {P2},v50,fine,t1;")
    assert [m.ease for m in moves] == [1.0, share]


def test_work_object() -> None:
    target = f"[[100,-800,600],[0,0.707106781,0.707106781,0],[0,0,-1,0],{E}]"
    moves, findings, _ = read(f"MoveJ {target},v200,fine,t1\\WObj:=w1;")
    assert all(d.code == "KIN002" for d in findings)
    if moves:
        assert moves[0].T_work_tcp is not None
        assert moves[0].T_work_tcp[:3, 3] == pytest.approx([0.9, 0.15, 0.6], abs=1e-6)


def test_the_weld_speed_governs_the_weld() -> None:
    moves, _, _ = read(
        f"MoveJ {P1},v200,z10,t1;\nArcLStart {P2},v100,sm,wd,fine,t1;\n"
        f"ArcL {P1},v100,sm,wd,z1,t1;\nArcLEnd {P2},v100,sm,wd,fine,t1;"
    )
    assert [m.welding for m in moves] == [False, False, True, True]
    assert [m.speed for m in moves] == pytest.approx([0.2, 0.1, 0.008, 0.008])


def test_speed_and_time_arguments() -> None:
    moves, _, _ = read(f"MoveJ {P1},v200,fine,t1;\nMoveL {P2},v50\\V:=30,fine,t1;\nMoveL {P1},v50\\T:=4,fine,t1;")
    assert moves[1].speed == pytest.approx(0.030)
    assert moves[2].duration == 4.0


def test_a_hidden_target_breaks_the_chain() -> None:
    moves, findings, _ = read(f"MoveJ {P1},v200,fine,t1;\nMoveL *,v50,z10,t1;\nMoveL {P2},v50,fine,t1;")
    assert [m.first for m in moves] == [True, True]
    assert findings == []
    assert [m.row for m in moves] == [0, 2]


def test_everything_out_of_reach_is_found_at_once_and_where() -> None:
    far = f"[[3000,0,600],[0,0,1,0],[0,0,0,0],{E}]"
    odd = f"[[1000,-100,600],[0,0,1,0],[-1,0,-1,5],{E}]"
    body = f"MoveJ {P1},v200,fine,t1;\nMoveL {far},v50,z10,t1;\nMoveL {odd},v50,fine,t1;\n"
    body += "MoveAbsJ [[0,0,0,0,130,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,t1;"
    moves, findings, text = read(body)
    assert [d.code for d in findings] == ["KIN001", "KIN002", "KIN003", "KIN009"]
    assert "cannot reach 3 of 4" in findings[3].message
    assert [text.encode()[slice(*(d.span or (0, 0)))].decode() for d in findings[:2]] == [far, odd]
    assert "joint 5" in findings[2].message
    assert [m.row for m in moves] == [0]


def test_a_start_that_nobody_knows_is_supposed_near_zero_and_followed() -> None:
    """Hand-written confdata and monitoring off: the posture is one of the eight, the one nearest to the arm at zero."""
    odd = [p.replace("[-1,0,-1,0]", "[-1,0,-1,5]") for p in (P1, P2)]
    assert P1 not in odd
    moves, findings, _ = read(f"ConfJ\\Off;\nConfL\\Off;\nMoveJ {odd[0]},v200,fine,t1;\nMoveL {odd[1]},v50,fine,t1;")
    assert [(d.code, d.severity) for d in findings] == [("KIN008", "warning")]
    stated, _, _ = read(f"MoveJ {P1},v200,fine,t1;\nMoveL {P2},v50,fine,t1;")
    np.testing.assert_allclose([m.q for m in moves], [m.q for m in stated], atol=1e-9)


def test_a_statement_in_a_loop_is_wrong_once() -> None:
    far = f"[[3000,0,600],[0,0,1,0],[0,0,0,0],{E}]"
    _, findings, _ = read(f"FOR i FROM 1 TO 5 DO\nMoveL {far},v50,z10,t1;\nENDFOR")
    assert len(findings) == 1


def test_without_configuration_control_the_arm_keeps_the_one_it_has() -> None:
    odd = f"[[1000,-100,600],[0,0,1,0],[-3,-3,0,0],{E}]"
    strict, findings, _ = read(f"MoveJ {P1},v200,fine,t1;\nMoveL {odd},v50,fine,t1;")
    assert [d.code for d in findings] == ["KIN002"]
    moves, findings, _ = read(f"MoveJ {P1},v200,fine,t1;\nConfL\\Off;\nMoveL {odd},v50,fine,t1;")
    assert findings == []
    wanted, _, _ = read(f"MoveJ {P1},v200,fine,t1;\nMoveL {P2},v50,fine,t1;")
    assert moves[1].q == pytest.approx(wanted[1].q)
    assert len(strict) == 1


def test_a_wrist_with_half_a_turn_to_go_changes_neither_shoulder_nor_elbow() -> None:
    """The torch points down and 25 deg aside; from home every turn of axis 6 leaves the arm in front, elbow up."""
    home = "MoveAbsJ [[0,-20,20,0,60,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v200,fine,t1;\nConfJ\\Off;"
    for turn in np.radians(np.arange(0.0, 360.0, 15.0)):
        w, z = np.cos(turn / 2), np.sin(turn / 2)
        goal = f"[[1000,-400,600],[{-0.2164 * z:.7f},{0.9763 * w:.7f},{0.9763 * z:.7f},{0.2164 * w:.7f}],[9,9,9,9],{E}]"
        moves, findings, _ = read(f"{home}\nMoveJ {goal},v200,fine,t1;")
        assert findings == []
        assert abs(moves[1].q[0]) < np.pi / 2 and moves[1].q[2] < np.pi / 2


def test_the_place_that_a_kept_configuration_cannot_reach_is_named() -> None:
    """The arm bends over backwards; 1.75 m from axis 1 only an arm that faces the place reaches it."""
    held = np.eye(4)
    held[2, 3] = 0.3
    place = matrix_pose(tcp(np.radians([[165.0, -80.0, -60.0, 0.0, 60.0, 0.0]]), held)[0])
    over = f"[[{','.join(map(str, place.trans))}],[{','.join(map(str, place.rot))}],[0,0,0,0],{E}]"
    far = f"[[2185,0,495],[0.707106781,0,0.707106781,0],[0,0,0,0],{E}]"
    start = f"MoveAbsJ [[160,-80,-55,0,60,0],{E}],v200,fine,t1;\nConfJ\\Off;\nConfL\\Off;"
    moves, findings, text = read(f"{start}\nMoveJ {over},v50,fine,t1;\nMoveJ {far},v50,fine,t1;")
    line = text[: text.index(far)].count("\n") + 1
    assert [(d.code, d.source.position(d.span[0])[0]) for d in findings if d.source and d.span] == [("KIN002", line)]
    assert "configuration in which it comes" in findings[0].message
    assert [m.kind for m in moves] == ["absjoint", "joint"]


@pytest.mark.parametrize(
    ("stations", "moving"),
    [
        (["0", "0.04", "0.09", "0"], []),
        (["0", "9E9", "0", "9E9"], []),
        (["9E9", "0", "-0.05", "9E9"], []),
        (["500", "500.04", "500.09", "500"], [0]),
        (["500", "9E9", "500", "9E9"], [0]),
        (["9E9", "500", "500", "9E9"], [1]),
        (["500", "500.06", "500.12", "500.18"], [0, 2]),
        (["500", "9E9", "750", "750"], [0, 2]),
        (["0", "0", "0.2", "0"], [2, 3]),
    ],
)
def test_external_axes_away_from_zero_are_refused_where_they_get_there(stations: list[str], moving: list[int]) -> None:
    lines = [f"MoveL {P1[: -len(E) - 1]}[{axis},9E9,9E9,9E9,9E9,9E9]],v50,fine,t1;" for axis in stations]
    _, findings, text = read("\n".join(lines))
    first = text[: text.index("MoveL")].count("\n") + 1
    assert {d.code for d in findings} <= {"MOT008"}
    assert [d.source.position(d.span[0])[0] - first for d in findings if d.source and d.span] == moving


def test_axes_that_carry_nothing_may_move() -> None:
    lines = [f"MoveL {P1[: -len(E) - 1]}[{a},{b},9E9,9E9,9E9,9E9]],v50,fine,t1;" for a, b in (("0", "0"), ("90", "5"))]
    text = f"MODULE M\n{DATA}PROC main()\n{' '.join(lines)}\nENDPROC\nENDMODULE\n"
    events = walk(read_program([Source("m.mod", text.encode())]))
    found = {free: read_moves(ROBOT, events, free)[1] for free in ("", "a", "ab")}
    assert {free: [d.code for d in findings] for free, findings in found.items()} == {
        "": ["MOT008"], "a": ["MOT008"], "ab": []
    }  # fmt: skip
    away = f"MODULE M\n{DATA}PROC main()\n{lines[1]}\nENDPROC\nENDMODULE\n"
    _, standing = read_moves(ROBOT, walk(read_program([Source("m.mod", away.encode())])), "b")
    assert [d.message.partition(":")[0] for d in standing] == ["external axes stand away from zero (eax_a at 90)"]
    assert "(eax_a, eax_b)" in found[""][0].message and "(eax_b)" in found["a"][0].message
    assert found["a"][0].help == "describe them with `--cell FILE`; if they carry neither, say `--free-axes b`"


def test_standing_still_is_no_speed() -> None:
    _, findings, _ = read(f"MoveJ {P1},v200,fine,t1;\nMoveL {P2},[0,500,5000,1000],fine,t1;")
    assert [d.code for d in findings] == ["MOT006"]


def test_an_arc_knows_its_circle_point() -> None:
    via = f"[[1050,-150,600],[0,0,1,0],[-1,0,-1,0],{E}]"
    moves, findings, text = read(f"MoveJ {P1},v200,fine,t1;\nMoveC {via},{P2},v50,fine,t1;")
    assert findings == []
    assert moves[1].kind == "arc"
    assert moves[1].T_work_via is not None
    assert moves[1].T_work_via[:3, 3] == pytest.approx([1.05, -0.15, 0.6])
    flat = f"[[1000,-150,600],[0,0,1,0],[-1,0,-1,0],{E}]"
    text = (
        f"MODULE M\n{DATA}PROC main()\nMoveJ {P1},v200,fine,t1;\nMoveC {flat},{P2},v50,fine,t1;\nENDPROC\nENDMODULE\n"
    )
    found = walk(read_program([Source("m.mod", text.encode())]))
    moves, _ = read_moves(ROBOT, found)
    _, findings = sample_path(ROBOT, moves)
    assert [d.code for d in findings] == ["MOT001"]
    assert text.encode()[slice(*(findings[0].span or (0, 0)))].decode() == P2


def test_velset_lowers_and_limits_programmed_speeds() -> None:
    body = f"MoveJ {P1},v200,fine,t1;\nVelSet 50,80;\nMoveL {P2},v100,fine,t1;\nMoveL {P1},v200,fine,t1;\nArcL {P2},v200,sm,wd,z1,t1;"
    moves, _, _ = read(body)
    assert [1e3 * m.speed for m in moves] == pytest.approx([200, 50, 80, 8])
    assert np.degrees(moves[1].rotation_speed) == pytest.approx(250)


@pytest.mark.parametrize(
    ("data", "body", "message"),
    [
        (
            "PERS tooldata tX:=[TRUE,[[-0.063,0,0.372],[1,0,0,0]],[4,[0,0,90],[1,0,0,0],0,0,0]];",
            "",
            "`tX` is 0.377 mm away",
        ),
        ("PERS loaddata part:=[-1,[0,0,50],[1,0,0,0],0,0,0];", "GripLoad part;", "the load of GripLoad is not defined"),
    ],
)
def test_tools_in_metres_and_payloads_that_were_never_identified(data: str, body: str, message: str) -> None:
    tool = "tX" if "tX" in data else "tool0"
    text = f"MODULE M\n{data}\nPROC main()\n{body}\nMoveJ {P1},v200,fine,{tool};\nENDPROC\nENDMODULE\n"
    findings = read_moves(ROBOT, walk(read_program([Source("m.mod", text.encode())])))[1]
    (found,) = (d for d in findings if d.code == "MOT011")
    assert found.severity == "error" and message in found.message


@pytest.mark.parametrize("wobj_mm", [(0.98, -0.3, 0.7), (980.0, -300.0, 700.0)])
def test_a_work_object_in_metres_is_not_blamed_on_the_arm(wobj_mm: tuple[float, ...]) -> None:
    wobj = f'PERS wobjdata jig:=[FALSE,TRUE,"",[{list(wobj_mm)},[1,0,0,0]],[[0,0,0],[1,0,0,0]]];'
    numbers = "[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    body = "".join(f"MoveL [[{x},0,50],{numbers},v200,fine,tool0\\WObj:=jig;\n" for x in (5010, 5020, 5030))
    text = f"MODULE M\n{wobj}\nPROC main()\n{body}ENDPROC\nENDMODULE\n"
    findings = read_moves(ROBOT, walk(read_program([Source("m.mod", text.encode())])))[1]
    said = [d for d in findings if d.code == "KIN009"]
    assert ("`jig` is 1.24 mm away from its origin" in str(said)) == (wobj_mm[0] < 1)
    assert ("hardly is their arm" in str(said)) == (wobj_mm[0] > 1)


@pytest.mark.parametrize(("x", "said"), [(-1300, "configurations of 3 of 3"), (9000, "hardly is their arm")])
def test_configurations_that_were_never_set_are_told_from_another_arm(x: float, said: str) -> None:
    numbers = "[0.300294,-0.015738,0.95241,0.049914],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    body = "".join(f"MoveJ [[{x},-500,{z}],{numbers},v200,fine,tool0;\n" for z in (700, 720, 740))
    text = f"MODULE M\nPROC main()\n{body}ENDPROC\nENDMODULE\n"
    findings = read_moves(ROBOT, walk(read_program([Source("m.mod", text.encode())])))[1]
    assert [said in d.message for d in findings if d.code == "KIN009"] == [True]


def _located(targets: list[str]) -> list[str]:
    """Codes of what is found in a program that goes to these targets one after another."""
    body = "".join(f"MoveJ {target},v200,fine,tool0;\n" for target in targets)
    text = f"MODULE M\nPROC main()\n{body}ENDPROC\nENDMODULE\n"
    return [d.code for d in read_moves(ROBOT, walk(read_program([Source("m.mod", text.encode())])))[1]]


def test_one_mistyped_target_and_wrong_configurations_are_no_other_arm() -> None:
    """Three statements go to one target that is 2 m off; four of nine state a branch that does not exist."""
    q = [np.array([-0.36, 0.3 + 0.02 * k, 0.1, 0.2, 0.8, 0.1]) for k in range(9)]
    T = [forward(ROBOT, x)[0] for x in q]
    conf = [",".join(map(str, confdata(ROBOT, x[None])[0].tolist())) for x in q]
    place = [np.round(1e3 * t[:3, 3], 3) for t in T]
    turn = [Rotation.from_matrix(t[:3, :3]).as_quat(scalar_first=True).round(9) for t in T]

    def target(k: int, dx: float = 0.0, robconf: str = "") -> str:
        p = place[k] + np.array([dx, 0, 0])
        return f"[{p.tolist()},{turn[k].tolist()},[{robconf or conf[k]}],{E}]"

    good = [target(k) for k in range(9)]
    assert _located(good) == []
    assert _located([*good[:6], *[target(6, 2000.0)] * 3]) == ["KIN001"] * 3
    assert _located([*good[:5], *[target(k, robconf="2,0,0,5") for k in range(5, 9)]]) == ["KIN002"] * 4
    assert _located([target(k, 2000.0) for k in range(9)])[-1] == "KIN009"
    wrong = [target(k, robconf="2,0,0,5") for k in range(9)]
    assert _located(wrong)[-1] == "KIN009"


def test_work_that_a_unit_moves_is_left_alone_where_no_cell_describes_it() -> None:
    work = 'PERS wobjdata st:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
    text = f"MODULE M\n{DATA}{work}PROC main()\nMoveL {P1},v50,fine,t1\\WObj:=st;\nENDPROC\nENDMODULE\n"
    (event,) = place_events(walk(read_program([Source("m.mod", text.encode())])), Station())
    assert event.reason == "the work object `st` is moved by `STN1`, and no cell describes that unit"


def test_an_axis_that_single_precision_leaves_open_is_open() -> None:
    body = "VAR robtarget p:=" + P1 + ";\nPROC main()\np.extax.eax_a:=9E9*1;\nMoveL p,v50,fine,t1;\nENDPROC\n"
    (event,) = walk(read_program([Source("m.mod", f"MODULE M\n{DATA}{body}ENDMODULE\n".encode())]))
    assert isinstance(event.target, RobTarget) and event.target.extax == (9e9,) * 6
