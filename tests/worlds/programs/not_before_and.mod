! A5: NOT stands before a whole logical term: NOT bA AND bB is NOT (bA AND bB).
MODULE NotAnd
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pLow:=[[150,150,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR bool bA:=TRUE;
  VAR bool bB:=FALSE;
  VAR num nUp:=0;
  PROC main()
    bA:=TRUE;
    bB:=FALSE;
    IF NOT bA AND bB THEN
      nUp:=60;
    ELSE
      nUp:=15;
    ENDIF
    MoveJ pLow,v600,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pLow,100,0,nUp),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pLow,100,120,nUp),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
