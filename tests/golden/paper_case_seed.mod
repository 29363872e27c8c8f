MODULE PaperCase
  ! postproc 0.1.0: compensated for irb4600_60_205_seed
  ! The tolerance of 0.01 mm is kept in the model; on the arm 0.078 to 1.735 mm are expected while the arc burns.
  ! the stiffness of this arm is not measured: with that of its type 5 to 97 % of its own deflection remain
  ! six set-ups of a dial gauge leave about 1 to 8 % of it: `postproc plan irb4600_60_205_seed -n 6 --kind gauge --load 60 --pull 100 -o gauge.csv`
  ! model: joint_compliance
  ! on the TCP: force 200, -200, -200 N, along the whole program
  ! deviation [mm]  before  after, in the model  tolerance  expected on the arm
  ! weld             1.529                0.006      0.010  0.078 to 1.735
  ! air              2.181                0.001      0.200  0.111 to 2.475
  ! 0 targets added; these lines prevent compensating twice
  ! Load case of the hull-welding study: a seam of about one metre in base coordinates,
  ! a constant force of [200,-200,-200] N on the TCP, elastic joints, a massless tool:
  !   postproc compensate paper_case.mod --force 200,-200,-200 --inertia off
  ! Reachable with the same configurations by irb4600_60_205 and irb4600_60_205_seed.
  PERS tooldata tStudy:=[TRUE,[[0,0,350],[1,0,0,0]],[0.001,[0,0,1],[1,0,0,0],0,0,0]];
  PERS seamdata smStudy:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.3,[0,0,22,6.5,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.5];
  PERS welddata wdStudy:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];

  CONST robtarget pBefore:=[[1290.321,-499.064,800.428],[0.3003924,-0.0161035,0.9523671,0.0500199],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull1:=[[1350.36,-498.958,720.469],[0.3004043,-0.0161337,0.9523624,0.0500274],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull2:=[[1399.819,-373.723,745.043],[0.300402,-0.0161886,0.9523606,0.0500592],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull3:=[[1420.239,-248.541,768.145],[0.3003985,-0.0162309,0.9523596,0.0500845],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull4:=[[1399.634,-123.452,788.535],[0.3003925,-0.0162561,0.9523601,0.050103],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull5:=[[1350.018,1.568,805.398],[0.3003888,-0.0162694,0.9523603,0.050117],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull6:=[[1300.394,126.589,818.479],[0.3003958,-0.0162844,0.9523569,0.0501345],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull7:=[[1279.744,251.684,828.077],[0.3004152,-0.0163163,0.9523485,0.0501669],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull8:=[[1300.044,376.886,835.021],[0.300439,-0.0163701,0.9523375,0.050216],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull9:=[[1349.287,502.168,840.533],[0.3004599,-0.0164373,0.9523267,0.0502737],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pAfter:=[[1289.295,502.01,920.487],[0.3004418,-0.01641,0.952333,0.0502714],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

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
