! Targets of a seam are derived from components of others before they are used.
MODULE DerivedTargets
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  PERS robtarget pSeam1:=[[110,200,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pSeam2:=[[230,205,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pSeam3:=[[350,210,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    rSetup;
    MoveJ Offs(pSeam1,0,-16,50),v800,z20,tTorch\WObj:=wPlate;
    ArcLStart Offs(pSeam1,0,-16,0),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    ArcL pSeam1,v100,smA,wdA,z0,tTorch\WObj:=wPlate;
    ArcL pSeam2,v100,smA,wdA,z1,tTorch\WObj:=wPlate;
    ArcLEnd pSeam3,v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pSeam3,0,0,50),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rSetup()
    pSeam2.trans.x:=(pSeam1.trans.x+pSeam3.trans.x)/2;
    pSeam2.trans.z:=pSeam3.trans.z-3;
  ENDPROC
ENDMODULE
