"""The table of the page for welders: one small program a row, converted, and what came out.

``rows()`` gives the lines of the table in welding.md, ``programs()`` the page that shows every program.
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROBOT = "irb4600_60_205"
TOLERANCE = 0.1  # [mm], the default
AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
TOOL = "tTorch\\WObj:=wJig"

HEAD = f"""MODULE %s
  PERS tooldata tTorch:=[TRUE,[[-58.2,-0.4,361.9],[0.965926,0,0.258819,0]],[4.9,[-18,0,122],[1,0,0,0],0.031,0.034,0.008]];
  PERS wobjdata wJig:=[FALSE,TRUE,"",[[1190,40,560],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  TASK PERS seamdata sm1:=[0.5,0.3,[0,0,23,7,0,0,0,0,0],0.2,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.5,[0,0,21,5.8,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.8];
  TASK PERS welddata wd1:=[9,0,[0,0,25,8.4,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  CONST robtarget pPre:=[[-90.123,-340.214,120.318],[0.009357,-0.906237,-0.107085,-0.408876],[-1,0,-3,0],{AXES}];
  CONST robtarget p1:=[[0.105,-310.111,0.117],[0.009357,-0.906237,-0.107085,-0.408876],[-1,0,-3,0],{AXES}];
  CONST robtarget p2:=[[0.211,-0.127,0.133],[0.009357,-0.906237,-0.107085,-0.408876],[0,0,-3,0],{AXES}];
  CONST robtarget p3:=[[0.311,589.127,0.133],[0.009357,-0.906237,-0.107085,-0.408876],[0,0,-3,0],{AXES}];
"""
WEAVE = "  TASK PERS weavedata wv1:=[1,0,3.2,2.4,0,0.1,0,0.1,0,0,0,0,0,0,0];\n"
APPROACH = f"MoveJ pPre,v600,z20,{TOOL};"
LEAVE = f"MoveJ pPre,v600,fine,{TOOL};"


WEAVING = "\\Weave:=wv1"
TRACKING = "\\Weave:=wv1\\Track:=tr1"
SEAM_NAME = '\\SeamName:="S1"'
SYNCHRONISED = ("p1\\ID:=10", "p3\\ID:=20")
FAR = "p3"
STATION = """  PERS wobjdata wStn:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST robtarget e0:=[[-90,-40,220],[0,1,0,0],[0,0,0,0],[9E9,0,9E9,9E9,9E9,9E9]];
  CONST robtarget e1:=[[50.1,-60.2,20.1],[0,1,0,0],[0,0,0,0],[9E9,0,9E9,9E9,9E9,9E9]];
  CONST robtarget e2:=[[50.3,60.4,20.2],[0,1,0,0],[0,0,0,0],[9E9,40,9E9,9E9,9E9,9E9]];
"""
COORDINATED = """ActUnit STN1;
MoveJ e0,v600,z20,tTorch\\WObj:=wStn;
ArcLStart e1,v150,sm1,wd1,fine,tTorch\\WObj:=wStn;
ArcLEnd e2,v150,sm1,wd1,fine,tTorch\\WObj:=wStn;"""
INDEX = "  CONST robtarget e0:=[[-90,-340,120],[0.009357,-0.906237,-0.107085,-0.408876],[-1,0,-3,0],[9E9,90,9E9,9E9,9E9,9E9]];\n"
CELL = """[[external_axes]]
axis = "b"
kind = "rotary"
carries = "work"
unit = "STN1"
xyz_mm = [1150, 0, 500]
quat = [1, 0, 0, 0]
limits = [-180, 180]
speed = 90
"""
STAND = f"""  PERS tooldata tStand:=[FALSE,[[1300.708,263.76,912.275],[0.24109504,-0.07316134,-0.24524529,0.936149212]],[8,[10,0,60],[1,0,0,0],0,0,0]];
  PERS wobjdata wPlate:=[TRUE,TRUE,"",[[20,-30,150],[0.988771078,0,0,0.149438132]],[[0,0,0],[1,0,0,0]]];
  PERS loaddata ldPlate:=[12,[40,10,20],[1,0,0,0],0,0,0];
  CONST robtarget s0:=[[-120,-80,40],[0.198669331,0.980066578,0,0],[0,0,0,0],{AXES}];
  CONST robtarget s1:=[[-110,-80,0],[0.198669331,0.980066578,0,0],[0,0,0,0],{AXES}];
  CONST robtarget s2:=[[150,-80,0],[0.198669331,0.980066578,0,0],[0,0,0,0],{AXES}];
"""
STANDING = """GripLoad ldPlate;
MoveJ s0,v200,fine,tStand\\WObj:=wPlate;
ArcLStart s1,v150,sm1,wd1,fine,tStand\\WObj:=wPlate;
ArcLEnd s2,v150,sm1,wd1,fine,tStand\\WObj:=wPlate;"""


def seam(options: str = "", start: str = "p1", end: str = "p2", named: str = "") -> str:
    """A weld from one target to another."""
    return f"""ArcLStart {start},v150,sm1,wd1{options},fine,{TOOL}{named};
ArcLEnd {end},v150,sm1,wd1{options},fine,{TOOL};"""


@dataclass(frozen=True)
class Row:
    """A construct of weld programs, and a program that has it.

    Args:
        key: name of the program. body: of its main procedure. data: declarations and routines before it.
        options: of ``compensate``. why: what is ignored, and why. do: what a programmer does.
    """

    key: str
    construct: str
    body: str
    why: str
    do: str
    data: str = ""
    options: tuple[str, ...] = ()
    ends: str = ""

    @property
    def text(self) -> str:
        """The RAPID module."""
        steps = "".join(f"    {line}\n" for line in self.body.strip().splitlines())
        end = self.ends and "".join(f"  {line}\n" for line in self.ends.strip().splitlines())
        name = "".join(word.title() for word in self.key.split("-"))
        return f"{HEAD % name}{self.data}  PROC main()\n{steps}{end}  ENDPROC\nENDMODULE\n"


PASS = "Offs(p%d,0,4*i,%s)"
ROWS = (
    Row(
        "seam",
        "A seam: `ArcLStart`, `ArcL`, `ArcC`, `ArcLEnd`",
        f"{APPROACH}\n{seam()}\n{LEAVE}",
        "speed, weld data and seam data are copied as they are",
        "nothing",
    ),
    Row(
        "long-seam",
        "A seam of 0.9 m",
        f"{APPROACH}\n{seam(end=FAR)}\n{LEAVE}",
        "between two targets the controller goes straight; where the correction is not straight, a target is added",
        "`--tolerance` decides how many",
    ),
    Row(
        "start-and-end",
        "Ignition, heating, crater filling (`seamdata`), `\\SeamName`",
        f"{APPROACH}\n{seam(named=SEAM_NAME)}\n{LEAVE}",
        "the arm stands still meanwhile; the place of start and end is that of the running arc, with its force",
        "`--force-on arc` where something pushes only while the arc burns",
    ),
    Row(
        "weave",
        "Weaving: `\\Weave`",
        f"{APPROACH}\n{seam(WEAVING)}\n{LEAVE}",
        "the controller adds the weave to the path; the middle of the weave is corrected, its inertia is not counted",
        "nothing",
        data=WEAVE,
    ),
    Row(
        "tracking",
        "Seam tracking: `\\Track` (arc sensor or laser)",
        f"{APPROACH}\n{seam(TRACKING)}\n{LEAVE}",
        "what the sensor adds is not known before the program runs; it works on what is left",
        "correct all the same: the sensor does not help at the start of the seam, nor along it",
        data=f"{WEAVE}  TASK PERS trackdata tr1:=[0,FALSE,0,[0,10,10,0,0,0,0,0,0],[0,0,0,0,0,0,0]];\n",
    ),
    Row(
        "path-correction",
        "Corrections of a sensor of your own: `\\Corr`",
        f"{APPROACH}\nCorrCon c1;\nMoveL p1,v100,fine,{TOOL}\\Corr;\nMoveL p3,v100,fine,{TOOL}\\Corr;\nCorrDiscon c1;",
        "what the sensor adds is not known; no target is added on such lines",
        "nothing",
        data="  VAR corrdescr c1;\n",
    ),
    Row(
        "search",
        "Touch sensing with `SearchL`, and the seam it displaces",
        f"""{APPROACH}
SearchL\\Stop,diTouch,pFound,p1,v20,{TOOL};
peShift.trans:=pFound.trans-p1.trans;
PDispSet peShift;
{seam()}
PDispOff;""",
        "the position found holds the error of the arm already: one more correction would double it",
        "[searches](compensation.md#searches); a seam as a program of its own where both positions were searched",
        data="  VAR robtarget pFound;\n  VAR pose peShift;\n",
    ),
    Row(
        "smartac",
        "Touch sensing with SmarTac: `Search_1D`, `Search_Part`, `Search_Groove`",
        f"{APPROACH}\nSearch_1D peShift,p1,Offs(p1,0,0,-10),v200,{TOOL};\nPDispSet peShift;\n{seam()}\nPDispOff;",
        "what is found holds the error of the arm already, as with `SearchL`",
        "as with `SearchL`",
        data="  PERS pose peShift:=[[0,0,0],[1,0,0,0]];\n",
    ),
    Row(
        "camera",
        "A target from a camera or a laser scanner",
        f"{APPROACH}\npSeen:=fFromCamera();\n{seam('', 'pSeen', 'Offs(pSeen,0,100,0)')}",
        "the target is known only while the program runs",
        "`--run-time where-needed` corrects it [on the controller](runtime.md)",
        data="  VAR robtarget pSeen;\n",
    ),
    Row(
        "operator",
        "A shift that the operator types",
        f'{APPROACH}\nTPReadNum nShift,"Shift in y?";\n{seam("", "Offs(p1,0,nShift,0)", "Offs(p2,0,nShift,0)")}',
        "the target is known only while the program runs",
        "`--run-time where-needed` corrects it [on the controller](runtime.md)",
        data="  VAR num nShift:=0;\n",
    ),
    Row(
        "multipass",
        "Several passes by `Offs` in a loop",
        f"""{APPROACH}
FOR i FROM 0 TO 2 DO
  MoveL {PASS % (1, "60+2*i")},v300,z5,{TOOL};
  ArcLStart {PASS % (1, "2*i")},v150,sm1,wd1,fine,{TOOL};
  ArcLEnd {PASS % (2, "2*i")},v150,sm1,wd1,fine,{TOOL};
  MoveL {PASS % (2, 60)},v300,z5,{TOOL};
ENDFOR
{LEAVE}""",
        "every pass is followed; one correction of the declared target serves all where they agree to half the tolerance",
        "nothing",
    ),
    Row(
        "displaced-pass",
        "A second pass by `PDispSet`",
        f"{APPROACH}\n{seam()}\n{LEAVE}\nPDispSet peLayer;\n{seam()}\nPDispOff;",
        "the displacement that the text states counts",
        "nothing",
        data="  CONST pose peLayer:=[[0,4,3],[1,0,0,0]];\n",
    ),
    Row(
        "replayed-pass",
        "The option MultiPass: `ArcRepL` and its kin",
        f"{APPROACH}\nArcRepL\\Start\\End,p2,v150,sm1,wd1,wv1,fine,{TOOL};\n{LEAVE}",
        "the controller replays the path that the first pass has recorded, sensor and arm included",
        "correct the first pass",
        data=WEAVE,
    ),
    Row(
        "stitches",
        "Stitches and tacks in a loop",
        f"""{APPROACH}
FOR i FROM 0 TO 3 DO
  MoveL Offs(p1,0,80*i,30),v300,z5,{TOOL};
  ArcLStart Offs(p1,0,80*i,0),v150,sm1,wd1,fine,{TOOL};
  ArcLEnd Offs(p1,0,80*i+25,0),v150,sm1,wd1,fine,{TOOL};
  MoveL Offs(p1,0,80*i+25,30),v300,z5,{TOOL};
ENDFOR""",
        "every turn is followed; where turns differ the offset becomes a formula of the index",
        "nothing",
    ),
    Row(
        "taught-object",
        "A work object that this torch has taught",
        f"{APPROACH}\n{seam()}\n{LEAVE}",
        "the frame holds the error of the arm where it was touched: that rigid shift is left out",
        "`--wobj-taught wJig`: [how](commands.md#work-objects-taught-with-this-arm)",
        options=("--wobj-taught", "wJig"),
    ),
    Row(
        "tool-calibration",
        "A tool that the program measures (`MToolTCPCalib`, BullsEye)",
        f"{APPROACH}\nMToolTCPCalib j1,j2,j3,j4,tTorch,nMax,nMean;\n{seam()}",
        "the tool is known only while the program runs",
        "`--taught tTorch` where the file holds what was measured: [taught data](commands.md#taught-data)",
    ),
    Row(
        "tool-calibration-stated",
        "A tool that the program measures, with `--taught tTorch`",
        f"{APPROACH}\nMToolTCPCalib j1,j2,j3,j4,tTorch,nMax,nMean;\n{seam()}",
        "the tool of the file is taken",
        "nothing",
        options=("--taught", "tTorch"),
    ),
    Row(
        "no-load",
        "A torch without its weight: `[0.001,[0,0,0.001],..]`",
        f"{APPROACH}\n{seam()}\n{LEAVE}".replace("tTorch", "tBare"),
        "nothing is corrected for the weight of torch and cables; MOT012 says so",
        "identify the load (`LoadIdentify`) or weigh the torch",
        data="  PERS tooldata tBare:=[TRUE,[[-58.2,-0.4,361.9],[0.965926,0,0.258819,0]],[0.001,[0,0,0.001],[1,0,0,0],0,0,0]];\n",
    ),
    Row(
        "positioner",
        "Work on a positioner, coordinated; nothing describes the positioner",
        COORDINATED,
        "where the work is nobody knows",
        "`--cell FILE`, ten lines, or the controller's backup: [my cell](my-cell.md)",
        data=STATION,
    ),
    Row(
        "positioner-described",
        "Work on a positioner, with `--cell cell.toml`",
        COORDINATED,
        "a rigid table, unless measured poses say how it runs out and leans",
        "nothing",
        data=STATION,
        options=("--cell", "cell.toml"),
    ),
    Row(
        "index-table",
        "A positioner that only indexes, work objects in the world",
        f"ActUnit STN1;\nMoveJ e0,v600,z20,{TOOL};\nDeactUnit STN1;\n{seam()}",
        "whether the axis carries the work is not known",
        "`--cell FILE`; `--free-axes b` where it carries neither arm nor this work",
        data=INDEX,
    ),
    Row(
        "index-table-free",
        "A positioner that only indexes, with `--free-axes b`",
        f"ActUnit STN1;\nMoveJ e0,v600,z20,{TOOL};\nDeactUnit STN1;\n{seam()}",
        "you say that the axis carries nothing that counts",
        "nothing",
        data=INDEX,
        options=("--free-axes", "b"),
    ),
    Row(
        "stationary-torch",
        "A stationary torch, the robot carries the work (`robhold`)",
        STANDING,
        "the calibration of a torch that was on the flange when it was measured",
        "state the work's weight with `GripLoad`",
        data=STAND,
    ),
    Row(
        "two-arms",
        "Synchronised arms (MultiMove): `SyncMoveOn`, `\\ID`",
        f"""SyncMoveOn s1,tlBoth;
MoveJ pPre\\ID:=5,v600,z20,{TOOL};
{seam(start=SYNCHRONISED[0], end=SYNCHRONISED[1])}
SyncMoveOff s2;""",
        "each task is read by itself; no target is added at `\\ID`. On work that another task moves: [my cell](my-cell.md#what-is-not-done)",
        "convert the backup, so that all tasks are read",
        data='  PERS tasks tlBoth{2}:=[["T_ROB1"],["T_ROB2"]];\n  VAR syncident s1;\n  VAR syncident s2;\n',
    ),
    Row(
        "interrupt",
        "An interrupt whose trap sets signals",
        f"CONNECT iGas WITH tGas;\nISignalDI diGas,0,iGas;\n{APPROACH}\n{seam()}\n{LEAVE}",
        "a trap that moves nothing changes no path",
        "nothing",
        data="  VAR intnum iGas;\n  TRAP tGas\n    SetDO doLamp,1;\n  ENDTRAP\n",
    ),
    Row(
        "moving-trap",
        "An interrupt whose trap moves the arm",
        f"CONNECT iGas WITH tClean;\nISignalDI diGas,0,iGas;\n{APPROACH}\n{seam(end=FAR)}\n{LEAVE}",
        "it may come at any moment, so no line is divided",
        "set a target of your own in the middle of long seams",
        data=f"""  VAR intnum iGas;
  TRAP tClean
    StopMove;
    MoveL Offs(p1,0,0,100),v600,fine,{TOOL};
    StartMove;
  ENDTRAP
""",
    ),
    Row(
        "error-handler",
        "An error handler with `RETRY` or `TRYNEXT`",
        f"{APPROACH}\n{seam(end=FAR)}\n{LEAVE}",
        "behind `TRYNEXT` the arm may come from elsewhere, so no line is divided",
        "set a target of your own in the middle of long seams",
        ends="ERROR\n  IF ERRNO=AW_WELD_ERR TRYNEXT;\n  RETRY;",
    ),
    Row(
        "torch-cleaning",
        "Torch cleaning in a module that is not there, joint moves",
        f"{APPROACH}\n{seam()}\n{LEAVE}\nrTorchClean;\nMoveAbsJ [[0,-20,20,0,60,0],{AXES}],v600,fine,tTorch;",
        "what the missing routine writes is taken to be as it was (RAP031); joint moves state no place and stay",
        "`--with FILE` for the missing module, `postproc batch` for a whole task",
    ),
)


def convert(row: Row, folder: Path) -> dict[str, Any]:
    """The document of ``compensate`` for the program of a row."""
    from blocks import run_postproc

    program, document = folder / f"{row.key}.mod", folder / f"{row.key}.json"
    program.write_text(row.text, encoding="utf-8")
    (folder / "cell.toml").write_text(CELL, encoding="utf-8")
    options = [str(folder / option) if option == "cell.toml" else option for option in row.options]
    arguments = ["compensate", str(program), "--robot", ROBOT, "--alone", "-o", str(folder / "out.mod"), "--force"]
    run_postproc([*arguments, "60,-60,-60", *options, "--json"], document)
    result: dict[str, Any] = json.loads(document.read_text("utf-8"))
    return result


def outcome(row: Row, document: dict[str, Any]) -> str:
    """What became of the welds of a program (of its lines, where nothing welds), in words."""
    errors = [found for found in document["diagnostics"] if found["severity"] == "error"]
    if errors:
        code = errors[0]["code"]
        return f"refused: [{code}](diagnostics/{code[:3]}.md)"
    moves = [move for move in document["statements"] if move["instruction"][:4] in ("ArcL", "ArcR", "Move")]
    welds = [move for move in moves if move["instruction"].startswith("Arc")] or moves
    states = {move["status"] for move in welds}
    if states == {"skipped"}:
        return "left alone"
    assert states == {"compensated"}, document
    count = document["added_targets"]
    added = f", {count or 'no'} target{'s' * (count != 1)} added" if "p3" in row.body else ""
    if not document["figures"]:  # what the sensor adds is not known
        return f"corrected{added}"
    figure = document["figures"][0]
    assert figure["after_mm"] <= TOLERANCE, document
    if figure["before_mm"] < 0.1:
        return f"corrected, less than 0.1\u00a0mm{added}"
    return f"corrected, {figure['before_mm']:.1f}\u00a0mm{added}"


def programs_page() -> str:
    """Every program of the table, as it was converted."""
    head = "# The programs behind the table for welders\n\nEach row of [the table](../welding.md) is one of these programs.\n"
    return head + "".join(f"\n## {row.key}\n\n{row.construct}\n\n```rapid\n{row.text}```\n" for row in ROWS)


def rows() -> str:
    """The table of welding.md."""
    head = "| in the program | what happens | what is ignored, and why | what you do |\n|---|---|---|---|\n"
    with tempfile.TemporaryDirectory() as folder:
        return head + "".join(
            f"| [{row.construct}](_generated/welding.md#{row.key}) | {outcome(row, convert(row, Path(folder)))} | {row.why} | {row.do} |\n"
            for row in ROWS
        )
