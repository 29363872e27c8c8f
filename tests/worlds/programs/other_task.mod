! A PERS height is written by another task while this one runs.
MODULE OtherTask
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nConveyor:=15;
  ! world: task nConveyor = 0 .. 40
  CONST robtarget pOn:=[[130,150,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pOff:=[[340,320,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    FOR i FROM 1 TO 2 DO
      MoveJ Offs(pOn,0,0,120),v800,z20,tTorch\WObj:=wPlate;
      MoveL Offs(pOn,0,0,nConveyor),v200,fine,tTorch\WObj:=wPlate;
      Set doVac;
      MoveL Offs(pOn,0,0,120),v400,z20,tTorch\WObj:=wPlate;
      MoveL Offs(pOff,nConveyor,0,0),v400,fine,tTorch\WObj:=wPlate;
      Reset doVac;
    ENDFOR
  ENDPROC
ENDMODULE
