! A trap routine changes the offset of the seam while the program runs.
MODULE TrapShift
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  VAR intnum iAdjust;
  VAR num nSide:=0;
  CONST robtarget pA:=[[100,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pB:=[[220,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pC:=[[340,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    IDelete iAdjust;
    CONNECT iAdjust WITH tAdjust;
    ISignalDI diAdjust,1,iAdjust;
    nSide:=0;
    MoveJ Offs(pA,0,0,70),v600,z20,tTorch\WObj:=wPlate;
    ArcLStart Offs(pA,0,nSide,0),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    ArcL Offs(pB,0,nSide,0),v100,smA,wdA,z1,tTorch\WObj:=wPlate;
    ArcLEnd Offs(pC,0,nSide,0),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pC,0,0,70),v600,fine,tTorch\WObj:=wPlate;
    IDelete iAdjust;
  ENDPROC
  TRAP tAdjust
    nSide:=nSide+1.5;
  ENDTRAP
ENDMODULE
