"""Programs of a plate and a torch, for what is written for the function that corrects on the controller."""

from __future__ import annotations

NO_AXES = "[9E9,9E9,9E9,9E9,9E9,9E9]"
HEAD = """MODULE Line
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata sm:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.3,[0,0,22,6.5,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.5];
  PERS welddata wd:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  PERS loaddata lPart:=[12,[0,0,60],[1,0,0,0],0,0,0];
  VAR robtarget pSeen;
  VAR num nSeen;
"""


def target(x: float, y: float, z: float = 50.0) -> str:
    return f"[[{x},{y},{z}],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],{NO_AXES}]"


def program(body: str, data: str = "", more: str = "") -> str:
    points = f"  CONST robtarget p1:={target(120, 150)};\n  CONST robtarget p2:={target(320, 150)};\n{data}"
    return f"{HEAD}{points}  PROC main()\n{body}\n  ENDPROC\n{more}ENDMODULE\n"


def move(goal: str, word: str = "MoveL") -> str:
    return f"    {word} {goal},v200,fine,tTorch\\WObj:=wPlate;\n"


def weld(goal: str, word: str) -> str:
    return f"    {word} {goal},v200,sm,wd,fine,tTorch\\WObj:=wPlate;\n"
