! The second file: a target and a routine that main calls.
MODULE TwoFilesCell
  CONST robtarget pLower:=[[200,170,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC rCell(robtarget pAt,num nAbove)
    MoveL Offs(pAt,0,0,nAbove),v300,z10,tTorch\WObj:=wPlate;
    MoveL pAt,v100,fine,tTorch\WObj:=wPlate;
    Set doClamp;
    MoveL Offs(pAt,0,0,nAbove),v300,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
