! A seam of five taught points, long enough for targets between them.
MODULE TouchedSeam
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  CONST robtarget pW1:=[[90,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pW2:=[[200,160,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pW3:=[[400,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pW4:=[[400,300,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pW5:=[[100,320,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pW1,0,0,90),v800,z20,tTorch\WObj:=wPlate;
    ArcLStart pW1,v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    ArcL pW2,v100,smA,wdA,z1,tTorch\WObj:=wPlate;
    ArcL pW3,v100,smA,wdA,z1,tTorch\WObj:=wPlate;
    ArcL pW4,v100,smA,wdA,z1,tTorch\WObj:=wPlate;
    ArcLEnd pW5,v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    MoveL RelTool(pW5,0,0,-90),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
