! A4: a loop counter of tenths counts in single precision.
MODULE FloatLoop
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pFirst:=[[120,150,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num nAt:=0;
  VAR num nShare:=0;
  PROC main()
    MoveJ Offs(pFirst,0,0,80),v600,z20,tTorch\WObj:=wPlate;
    WHILE nShare<1 DO
      nShare:=nShare+0.1;
      nAt:=nAt+10;
    ENDWHILE
    MoveL Offs(pFirst,nAt,0,20),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pFirst,nAt,60,20),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
