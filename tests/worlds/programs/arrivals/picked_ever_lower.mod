! A routine that no other calls takes each part from a lower place.
MODULE PickedEverLower
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata sm:=[0.5,0.3,[0,0,23,7,0,0,0,0,0],0.2,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.5,[0,0,21,5.8,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.8];
  PERS welddata wd:=[9,0,[0,0,25,8.4,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  CONST robtarget pA:=[[110,100,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pB:=[[510,160,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pC:=[[480,420,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pD:=[[140,380,90],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pE:=[[300,520,120],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pF:=[[160,-150,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num nZ:=60;
  PROC main()
    MoveL pA,v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rUse()
    nZ:=60;
    rPick;
    rPick;
  ENDPROC
  LOCAL PROC rPick()
    MoveL Offs(pC,0,0,nZ),v200,fine,tTorch\WObj:=wPlate;
    MoveL pB,v200,fine,tTorch\WObj:=wPlate;
    nZ:=nZ-20;
  ENDPROC
ENDMODULE
