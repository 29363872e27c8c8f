! The operator says where to begin; the line goes to the next place of the row, and the number moves on.
MODULE NextOfTheRow
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: giFirst = 1 2 3
  CONST robtarget pRow{5}:=[[[100,100,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[200,110,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[330,115,32],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[400,140,31],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[520,150,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  VAR num n;
  PROC main()
    n:=giFirst;
    MoveJ Offs(pRow{n},0,0,100),v800,fine,tTorch\WObj:=wPlate;
    MoveL pRow{n},v200,fine,tTorch\WObj:=wPlate;
    MoveL pRow{n+1},v200,fine,tTorch\WObj:=wPlate;
    n:=n+2;
    MoveL pRow{n},v200,fine,tTorch\WObj:=wPlate;
    MoveL RelTool(pRow{n},0,0,-60),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
