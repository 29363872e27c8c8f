! The error handler of a waiting routine moves back and tries again.
MODULE HandlerMoves
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pWait:=[[150,250,120],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pTake:=[[260,250,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num nTries:=0;
  PROC main()
    nTries:=0;
    MoveJ pWait,v800,fine,tTorch\WObj:=wPlate;
    rTake;
    MoveJ pWait,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rTake()
    MoveL Offs(pTake,0,0,60),v300,fine,tTorch\WObj:=wPlate;
    WaitDI diPart,1\MaxTime:=2;
    MoveL pTake,v100,fine,tTorch\WObj:=wPlate;
    SetDO doVac,1;
    MoveL Offs(pTake,0,0,60),v300,fine,tTorch\WObj:=wPlate;
  ERROR
    IF ERRNO=ERR_WAIT_MAXTIME THEN
      nTries:=nTries+1;
      MoveL pWait,v300,fine,tTorch\WObj:=wPlate;
      IF nTries<4 THEN
        MoveL Offs(pTake,0,0,60+5*nTries),v300,fine,tTorch\WObj:=wPlate;
        RETRY;
      ENDIF
      TRYNEXT;
    ENDIF
    RAISE;
  ENDPROC
ENDMODULE
