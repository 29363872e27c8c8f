! Lines that begin at joint angles and in another work object: both objects and the tool are calibrated anew.
MODULE LineFromHome
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS wobjdata wRack:=[FALSE,TRUE,"",[[1020,-540,400],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  PERS robtarget pW1:=[[90,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pW3:=[[400,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pW5:=[[100,320,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget jHome:=[[-30,10,10,0,60,-140],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    ConfL\Off;
    MoveAbsJ jHome,v100,fine,tTorch\WObj:=wPlate;
    MoveL pW1,v100,fine,tTorch\WObj:=wPlate;
    MoveL pW3,v100,fine,tTorch\WObj:=wPlate;
    MoveL pW5,v100,fine,tTorch\WObj:=wRack;
    MoveL pW1,v100,fine,tTorch\WObj:=wRack;
    rSeen;
    MoveL pW3,v100,fine,tTorch\WObj:=wRack;
    rVision;
    MoveL pW5,v100,fine,tTorch\WObj:=wRack;
  ENDPROC
  PROC rSeen()
    pW1.trans.z:=pW1.trans.z+40;
  ENDPROC
ENDMODULE
