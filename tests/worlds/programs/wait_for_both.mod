! Speeds and zones that change at run time beside constant targets.
MODULE SpeedsAndZones
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR speeddata vNow:=[200,100,1000,1000];
  PERS num nPercent:=80;
  CONST robtarget pF1:=[[120,160,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pF2:=[[340,180,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    vNow.v_tcp:=4*nPercent;
    MoveJ pF1,v800,fine,tTorch\WObj:=wPlate;
    MoveL pF2,vNow,fine,tTorch\WObj:=wPlate;
    VelSet nPercent,2000;
    MoveL pF1,v200,z10,tTorch\WObj:=wPlate;
    MoveL Offs(pF1,0,90,0),v200\V:=300,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pF2,0,90,0),v200\T:=4,fine,tTorch\WObj:=wPlate;
    VelSet 100,5000;
    MoveJ pF1,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
