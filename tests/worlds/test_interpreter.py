"""The interpreter of the tests against facts of the language; the source stands at each.

Kernel: Technical reference manual RAPID kernel, 3HAC16585-1 (section numbers). Overview, Functions, Instructions: the
RAPID manuals of the same name. K3: RAPID Reference Manual, Basic Characteristics.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.worlds.alignment import identities
from tests.worlds.compare import compare_worlds
from tests.worlds.geometry import distance_to_arc, flange, matrix_of_quaternion, quaternion_of_matrix
from tests.worlds.interpreter import Interpreter, load
from tests.worlds.parser import parse
from tests.worlds.syntax import SyntaxFault
from tests.worlds.values import orient_zyx
from tests.worlds.world import World

WORLD = World(7)
P = "[[1200,-300,500],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


def run(body: str, outside: str = "", world: World = WORLD) -> Interpreter:
    task = Interpreter(
        load([f"MODULE M\n{outside if 'PROC' not in outside else ''}\n" + _with(body, outside) + "\nENDMODULE"]), world
    )
    task.run()
    return task


def _with(body: str, outside: str) -> str:
    return f"PROC main()\n{body}\nENDPROC\n{outside if 'PROC' in outside else ''}"


def module(text: str, world: World = WORLD) -> Interpreter:
    task = Interpreter(load([text]), world)
    task.run()
    return task


def value(task: Interpreter, name: str) -> Any:
    return task.final()[f"/{name}"][1]


def calculated(type_: str, expression: str, *before: str) -> Any:
    """What data of a type holds after an assignment in main, after other declarations."""
    lines = "\n".join(before)
    return value(module(f"MODULE M\n{lines}\nVAR {type_} x;\nPROC main()\nx:={expression};\nENDPROC\nENDMODULE"), "x")


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("NOT FALSE AND FALSE", True),  # Kernel 3: <expr> ::= [ NOT ] <logical term> ..: NOT (FALSE AND FALSE)
        ("NOT TRUE AND FALSE", True),
        ("NOT TRUE OR TRUE", True),  # (NOT TRUE) OR TRUE: the sign stands before the first logical term
        ("TRUE OR FALSE AND FALSE", True),  # AND before OR
        ("(TRUE OR FALSE) AND FALSE", False),
        ("TRUE XOR TRUE OR TRUE", True),  # OR and XOR have one priority, from the left
        ("TRUE OR TRUE XOR TRUE", False),
        ("1+1=2 AND 2*3=6", True),  # relations before AND
        ("FALSE AND 1/0>0", False),  # Overview: what the left operand decides is not evaluated
        ("TRUE OR 1/0>0", True),
        ("[1,2,3]=[1,2,3]", True),  # records compare component by component
    ],
)
def test_logic(expression: str, expected: bool) -> None:
    assert calculated("bool", expression) is expected


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("2+3*4", 14),  # Kernel 3: <term> before <simple expr>
        ("-2*3+1", -5),  # the sign belongs to the first term
        ("7 DIV 2", 3),
        ("7 MOD 4", 3),
        ("2*7 DIV 4", 3),  # *, /, DIV, MOD: one priority, from the left
        ("10-4-3", 3),
        ("0x1F", 31),
        (".5+0.", 0.5),
        ("Round(2.5)", 3),  # Functions: Round to the nearest, a half away from zero
        ("Trunc(-2.7)", -2),
        ("Round(0.3852138\\Dec:=3)", 0.385),
        ("StrLen(\"ab\"+\"\"\"c\")", 4),  # Kernel 2.7: two quotes are one
        ("StrFind(\"Robotics\",1,\"aeiou\")", 2),  # Functions: StrFind, its own example
        ("StrMatch(\"Robotics\",1,\"bo\")", 3),  # Functions: StrMatch, its own example
        ("StrLen(NumToStr(0.38521,3))", 5),  # Functions: NumToStr(0.38521,3) is "0.385"
        ("VectMagn([3,4,0])", 5),
        ("Distance([0,0,0],[1,2,2])", 3),
        ("DotProd([1,2,3],[4,5,6])", 32),
        ("Sin(30)", 0.5),
        ("ATan2(1,1)", 45),
    ],
)  # fmt: skip
def test_numbers(expression: str, expected: float) -> None:
    assert calculated("num", expression) == pytest.approx(float(np.float32(expected)), abs=1e-6)


def test_num_is_single_and_dnum_double() -> None:
    """K3: num is IEEE 754 single; RL: dnum is double."""
    assert calculated("num", "0.1") == float(np.float32(0.1))
    assert calculated("num", "16777216+1") == 16777216.0
    assert calculated("dnum", "16777216+1") == 16777217.0
    assert calculated("num", "0.1+0.2") == float(np.float32(np.float32(0.1) + np.float32(0.2)))
    assert calculated("num", "DnumToNum(d)", "VAR dnum d:=0.1;") == float(np.float32(0.1))


def test_tenths_reach_one_after_ten_turns_in_single_precision() -> None:
    """In double precision ten tenths are less than one and the loop would turn eleven times."""
    task = run("k:=0; n:=0; WHILE k<1 DO k:=k+0.1; n:=n+10; ENDWHILE", "VAR num k; VAR num n;")
    assert value(task, "n") == 100
    assert sum([0.1] * 10) < 1


def test_for() -> None:
    """Kernel 4.15: step 1 or -1 without STEP, bounds evaluated once, the variable hides data and cannot be changed."""
    declared = "VAR string s; VAR num i:=50; VAR num e:=3;"
    assert (
        value(run('FOR i FROM 1 TO e DO e:=9; s:=s+NumToStr(i,0); ENDFOR s:=s+":"+NumToStr(i,0);', declared), "s")
        == "123:50"
    )
    assert value(run("FOR i FROM 3 TO 1 DO s:=s+NumToStr(i,0); ENDFOR", declared), "s") == "321"
    assert value(run("FOR i FROM 1 TO 8 STEP 3 DO s:=s+NumToStr(i,0); ENDFOR", declared), "s") == "147"


def test_test_takes_the_first_case_that_fits() -> None:
    """Kernel 4.17; cases may be lists and strings."""
    declared = "VAR num n; VAR num m;"
    assert value(run("TEST 3 CASE 1,2: n:=1; CASE 2,3: n:=2; CASE 3: n:=3; DEFAULT: n:=4; ENDTEST", declared), "n") == 2
    assert value(run('TEST "b" CASE "a": n:=1; DEFAULT: n:=4; ENDTEST', declared), "n") == 4


def test_compact_if_and_goto() -> None:
    """Kernel 4.14, 4.6: a label of the routine, also of an enclosing list."""
    task = run(
        "n:=0; top: n:=n+1; IF n<5 GOTO top; FOR i FROM 1 TO 9 DO IF i=3 GOTO out; m:=i; ENDFOR out: n:=n*10;",
        "VAR num n; VAR num m;",
    )
    assert (value(task, "n"), value(task, "m")) == (50, 2)


ROUTINES = """MODULE M
VAR num a:=1; VAR num b:=2; VAR num c{3}:=[10,20,30]; VAR robtarget p;
PROC main()
  both a,a;
  copied b;
  second c{2};
  second p.trans.y;
  whole c;
  b:=b+power(2,5);
