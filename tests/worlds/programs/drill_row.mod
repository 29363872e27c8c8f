! Holes by a chain of RelTool; shifts come as value parameters and go into the object frame.
MODULE DrillRow
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS wobjdata wPart:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST robtarget pHole:=[[140,160,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    rDrill 20,10,0;
    rDrill 130,10,0;
    rDrill 130,140,6;
  ENDPROC
  PROC rDrill(num nX,num nY,num nZ)
    PDispOff;
    nZ:=nZ+0.5;
    wPart.oframe.trans:=[nX,nY,nZ];
    SetAO aoSpindle,nX/100;
    MoveJ RelTool(pHole,0,0,-150),v400,fine,tTorch\WObj:=wPart;
    MoveL RelTool(pHole,0,0,-5),v200,z0,tTorch\WObj:=wPart;
    MoveL pHole,v20,fine,tTorch\WObj:=wPart;
    MoveL RelTool(pHole,0,0,15),v20,fine,tTorch\WObj:=wPart;
    MoveL RelTool(pHole,0,0,-30),v100,z5,tTorch\WObj:=wPart;
    MoveL RelTool(pHole,0,0,-150),v400,fine,tTorch\WObj:=wPart;
  ENDPROC
ENDMODULE
