! A target that a routine moves on at every call (INOUT).
MODULE StepByStep
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR robtarget pStep;
  CONST robtarget pBegin:=[[120,130,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    pStep:=pBegin;
    MoveJ Offs(pStep,0,0,100),v800,z20,tTorch\WObj:=wPlate;
    FOR i FROM 1 TO 4 DO
      rNext pStep,40+i;
      MoveL pStep,v200,fine,tTorch\WObj:=wPlate;
    ENDFOR
    MoveL Offs(pBegin,0,0,100),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rNext(INOUT robtarget pMove,num nBy)
    pMove.trans.x:=pMove.trans.x+nBy;
    IF pMove.trans.x>300 pMove.trans.y:=pMove.trans.y+35;
  ENDPROC
ENDMODULE
