! Targets come from a function that counts and sets a signal: it must run as often as before.
MODULE FunctionEffects
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR num nCalls:=0;
  CONST robtarget pLineA:=[[120,140,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nCalls:=0;
    MoveJ Offs(pLineA,0,0,80),v800,z20,tTorch\WObj:=wPlate;
    MoveL fNext(),v200,fine,tTorch\WObj:=wPlate;
    MoveL fNext(),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(fNext(),0,0,20),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pLineA,nCalls*10,0,80),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
  FUNC robtarget fNext()
    nCalls:=nCalls+1;
    PulseDO doStep;
    RETURN Offs(pLineA,nCalls*70,0,0);
  ENDFUNC
ENDMODULE