ENDPROC
PROC both(INOUT num x,INOUT num y) x:=5; y:=y+1; ENDPROC
PROC copied(num x) x:=99; ENDPROC
PROC second(INOUT num x) x:=x+7; ENDPROC
PROC whole(INOUT num v{*}) v{3}:=Dim(v,1); ENDPROC
FUNC num power(num x,num n) IF n=0 RETURN 1; RETURN x*power(x,n-1); ENDFUNC
ENDMODULE"""


def test_parameters() -> None:
    """Kernel 5.1: IN is a copy, INOUT the argument itself (twice the same, an element, a component); recursion."""
    task = module(ROUTINES)
    assert (value(task, "a"), value(task, "b"), value(task, "c"), value(task, "p")[0][1]) == (6, 34, [10, 27, 3], 7)


def test_optional_parameters_and_switches() -> None:
    r"""Kernel 3.10, 4.5: Present, ``\opt?x`` hands on what is present itself, alternatives by ``|``."""
    task = module("""MODULE M
VAR num n:=0;
PROC main()
  outer \\up \\by:=4;
  outer;
  named far:=3;
ENDPROC
PROC outer(\\switch up|switch down,\\num by)
  IF Present(up) n:=n+1;
  IF Present(down) n:=n+10;
  inner \\by?by;
