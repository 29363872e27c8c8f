! A displacement grows with every turn of a loop until an input ends it.
MODULE ConveyorShift
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: diEnd = 0 0 1
  VAR pose peStep:=[[0,0,0],[1,0,0,0]];
  PERS num nTooth:=18.5;
  VAR num nTooths:=0;
  CONST robtarget pTip1:=[[130,130,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pTip2:=[[310,135,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nTooths:=0;
    peStep:=[[0,0,0],[1,0,0,0]];
    WHILE nTooths<4 DO
      PDispSet peStep;
      MoveJ Offs(pTip1,0,0,50),v800,z10,tTorch\WObj:=wPlate;
      MoveL pTip1,v200,fine,tTorch\WObj:=wPlate;
      MoveL pTip2,v200,fine,tTorch\WObj:=wPlate;
      peStep.trans.y:=peStep.trans.y+nTooth;
      nTooths:=nTooths+1;
      IF diEnd=1 nTooths:=99;
    ENDWHILE
    PDispOff;
    MoveJ Offs(pTip1,0,0,120),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
