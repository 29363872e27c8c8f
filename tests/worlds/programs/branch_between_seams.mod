! Between two seams an input decides over a detour.
MODULE BranchSeams
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  CONST robtarget pA1:=[[100,100,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pA2:=[[300,110,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pB1:=[[300,260,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pB2:=[[100,270,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pClean:=[[420,60,200],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pA1,0,0,80),v800,z20,tTorch\WObj:=wPlate;
    ArcLStart pA1,v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    ArcLEnd pA2,v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pA2,0,0,80),v400,z20,tTorch\WObj:=wPlate;
    IF diDirty=1 THEN
      MoveJ pClean,v800,fine,tTorch\WObj:=wPlate;
      rCleanTorch;
      MoveJ Offs(pA2,0,0,120),v800,z20,tTorch\WObj:=wPlate;
    ENDIF
    MoveJ Offs(pB1,0,0,80),v800,z20,tTorch\WObj:=wPlate;
    ArcLStart pB1,v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    ArcLEnd pB2,v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pB2,0,0,80),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rCleanTorch()
    PulseDO\PLength:=1,doClean;
    WaitTime 1;
  ENDPROC
ENDMODULE