ENDPROC
PROC inner(\\num by)
  IF Present(by) THEN n:=n+100*by; ELSE n:=n+1000; ENDIF
ENDPROC
PROC named(num far) n:=n+0.5*far; ENDPROC
ENDMODULE""")
    assert value(task, "n") == 1402.5


def test_scopes() -> None:
    """Kernel 2.17: routine data hide LOCAL data, these hide global ones; LOCAL routines hide global and built-in ones."""
    texts = [
        "MODULE A\nVAR num g:=1; LOCAL VAR num k:=5; VAR num r;\nPROC main() VAR num g:=100; g:=g+k; r:=g+twice(1); other; ENDPROC\nLOCAL FUNC num twice(num x) RETURN 2000*x; ENDFUNC\nENDMODULE",
        "MODULE B\nLOCAL VAR num k:=7; VAR num s; VAR pos q;\nPROC other() s:=k+twice(1)+g; q:=Offs(1); ENDPROC\nFUNC num twice(num x) RETURN 2*x; ENDFUNC\nFUNC pos Offs(num d) RETURN [d,d,d]; ENDFUNC\nENDMODULE",
    ]
    task = Interpreter(load(texts), WORLD)
    task.run()
    assert (value(task, "r"), value(task, "s"), value(task, "q")) == (2105, 10, [1, 1, 1])


def test_routine_data_begin_anew_at_every_call() -> None:
    """Overview: routine variables are initialised when the routine is called."""
    task = run("bump; bump;", "PROC bump() VAR num n:=3; n:=n+1; m:=m+n; ENDPROC\nENDMODULE\nMODULE D\nVAR num m:=0;")
    assert value(task, "m") == 8


HANDLERS = """MODULE M
VAR num n:=0; VAR num tries:=0; VAR string s;
PROC main()
  again;
  skip;
  deep;
  s:=s+"e";
ENDPROC
PROC again()
  s:=s+"a";
  fails;
  s:=s+"b";
ERROR
  tries:=tries+1;
  RETRY;
ENDPROC
PROC fails()
  IF tries<2 RAISE 99;
ERROR
  RAISE;
ENDPROC
PROC skip()
  n:=1/0;
  s:=s+"c";
ERROR
  IF ERRNO=ERR_DIVZERO TRYNEXT;
ENDPROC
PROC deep()
  inner;
  s:=s+"d";
ERROR (7)
  s:=s+"x";
  RETURN;
ENDPROC
PROC inner()
  RAISE 7;
ERROR
  RAISE;
