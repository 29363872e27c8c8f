! Optional parameters and switches decide over approach and side.
MODULE OptionalHeights
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nUsual:=90;
  CONST robtarget pL:=[[130,160,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pR:=[[340,320,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    rPlace pL;
    rPlace pR\nHigh:=140;
    rPlace pL\Side\nHigh:=60;
    rBoth pR;
    rBoth pL\nHigh:=75;
  ENDPROC
  PROC rBoth(robtarget pAt\num nHigh)
    rPlace pAt\Side\nHigh?nHigh;
  ENDPROC
  PROC rPlace(robtarget pAt\switch Side\num nHigh)
    VAR num nUp;
    nUp:=nUsual;
    IF Present(nHigh) nUp:=nHigh;
    IF Present(Side) THEN
      MoveJ Offs(pAt,0,45,nUp),v800,z20,tTorch\WObj:=wPlate;
    ELSE
      MoveJ Offs(pAt,0,0,nUp),v800,z20,tTorch\WObj:=wPlate;
    ENDIF
    MoveL pAt,v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pAt,0,0,nUp),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
