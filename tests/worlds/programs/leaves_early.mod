! RETURN in the middle, EXIT at a fault, GOTO out of a TEST.
MODULE LeavesEarly
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: diGone = 0 0 1
  CONST robtarget pE1:=[[130,180,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pE2:=[[320,240,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pE1,v800,fine,tTorch\WObj:=wPlate;
    rPart;
    TEST giWay
    CASE 0,1:
      GOTO way1;
    DEFAULT:
      MoveL Offs(pE2,0,0,60),v200,fine,tTorch\WObj:=wPlate;
    ENDTEST
    MoveL pE2,v200,fine,tTorch\WObj:=wPlate;
  way1:
    MoveL Offs(pE1,0,0,80),v200,fine,tTorch\WObj:=wPlate;
    IF diFault=1 EXIT;
    MoveJ pE1,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rPart()
    MoveL Offs(pE2,0,0,20),v200,fine,tTorch\WObj:=wPlate;
    IF diGone=1 RETURN;
    MoveL pE2,v100,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pE2,0,0,20),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
