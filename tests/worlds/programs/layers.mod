! Layers of a block, one above the other, with a FOR loop and a run-time height.
MODULE Layers
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nLayerHeight:=6.5;
  PERS num nLayers:=3;
  CONST robtarget pC1:=[[120,120,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pC2:=[[320,120,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pC3:=[[320,280,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pC1,0,0,120),v800,z50,tTorch\WObj:=wPlate;
    FOR iLayer FROM 0 TO nLayers-1 DO
      MoveL Offs(pC1,0,0,iLayer*nLayerHeight),v200,fine,tTorch\WObj:=wPlate;
      SetDO doGlue,1;
      MoveL Offs(pC2,0,0,iLayer*nLayerHeight),v100,z1,tTorch\WObj:=wPlate;
      MoveL Offs(pC3,0,0,iLayer*nLayerHeight),v100,fine,tTorch\WObj:=wPlate;
      SetDO doGlue,0;
      MoveL Offs(pC3,0,0,120),v400,z20,tTorch\WObj:=wPlate;
      MoveJ Offs(pC1,0,0,120),v800,z20,tTorch\WObj:=wPlate;
    ENDFOR
  ENDPROC
ENDMODULE
