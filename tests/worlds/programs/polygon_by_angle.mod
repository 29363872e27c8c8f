! Corners of a polygon from Sin and Cos, with an operator radius.
MODULE Polygon
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nRadius:=65;
  VAR num nAngle:=0;
  CONST robtarget pHub:=[[240,230,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nAngle:=0;
    MoveJ Offs(pHub,nRadius,0,80),v800,z20,tTorch\WObj:=wPlate;
    WHILE nAngle<=360 DO
      MoveL Offs(pHub,nRadius*Cos(nAngle),nRadius*Sin(nAngle),0),v200,z1,tTorch\WObj:=wPlate;
      nAngle:=nAngle+72;
    ENDWHILE
    MoveL Offs(pHub,nRadius,0,80),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
