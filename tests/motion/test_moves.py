"""From RAPID text to moves: what the rows of ``corpus.txt`` cannot say."""

from __future__ import annotations

import numpy as np
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
"""


def read(body: str) -> tuple[list[Move], list[Diagnostic], str]:
    text = f"MODULE M\n{DATA}PROC main()\n{body}\nENDPROC\nENDMODULE\n"
    program = read_program([Source("m.mod", text.encode())])
    moves, findings = read_moves(ROBOT, walk(program))
    return moves, findings, text


def test_joint_angles_are_those_of_the_pose() -> None:
    moves, _, _ = read(f"MoveJ {P1},v200,fine,t1;\nMoveL {P2},v50,z10,t1;")
    assert moves[1].T_work_tcp is not None
    assert np.abs(tcp(moves[1].q[None], moves[1].T_mount_tcp)[0] - moves[1].T_work_tcp).max() < 1e-9


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


def test_an_arc_that_is_a_line_is_named_at_its_target() -> None:
    flat = f"[[1000,-150,600],[0,0,1,0],[-1,0,-1,0],{E}]"
    moves, _, text = read(f"MoveJ {P1},v200,fine,t1;\nMoveC {flat},{P2},v50,fine,t1;")
    _, findings = sample_path(ROBOT, moves)
    assert [d.code for d in findings] == ["MOT001"]
    assert text.encode()[slice(*(findings[0].span or (0, 0)))].decode() == P2


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
