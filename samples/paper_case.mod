MODULE PaperCase
  ! Load case of the hull-welding study: a seam of about one metre in base coordinates,
  ! a constant force of [200,-200,-200] N on the TCP, elastic joints, a massless tool:
  !   postproc compensate paper_case.mod --force 200,-200,-200 --inertia off
  ! Reachable with the same configurations by irb4600_60_205 and irb4600_60_205_seed.
  PERS tooldata tStudy:=[TRUE,[[0,0,350],[1,0,0,0]],[0.001,[0,0,1],[1,0,0,0],0,0,0]];
  PERS seamdata smStudy:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.3,[0,0,22,6.5,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.5];
  PERS welddata wdStudy:=[9,0,[0,0,26,9,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];

  CONST robtarget pBefore:=[[1290,-500,800],[0.300294,-0.015738,0.95241,0.049914],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull1:=[[1350,-500,720],[0.300294,-0.015738,0.95241,0.049914],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull2:=[[1399.5,-375,744.57],[0.300294,-0.015738,0.95241,0.049914],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull3:=[[1420,-250,767.68],[0.300294,-0.015738,0.95241,0.049914],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull4:=[[1399.5,-125,788.1],[0.300294,-0.015738,0.95241,0.049914],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull5:=[[1350,0,805],[0.300294,-0.015738,0.95241,0.049914],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull6:=[[1300.5,125,818.1],[0.300294,-0.015738,0.95241,0.049914],[0,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull7:=[[1280,250,827.68],[0.300294,-0.015738,0.95241,0.049914],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull8:=[[1300.5,375,834.57],[0.300294,-0.015738,0.95241,0.049914],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHull9:=[[1350,500,840],[0.300294,-0.015738,0.95241,0.049914],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pAfter:=[[1290,500,920],[0.300294,-0.015738,0.95241,0.049914],[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

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
