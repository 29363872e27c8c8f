! Two modules have LOCAL data and routines of the same names.
MODULE SameLocalA
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  LOCAL CONST robtarget pGo:=[[130,130,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  LOCAL VAR num nSide:=20;
  PROC main()
    rGo;
    rOther;
    rGo;
  ENDPROC
  LOCAL PROC rGo()
    MoveJ Offs(pGo,0,0,100),v800,z20,tTorch\WObj:=wPlate;
    MoveL Offs(pGo,0,nSide,0),v200,fine,tTorch\WObj:=wPlate;
    nSide:=nSide+10;
  ENDPROC
ENDMODULE
