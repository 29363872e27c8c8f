! A4 with routine data: a share of tenths decides over the number of strokes and their places.
MODULE LocalTenths
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pBrushIn:=[[120,160,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    VAR num nShare:=0;
    VAR num nPlace:=0;
    WHILE nShare<1 DO
      nShare:=nShare+0.1;
      nPlace:=nPlace+20;
    ENDWHILE
    MoveJ pBrushIn,v800,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pBrushIn,nPlace,0,0),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pBrushIn,nPlace,80,0),v200,fine,tTorch\WObj:=wPlate;
    IF nShare=1 MoveL Offs(pBrushIn,0,80,0),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
