! An error handler corrects the target that failed and tries again.
MODULE HandlerTarget
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR robtarget pTry;
  CONST robtarget pNominal:=[[220,200,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    pTry:=pNominal;
    MoveJ Offs(pNominal,0,0,120),v800,fine,tTorch\WObj:=wPlate;
    rInsert;
    MoveL Offs(pTry,0,0,120),v400,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pNominal,0,0,120),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rInsert()
    rPush;
    Set doDone;
  ERROR (ERR_WAIT_MAXTIME)
    MoveL Offs(pTry,0,0,30),v100,fine,tTorch\WObj:=wPlate;
    pTry:=Offs(pTry,1.5,-0.5,0);
    IF pTry.trans.x>pNominal.trans.x+5 TRYNEXT;
    RETRY;
  ENDPROC
  PROC rPush()
    MoveL pTry,v50,fine,tTorch\WObj:=wPlate;
    WaitDI diSeated,1\MaxTime:=1;
  ENDPROC
ENDMODULE