ENDPROC
ENDMODULE"""


def test_error_handlers() -> None:
    """Kernel 4.8 to 4.11: RETRY runs the statement again, TRYNEXT the one behind it, RAISE hands the error to the caller."""
    assert value(module(HANDLERS), "s") == "abcxe"


def test_late_binding() -> None:
    """Kernel 4.5: ``%expr%``; Instructions: CallByVar puts name and number together."""
    outside = "PROC go2() n:=n+2; ENDPROC\nPROC go3(num x) n:=n+x; ENDPROC\nENDMODULE\nMODULE D\nVAR num n:=0;"
    assert value(run('CallByVar "go",2; %"GO"+"3"% 40; %"M:go2"%;', outside), "n") == 44


def test_data_by_name() -> None:
    """Instructions: SetDataVal and GetDataVal take the name as a string."""
    task = run('SetDataVal "n"+"1",5; GetDataVal "n1",m;', "VAR num n1; VAR num m;")
    assert (value(task, "n1"), value(task, "m")) == (5, 5)


def test_poses() -> None:
    """Functions: Offs in object axes, RelTool in tool axes (x, then new y, then new z), PoseMult, PoseInv, DefFrame."""
    turn = Rotation.from_quat([-0.60035, 0.754504, 0.212751, 0.158241])
    moved = calculated("robtarget", "RelTool(p,10,20,30\\Rx:=5\\Ry:=-8\\Rz:=40)", f"CONST robtarget p:={P};")
    assert np.allclose(moved[0], np.array([1200, -300, 500]) + turn.apply([10, 20, 30]), atol=2e-4)
    expected = turn * Rotation.from_euler("XYZ", [5, -8, 40], degrees=True)
    assert (expected.inv() * Rotation.from_quat(np.roll(moved[1], -1))).magnitude() < 1e-6
    assert calculated("robtarget", "Offs(p,1,2,3)", f"CONST robtarget p:={P};")[0] == [1201, -298, 503]
    poses = ("CONST pose a:=[[10,20,30],[0.5,0.5,0.5,0.5]];", "CONST pose b:=[[-5,7,1],[0.7071068,0,0,0.7071068]];")
    assert np.allclose(calculated("pose", "PoseMult(PoseInv(a),PoseMult(a,b))", *poses)[0], [-5, 7, 1], atol=1e-5)
    assert np.allclose(calculated("pos", "PoseVect(a,[1,0,0])", *poses), [10, 21, 30])
    frame = calculated("pose", f"DefFrame({P},Offs({P},0,50,0),Offs({P},-30,10,0))")
    assert np.allclose(
        Rotation.from_quat(np.roll(frame[1], -1)).as_matrix(), [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-6
    )
    q = orient_zyx(30, -20, 50)
    assert np.allclose(
        Rotation.from_quat(np.roll(q, -1)).as_matrix(),
        Rotation.from_euler("ZYX", [30, -20, 50], degrees=True).as_matrix(),
        atol=1e-6,
    )


def goals(task: Interpreter) -> list[list[float]]:
    return [e.values["goal"][:3, 3].tolist() for e in task.events if e.motion]


MOVING = f'CONST robtarget p:={P}; PERS wobjdata w:=[FALSE,TRUE,"",[[100,0,0],[1,0,0,0]],[[0,20,0],[0.7071068,0,0,0.7071068]]]; VAR robtarget q;'


def test_frames_and_displacement() -> None:
    """K3, coordinate systems: user frame, object frame, program displacement, target; PDispOff ends it."""
    body = "MoveL p,v100,fine,tool0\\WObj:=w; PDispSet [[5,0,0],[1,0,0,0]]; MoveL p,v100,fine,tool0\\WObj:=w; PDispOff; MoveL Offs(p,1,0,0),v100,fine,tool0;"
    assert np.allclose(goals(run(body, MOVING)), [[400, 1220, 500], [400, 1225, 500], [1201, -300, 500]], atol=1e-3)


def test_displacement_from_positions() -> None:
    r"""Instructions: PDispOn \\ExeP: from ProgPoint to ExeP; without it from where the robot stands."""
    body = "PDispOn\\ExeP:=Offs(p,7,8,9),p,tool0; MoveL p,v100,fine,tool0; PDispOff; MoveL Offs(p,0,0,40),v100,fine,tool0; PDispOn p,tool0; MoveL p,v100,fine,tool0;"
    assert np.allclose(goals(run(body, MOVING)), [[1207, -292, 509], [1200, -300, 540], [1200, -300, 540]], atol=1e-3)


def test_where_the_robot_stands() -> None:
    """Functions: CRobT in the object and the displacement that is on, ORobT without the displacement."""
    body = "PDispSet [[5,0,0],[1,0,0,0]]; MoveL p,v100,fine,tool0\\WObj:=w; q:=CRobT(\\Tool:=tool0\\WObj:=w); MoveL q,v100,fine,tool0\\WObj:=w; q:=ORobT(q);"
    task = run(body, MOVING)
    assert np.allclose(*goals(task), atol=1e-3)
    assert np.allclose(value(task, "q")[0], [1205, -300, 500], atol=1e-3)


def test_the_flange_stands_where_the_data_sheet_says() -> None:
    """IRB 4600-60/2.05 at zero: x 175 + 960 + 135, z 495 + 900 + 175; tool0 z points forward."""
    t = flange([0] * 6)
    assert np.allclose(t[:3, 3], [1270, 0, 1570])
    assert np.allclose(t[:3, 2], [1, 0, 0])
    assert np.allclose(flange([90, 0, 0, 0, 90, 0])[:3, 3], [0, 175 + 960, 1570 - 135])


def test_records_of_the_program() -> None:
    """Kernel 2.11; assignment copies."""
    task = module("""MODULE M
