! A callee raises its error to the caller, whose handler moves away and goes on behind the call.
MODULE ErrorAcross
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pGoal:=[[220,240,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pAway:=[[120,120,180],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num nBad:=0;
  PROC main()
    MoveJ pAway,v800,fine,tTorch\WObj:=wPlate;
    FOR i FROM 1 TO 3 DO
      rOne i;
    ENDFOR
    MoveJ pAway,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rOne(num nNumber)
    rFetch nNumber;
    MoveL Offs(pGoal,nNumber*30,0,90),v400,fine,tTorch\WObj:=wPlate;
  ERROR
    nBad:=nBad+1;
    MoveL Offs(pAway,0,nBad*10,0),v400,fine,tTorch\WObj:=wPlate;
    TRYNEXT;
  ENDPROC
  PROC rFetch(num nNumber)
    MoveL Offs(pGoal,nNumber*30,0,60),v400,z5,tTorch\WObj:=wPlate;
    IF diFault=1 RAISE 55;
    MoveL Offs(pGoal,nNumber*30,0,0),v100,fine,tTorch\WObj:=wPlate;
  ERROR
    RAISE;
  ENDPROC
ENDMODULE
