! A wait that may time out sets a flag; the late way goes round.
MODULE TimeoutBranch
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR bool bLate:=FALSE;
  CONST robtarget pBefore:=[[120,240,140],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pRound:=[[240,400,200],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pAfter:=[[360,240,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pBefore,v800,fine,tTorch\WObj:=wPlate;
    WaitUntil DInput(diClear)=1\MaxTime:=3\TimeFlag:=bLate;
    IF bLate THEN
      MoveJ pRound,v800,z50,tTorch\WObj:=wPlate;
      MoveJ Offs(pAfter,0,0,140),v800,z20,tTorch\WObj:=wPlate;
    ENDIF
    MoveL Offs(pAfter,0,0,60),v300,z5,tTorch\WObj:=wPlate;
    MoveL pAfter,v100,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pAfter,0,0,60),v300,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
