! One ArcL of a seam runs only if an input is set.
MODULE WeldIf
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  CONST robtarget pS1:=[[100,100,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pS2:=[[200,110,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pS3:=[[300,120,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pS1,0,0,80),v600,z20,tTorch\WObj:=wPlate;
    ArcLStart pS1,v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    ArcL pS2,v100,smA,wdA,z1,tTorch\WObj:=wPlate;
    IF diPiece=1 ArcL pS3,v100,smA,wdA,z1,tTorch\WObj:=wPlate;
    ArcLEnd pS3,v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pS3,0,0,80),v600,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