RECORD part num n; pos at; ENDRECORD
VAR part a:=[1,[2,3,4]]; VAR part b; VAR part all{2}; VAR num r;
PROC main() b:=a; b.at.y:=30; all{2}:=b; all{2}.n:=9; r:=a.at.y+all{2}.at.y+b.n; ENDPROC
ENDMODULE""")
    assert value(task, "r") == 34


def test_a_trap_runs_between_statements_and_the_same_in_both_programs() -> None:
    text = """MODULE M
VAR intnum i; VAR num n:=0;
PROC main() CONNECT i WITH t; ISignalDI di1,1,i; FOR k FROM 1 TO 40 DO Set do1; ENDFOR IDelete i; FOR k FROM 1 TO 40 DO Set do1; ENDFOR ENDPROC
TRAP t n:=n+1; ENDTRAP
ENDMODULE"""
    fired = value(module(text, replace(WORLD, traps=True)), "n")
    assert 3 <= fired <= 30
    assert value(module(text, replace(WORLD, traps=True)), "n") == fired
    assert value(module(text), "n") == 0


def test_unknown_procedures_write_what_they_can_reach() -> None:
    """Global VAR and PERS by name and arguments by INOUT, never CONST and LOCAL data."""
    text = """MODULE M
VAR num g:=100; LOCAL VAR num k:=100; CONST num c:=100; VAR num a:=100;
PROC main() FOR i FROM 1 TO 30 DO rElsewhere; ENDFOR ENDPROC
ENDMODULE"""
    task = module(text, replace(WORLD, unknown=True))
    assert value(task, "g") != 100
    assert (task.final()["m/k"][1], value(task, "c")) == (100, 100)
    assert value(module(text), "g") == 100


SAME = f"""MODULE M
CONST robtarget p1:={P};
CONST robtarget p2:=[[1200,-100,500],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
PERS num n:=60;
PROC main()
MoveL p1,v100,fine,tool0;
MoveL Offs(p2,0,0,n),v100,fine,tool0;
SetDO do1,1;
ENDPROC
ENDMODULE"""
MIDDLE = "MoveL [[{},-200,530],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tool0;\nMoveL Offs("


@pytest.mark.parametrize(
    ("old", "new", "operator", "said"),
    [
        ("1200,-300", "1200.5,-300", False, ""),
        ("1200,-300", "1201.5,-300", False, "goal"),
        ("Offs(p2,0,0,n)", "Offs(p2,0,0.7,n)", True, ""),
        ("Offs(p2,0,0,n)", "Offs(p2,0,0,60.7)", False, ""),
        ("Offs(p2,0,0,n)", "Offs(p2,0,0,60.7)", True, "goal"),
        ("MoveL Offs(", MIDDLE.format("1200.4"), False, ""),
        ("MoveL Offs(", MIDDLE.format("1200.4"), True, "added"),
        ("MoveL Offs(", MIDDLE.format("1204"), False, "added"),
        ("v100,fine,tool0;\nSetDO", "v200,fine,tool0;\nSetDO", False, "argument"),
        ("SetDO do1,1", "SetDO do1,0", False, "effect"),
        ("SetDO do1,1;", "", False, "order"),
        ("MoveL p1,v100,fine,tool0;", "", False, "order"),
        ("VAR", "VAR", False, ""),
        ("SetDO do1,1;", "SetDO do1,1; n:=3;", False, "data"),
    ],
)  # fmt: skip
def test_the_comparison_sees_what_differs(old: str, new: str, operator: bool, said: str) -> None:
    """A correction of at most 1 mm is allowed, anything else is named by its kind."""
    world = replace(WORLD, operator=operator, says={"n": ["20", "40"]})
    found = compare_worlds(load([SAME]), load([SAME.replace(old, new)]), 1.0, world)
    kinds = {f.split(":")[0] for f in found.faults}
    assert (said in kinds) if said else not kinds, found.faults


def test_a_touched_up_target_must_be_followed() -> None:
    literal = SAME.replace(
        "Offs(p2,0,0,n)",
        "[[1200,-100,560],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]",
    )
    assert compare_worlds(load([SAME]), load([literal]), 1.0, WORLD).faults == []
    assert compare_worlds(load([SAME]), load([literal]), 1.0, replace(WORLD, touched=True)).faults != []
    moved = SAME.replace("-100,500", "-100.6,500.2")
    assert compare_worlds(load([SAME]), load([moved]), 1.0, replace(WORLD, touched=True)).faults == []


def test_added_statements_are_told_from_those_of_the_original() -> None:
    corrected = load([SAME.replace("MoveL Offs(", MIDDLE.format("1200"))])
    matched = identities(load([SAME]), corrected)
    assert [matched[s][1] for s in corrected[0].routines[0].flat] == [False, True, False, False]


def test_geometry() -> None:
    rng = np.random.default_rng(3)
    for r in Rotation.random(20, random_state=5):
        q = quaternion_of_matrix(r.as_matrix())
        assert np.allclose(matrix_of_quaternion(q), r.as_matrix(), atol=1e-12)
    turn = Rotation.random(random_state=2).as_matrix()
    points = [turn @ [50 * math.cos(a), 50 * math.sin(a), 0] + [1, 2, 3] for a in (0.1, 0.9, 2.0, 1.4)]
    assert distance_to_arc(points[3], *points[:3]) < 1e-9
    assert distance_to_arc(points[3] + turn @ [0, 0, 2.5], *points[:3]) == pytest.approx(2.5)
    assert distance_to_arc(rng.normal(size=3) * 0 + [1, 2, 3], *points[:3]) == pytest.approx(50)


@pytest.mark.parametrize(
    "text",
    ["MODULE M PROC main() IF THEN ENDPROC ENDMODULE", "MODULE M PROC main() x:=; ENDPROC ENDMODULE", "MODULE M"],
)
def test_text_that_is_no_program(text: str) -> None:
    with pytest.raises(SyntaxFault):
        parse(text)


def test_the_interpreter_shares_nothing_with_the_package() -> None:
    """Only `product` asks the package to correct programs."""
    here = Path(__file__).parent
    importing = {p.name for p in here.glob("*.py") if re.search(r"^\s*(?:from|import) postproc\b", p.read_text(), re.M)}
    assert importing == {"product.py"}
