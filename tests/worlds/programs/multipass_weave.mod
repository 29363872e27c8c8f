! Three passes of a seam, each a little higher and to the side.
MODULE MultiPass
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  CONST robtarget pM1:=[[100,160,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pM2:=[[240,165,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pM3:=[[380,160,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    FOR i FROM 0 TO 2 DO
      MoveJ Offs(pM1,0,0,90),v800,z20,tTorch\WObj:=wPlate;
      ArcLStart Offs(pM1,0,(i MOD 2)*4,i*3),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
      ArcL Offs(pM2,0,(i MOD 2)*4,i*3),v100,smA,wdA,z1,tTorch\WObj:=wPlate;
      ArcLEnd Offs(pM3,0,(i MOD 2)*4,i*3),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
      MoveL RelTool(Offs(pM3,0,0,i*3),0,0,-60),v400,z20,tTorch\WObj:=wPlate;
    ENDFOR
  ENDPROC
ENDMODULE
