%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%

MODULE HullSeam
  !***************************************************************
  ! Shell plate butt, frame 41 to 43, position PA
  ! IRB 4600-60/2.05, fixed pedestal, plate on the east jig
  !***************************************************************

  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  TASK PERS wobjdata wobjShell:=[FALSE,TRUE,"",[[1284.62,-688.35,585.4],[0.701473,0.065353,0.073846,0.705841]],[[0,0,0],[1,0,0,0]]];

  TASK PERS seamdata smShell:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  TASK PERS welddata wdShell:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  TASK PERS weavedata wvShell:=[1,0,3.2,2.4,0,0.1,0,0.1,0,0,0,0,0,0,0];
  CONST speeddata vApproach:=[250,60,5000,1000];
  VAR num nPlates:=0;

  CONST jointtarget jHome:=[[0,-25,25,0,65,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pAbove:=[[-40,30,226.86],[0.01543,-0.706938,-0.706938,0.01543],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pSeam10:=[[0.51,-0.64,-33.03],[0.01355,-0.706541,-0.707379,0.015207],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pSeam20:=[[178.3,1.88,-18.39],[0.030819,-0.705811,-0.707095,0.02995],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pSeam30:=[[340.83,3.32,-8.73],[0.032395,-0.706005,-0.706804,0.030571],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pSeam40:=[[521.44,4.7,-1.97],[0.044968,-0.704861,-0.70662,0.042852],[-1,-1,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pSeam50:=[[698.15,5.53,0.48],[0.048649,-0.707207,-0.70357,0.049812],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pSeam60:=[[856.38,5.36,-1.71],[0.058624,-0.705927,-0.703427,0.058484],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pSeam70:=[[1036.69,5.14,-8.63],[0.063638,-0.705611,-0.70293,0.062874],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pSeam80:=[[1204.09,3.7,-18.38],[0.076837,-0.704827,-0.701526,0.071954],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pSeam90:=[[1380.05,3.04,-33.19],[0.082347,-0.703604,-0.701204,0.080459],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pClear:=[[1440,42.76,206.86],[0.083107,-0.702206,-0.702206,0.083107],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

  PROC main()
    MoveAbsJ jHome\NoEOffs,v1000,fine,tTorch;
    rShellSeam;
    MoveAbsJ jHome\NoEOffs,v1000,fine,tTorch;
    nPlates:=nPlates+1;
    TPWrite "Plates done: "\Num:=nPlates;
  ENDPROC

  PROC rShellSeam()
    MoveJ pAbove,v800,z50,tTorch\WObj:=wobjShell;
    ! down to the plate, then strike the arc
    MoveL Offs(pSeam10,0,0,40),vApproach,z10,tTorch\WObj:=wobjShell;
    ArcLStart pSeam10,v100,smShell,wdShell\Weave:=wvShell,fine,tTorch\WObj:=wobjShell;
    ArcL pSeam20,v100,smShell,wdShell\Weave:=wvShell,z1,tTorch\WObj:=wobjShell;
    ArcL pSeam30,v100,smShell,wdShell\Weave:=wvShell,z1,tTorch\WObj:=wobjShell;
    ArcL pSeam40,v100,smShell,wdShell\Weave:=wvShell,z1,tTorch\WObj:=wobjShell;
    ArcL pSeam50,v100,smShell,wdShell\Weave:=wvShell,z1,tTorch\WObj:=wobjShell;
    ArcL pSeam60,v100,smShell,wdShell\Weave:=wvShell,z1,tTorch\WObj:=wobjShell;
    ArcL pSeam70,v100,smShell,wdShell\Weave:=wvShell,z1,tTorch\WObj:=wobjShell;
    ArcL pSeam80,v100,smShell,wdShell\Weave:=wvShell,z1,tTorch\WObj:=wobjShell;
    ArcLEnd pSeam90,v100,smShell,wdShell\Weave:=wvShell,fine,tTorch\WObj:=wobjShell;
    MoveL RelTool(pSeam90,0,0,-60),vApproach,z10,tTorch\WObj:=wobjShell;
    MoveL pClear,v500,z50,tTorch\WObj:=wobjShell;
  ENDPROC
ENDMODULE
