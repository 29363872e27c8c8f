! A1: a height measured by a routine of another file, a PERS that main sets to zero before.
MODULE MeasuredHeight
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nZ:=0;
  ! world: writes rMeasureHeight = nZ
  ! world: nZ = -20 .. 30
  CONST robtarget pStart:=[[100,80,120],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pWork:=[[220,140,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveAbsJ [[-30,20,10,50,90,-120],[9E9,9E9,9E9,9E9,9E9,9E9]],v1000,fine,tTorch\WObj:=wPlate;
    nZ:=0;
    rMeasureHeight;
    MoveJ Offs(pWork,0,0,150),v800,z20,tTorch\WObj:=wPlate;
    MoveL Offs(pWork,0,0,nZ),v200,fine,tTorch\WObj:=wPlate;
    Set doGrip;
    MoveL Offs(pWork,0,0,100),v400,z10,tTorch\WObj:=wPlate;
    MoveJ pStart,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
