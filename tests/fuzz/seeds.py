"""Good inputs to spoil: the samples, and short texts with what people write beside them."""

from __future__ import annotations

from pathlib import Path
from random import Random

from tests.fuzz.mutate import Mutator

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
POSE = "[[900,0,700],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
DATA = """PERS tooldata t:=[TRUE,[[0,0,300],[1,0,0,0]],[4,[0,0,90],[1,0,0,0],0,0,0]];
PERS wobjdata w:=[FALSE,TRUE,"",[[100,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
CONST robtarget p:=[[900,0,700],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
CONST robtarget a{2}:=[P,P];
VAR num n:=3;VAR bool b;CONST string s:="x ""y"" z";
"""
BODIES = (
    "MoveL p,v100,z10,t\\WObj:=w;",
    "MoveJ Offs(p,10,-n,2*(n+1)),v100\\V:=50,fine,t;MoveC p,RelTool(p,0,0,9\\Rz:=90),v50,z1,t;",
    "FOR i FROM 1 TO 2 DO MoveL a{i},v100,z1,t; ENDFOR MoveL a{n-1},v9,fine,tool0;",
    "IF n>2 AND NOT b THEN MoveL p,v1,fine,t; ELSEIF b MOD 2=0 THEN n:=n+1; ELSE RETURN; ENDIF",
    "WHILE n<9 DO Incr n;MoveAbsJ [[0,10,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v100,z1,t; ENDWHILE",
    "TEST n CASE 1,2: MoveL p,v100,z1,t; DEFAULT: Stop; ENDTEST GOTO l; l: n:=n DIV 2;",
    "ArcLStart p,v100,sm1,wd1\\Weave:=wv,fine,t\\WObj:=w;ArcL p,v100,sm1,wd1,z1,t;ArcCEnd p,p,v100,sm1,wd1,fine,t;",
    "p.trans.x:=p.trans.x+1;w.uframe.trans:=[1,2,3];GripLoad load0;ConfL\\Off;AccSet 50,50;VelSet 80,500;PDispSet [[1,0,0],[1,0,0,0]];",
    "q p,n;%\"q\"+ValToStr(n)%;TriggL p,v100,tr,z1,t;SearchL\\Stop,di1,p,p,v10,t;",
    "TPWrite s+\"\\0A\"\\Num:=n;p:=CRobT(\\Tool:=t\\WObj:=w);MoveL p\\ID:=5,v100\\T:=2,z1,t;MoveL *,v1,z1,t; ! note\n",
    "VAR robtarget r;r:=p;r.rot:=OrientZYX(10,20,30);IF b MoveL r,v100,z1,t;MoveLDO r,v100,z1,t,do1,1;",
)  # fmt: skip
PROGRAM_WORDS = b"MODULE|ENDMODULE|PROC x()|ENDPROC|FUNC num f(|ENDFUNC|TRAP|ENDTRAP|ERROR|UNDO|BACKWARD|RECORD r|ENDRECORD|CONST|PERS|VAR|LOCAL|TASK|ALIAS|IF|THEN|ELSE|ENDIF|FOR|FROM|TO|STEP|DO|ENDFOR|WHILE|ENDWHILE|TEST|CASE|DEFAULT:|ENDTEST|GOTO|RETURN|EXIT|RAISE|RETRY|CONNECT|WITH|NOT|AND|OR|XOR|DIV|MOD|MoveL|MoveJ|MoveC|MoveAbsJ|ArcL|TriggL|Offs(|RelTool(|robtarget|num|tooldata|INOUT|\\WObj:=|\\T:=|\\ID:=|*|%%%|<SMT>|9E9|%\"x\"%|?|@|-|+|.".split(b"|")  # fmt: skip
PROGRAM_NESTS = (b"(", b"[", b"{", b"-", b"NOT ", b"a.", b"f(", b"a{", b"IF b THEN ", b"FOR i FROM 1 TO 2 DO ", b"WHILE b DO ", b"TEST n CASE 1: ",
                 b"1+", b"p,", b"PROC x() ", b"MODULE m ", b"MoveL p,v1,z1,t;", b'"', b"\n", b"!", b"Offs(", b"\\", b";")  # fmt: skip
