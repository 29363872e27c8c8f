! The other module: its own pGo, nSide, rGo.
MODULE SameLocalB
  LOCAL CONST robtarget pGo:=[[330,330,70],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  LOCAL VAR num nSide:=-30;
  PROC rOther()
    rGo;
    nSide:=-nSide;
    rGo;
  ENDPROC
  LOCAL PROC rGo()
    MoveJ Offs(pGo,0,nSide,90),v800,z20,tTorch\WObj:=wPlate;
    MoveL Offs(pGo,0,nSide,0),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
