! One taught point with approaches by Offs and RelTool, used six times.
MODULE TouchedApproaches
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pHook:=[[260,240,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pHook,-60,0,150),v800,z50,tTorch\WObj:=wPlate;
    MoveL RelTool(pHook,0,0,-80),v300,z10,tTorch\WObj:=wPlate;
    MoveL RelTool(pHook,0,0,-20),v100,z1,tTorch\WObj:=wPlate;
    MoveL pHook,v50,fine,tTorch\WObj:=wPlate;
    SetDO doHook,1;
    MoveL Offs(pHook,0,0,25),v100,z1,tTorch\WObj:=wPlate;
    MoveL Offs(pHook,-60,0,150),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
