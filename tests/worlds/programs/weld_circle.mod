! A welded half circle between straight seams, with an operator offset to the side of the gap.
MODULE WeldCircle
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  PERS num nGap:=1.4;
  CONST robtarget pK1:=[[110,160,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pK2:=[[220,160,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pKm:=[[280,220,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pK3:=[[220,280,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pK4:=[[110,280,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pK1,0,0,80),v800,z10,tTorch\WObj:=wPlate;
    ArcLStart Offs(pK1,0,nGap/2,0),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    ArcL pK2,v100,smA,wdA,z1,tTorch\WObj:=wPlate;
    ArcC pKm,pK3,v100,smA,wdA,z1,tTorch\WObj:=wPlate;
    ArcLEnd Offs(pK4,0,nGap/2,0),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pK4,0,0,80),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
