! Inline targets only, between them a literal inside Offs, one with an operator height.
MODULE LiteralTargets
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nHover:=55;
  PROC main()
    MoveJ [[150,150,150],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v800,z20,tTorch\WObj:=wPlate;
    MoveL [[150,150,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v200,fine,tTorch\WObj:=wPlate;
    MoveL [[300,150,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v200,z1,tTorch\WObj:=wPlate;
    MoveL [[300,300,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs([[300,300,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],0,0,nHover),v400,z20,tTorch\WObj:=wPlate;
    MoveJ Offs([[150,150,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],0,0,110),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
