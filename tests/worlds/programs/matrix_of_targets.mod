! A table of targets with two indices, and operator offsets for its columns.
MODULE MatrixTargets
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pGrid{2,3}:=[[[[100,120,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[220,120,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[340,120,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]],[[[100,300,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[220,300,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[340,300,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]]];
  PERS num nColumn{3}:=[0.5,1.5,-0.5];
  PROC main()
    FOR r FROM 1 TO 2 DO
      FOR c FROM 1 TO 3 DO
        MoveJ Offs(pGrid{r,c},nColumn{c},0,70),v800,z10,tTorch\WObj:=wPlate;
        MoveL Offs(pGrid{r,c},nColumn{c},0,0),v200,fine,tTorch\WObj:=wPlate;
      ENDFOR
    ENDFOR
    MoveJ pGrid{1,1},v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
