MODULE PaperCase
  ! postproc 0.1.0: compensated for irb4600_60_205
  ! The tolerance of 0.01 mm is kept in the model; on the arm 0.076 to 1.756 mm are expected while the arc burns.
  ! the stiffness of this arm is not measured: with that of its type 5 to 96 % of its own deflection remain
  ! six set-ups of a dial gauge leave about 1 to 8 % of it: `postproc plan irb4600_60_205 -n 6 --kind gauge --load 60 --pull 100 -o gauge.csv`
  ! model: joint_compliance
  ! on the TCP: force 200, -200, -200 N, along the whole program
  ! deviation [mm]  before  after, in the model  tolerance  expected on the arm
  ! weld             1.553                0.006      0.010  0.076 to 1.756
  ! air              2.186                0.001      0.200  0.106 to 2.473
  ! 0 targets added; these lines prevent compensating twice
  ! Load case of the hull-welding study: a seam of about one metre in base coordinates,
  ! a constant force of [200,-200,-200] N on the TCP, elastic joints, a massless tool:
  !   postproc compensate paper_case.mod --force 200,-200,-200 --inertia off
  ! Reachable with the same configurations by irb4600_60_205 and irb4600_60_205_seed.
  PERS tooldata tStudy:=[TRUE,[[0,0,350],[1,0,0,0]],[0.001,[0,0,1],[1,0,0,0],0,0,0]];
  PERS seamdata smStudy:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.3,[0,0,22,6.5,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.5];
  PERS welddata wdStudy:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];

  CONST robtarget pBefore:=[[1290.319,-499.067,800.434],[0.3003925,-0.0160923,0.9523673,0.0500183],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull1:=[[1350.358,-498.966,720.471],[0.3004002,-0.0161195,0.9523642,0.0500233],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull2:=[[1399.819,-373.73,745.048],[0.3004029,-0.0161743,0.9523607,0.0500556],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull3:=[[1420.241,-248.545,768.153],[0.300404,-0.0162173,0.9523581,0.050084],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull4:=[[1399.636,-123.45,788.546],[0.3004006,-0.016244,0.9523575,0.0501081],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull5:=[[1350.016,1.577,805.408],[0.3003959,-0.0162597,0.9523576,0.0501296],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull6:=[[1300.384,126.604,818.486],[0.3003966,-0.0162775,0.9523558,0.0501538],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull7:=[[1279.724,251.699,828.077],[0.3004066,-0.0163109,0.9523503,0.0501871],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull8:=[[1300.018,376.894,835.015],[0.3004238,-0.0163644,0.9523416,0.0502316],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull9:=[[1349.257,502.169,840.524],[0.3004428,-0.016431,0.9523317,0.050284],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pAfter:=[[1289.262,502.011,920.477],[0.3004255,-0.0164075,0.9523376,0.0502832],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

  PROC rStudy()
    MoveJ pBefore,v500,fine,tStudy;
    ArcLStart pHull1,v100,smStudy,wdStudy,fine,tStudy;
    ArcL pHull2,v100,smStudy,wdStudy,z1,tStudy;
    ArcL pHull3,v100,smStudy,wdStudy,z1,tStudy;
    ArcL pHull4,v100,smStudy,wdStudy,z1,tStudy;
    ArcL pHull5,v100,smStudy,wdStudy,z1,tStudy;
    ArcL pHull6,v100,smStudy,wdStudy,z1,tStudy;
    ArcL pHull7,v100,smStudy,wdStudy,z1,tStudy;
    ArcL pHull8,v100,smStudy,wdStudy,z1,tStudy;
    ArcLEnd pHull9,v100,smStudy,wdStudy,fine,tStudy;
    MoveL pAfter,v500,fine,tStudy;
  ENDPROC
ENDMODULE
