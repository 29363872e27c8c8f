! The retreat is relative to where the arm stands (CRobT), the pull-off by RelTool.
MODULE RetreatHere
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR robtarget pHere;
  CONST robtarget pSpot:=[[260,180,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pClear:=[[200,100,260],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pSpot,0,0,120),v800,z20,tTorch\WObj:=wPlate;
    MoveL pSpot,v200,fine,tTorch\WObj:=wPlate;
    pHere:=CRobT(\Tool:=tTorch\WObj:=wPlate);
    MoveL RelTool(pHere,0,0,-50),v200,z5,tTorch\WObj:=wPlate;
    MoveL Offs(pHere,0,60,80),v400,fine,tTorch\WObj:=wPlate;
    MoveJ pClear,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
