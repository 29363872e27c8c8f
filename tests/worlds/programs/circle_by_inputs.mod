! A circle in two MoveC; a group input chooses how far it is raised.
MODULE CircleInputs
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: giRaise = 0 5 12
  VAR num nUpper:=0;
  CONST robtarget pC0:=[[160,220,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pC1:=[[230,290,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pC2:=[[300,220,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pC3:=[[230,150,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nUpper:=giRaise;
    MoveJ Offs(pC0,0,0,80),v800,z10,tTorch\WObj:=wPlate;
    MoveL Offs(pC0,0,0,nUpper),v200,fine,tTorch\WObj:=wPlate;
    MoveC Offs(pC1,0,0,nUpper),Offs(pC2,0,0,nUpper),v100,z1,tTorch\WObj:=wPlate;
    MoveC Offs(pC3,0,0,nUpper),Offs(pC0,0,0,nUpper),v100,fine,tTorch\WObj:=wPlate;
    MoveL pC2,v200,fine,tTorch\WObj:=wPlate;
    MoveC pC3,pC0,v100,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pC0,0,0,80),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