MODEL_EXTRA = """robot = "irb4600_60_205"
[mounting]
rpy_deg = [0, 180.0, 0]
[tool]
rpy_deg = [10, 0, 0]
[effects.joint_offset]
offset_rad = [1e-3, 0, 0, 0, 0, 0]
[effects.tool_frame]
[effects.joint_error_map]
[fit]
note = "x"
rms_mm = 0.02
"""
MODEL_WORDS = b"robot = |[effects.|[[effects]]|[tool]|mounting|rpy_deg|xyz_mm|backlash|thermal_growth|joint_compliance|body = [3]|true|nan|inf|-inf|1979-05-27|\"\"\"|'''|{a = 1}|\\u0000|\\x|..|\"../x\"|\"/\"|[]|[[1],[2,3]]|fit|#".split(b"|")  # fmt: skip
MODEL_NESTS = (b"[", b"{a=", b"a.", b"[a]\n", b"x = 1\n", b'"', b"1,", b"0", b"#", b"\n")
TABLE_WORDS = b"q1_deg,|cmd_x_mm,|target,|qw,|mq1_deg,|temperature_C,|time_s,|session,|dir1,|payload_kg,|sigma_mm,|x_mm,|,,,,|;|\t|\"|\"\"|nan|NA|-|#n/a|+|1;2|a,b|Infinity".split(b"|")  # fmt: skip
TABLE_NESTS = (b",", b";", b'"', b"\n", b"1,", b"\t", b" ", b"-", b"9", b"\r")


def program_mutator(random: Random) -> Mutator:
    """Mostly short programs, which take a millisecond; the samples among them."""
    data = DATA.replace("[P,P]", f"[{POSE},{POSE}]")
    short = [f"MODULE M\nPROC main()\n{body}\nENDPROC\nENDMODULE\n" for body in BODIES]
    middle = [
        f"MODULE M\n{data}PROC main()\n{body}\nENDPROC\nPROC q(robtarget p,VAR num n)\nMoveL p,v1,fine,t;ERROR\nRETRY;\nENDPROC\nENDMODULE\n"
        for body in BODIES
    ]
    whole = [(SAMPLES / name).read_bytes() for name in ("corner_arc.mod", "hull_seam.mod", "paper_case.mod")]
    texts = [text.encode() for text in short * 4 + middle]
    return Mutator([*texts, *whole], PROGRAM_WORDS, PROGRAM_NESTS, random)


def model_mutator(random: Random) -> Mutator:
    files = [path.read_bytes() for path in sorted((SAMPLES / "models").glob("*.toml"))]
    return Mutator([*files, MODEL_EXTRA.encode()], MODEL_WORDS, MODEL_NESTS, random)


def table_mutator(random: Random) -> Mutator:
    """Every sample with its header and four rows, commanded poses beside them."""
    tables = []
    for path in sorted((SAMPLES / "measurements").glob("*.csv")):
        lines = path.read_bytes().split(b"\n")
        tables += [b"\n".join(lines[:5]) + b"\n", b"\n".join(lines[:5]).replace(b",", b";").replace(b".", b",")]
    pose = b"cmd_x_mm,cmd_y_mm,cmd_z_mm,cmd_qw,cmd_qx,cmd_qy,cmd_qz,x_mm,y_mm,z_mm,qw,qx,qy,qz,session,sigma_mm\n"
    row = b"1200,100,900,0,0.7071068,0,0.7071068,1200.1,99.9,899.7,0,0.7071068,0,0.7071068,monday,0.02\n"
    return Mutator([*tables, pose + 3 * row], TABLE_WORDS, TABLE_NESTS, random)
