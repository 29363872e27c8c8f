! Between the ArcL of one seam a routine of another file measures the gap and a variable is set.
MODULE GaugeWelds
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  VAR num nGapNow:=0;
  ! world: writes rGauge = nGapNow
  ! world: nGapNow = -2 .. 2
  CONST robtarget pQa:=[[100,170,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pQb:=[[220,172,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pQc:=[[350,170,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nGapNow:=0;
    MoveJ Offs(pQa,0,0,70),v800,z20,tTorch\WObj:=wPlate;
    rGauge;
    ArcLStart Offs(pQa,0,nGapNow,0),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    ArcL Offs(pQb,0,nGapNow,0),v100,smA,wdA,z1,tTorch\WObj:=wPlate;
    rGauge;
    ArcLEnd Offs(pQc,0,nGapNow,0),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pQc,0,0,70),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
