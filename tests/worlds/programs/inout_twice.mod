! One variable is handed twice as INOUT: both parameters are the same place.
MODULE InoutTwice
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR num nShift:=0;
  VAR num nLevels{2}:=[10,40];
  CONST robtarget pRef:=[[200,150,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nShift:=5;
    rBoth nShift,nShift;
    MoveJ Offs(pRef,0,0,nShift),v600,fine,tTorch\WObj:=wPlate;
    rBoth nLevels{1},nLevels{2};
    MoveL Offs(pRef,60,0,nLevels{1}),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pRef,60,80,nLevels{2}),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rBoth(INOUT num nFirst,INOUT num nSecond)
    nFirst:=nFirst+10;
    nSecond:=nSecond+nFirst;
    nFirst:=nFirst+nSecond;
  ENDPROC
ENDMODULE
