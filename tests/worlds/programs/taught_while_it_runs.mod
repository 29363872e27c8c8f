! An element is taught while the program runs: what it was says nothing.
MODULE TaughtWhileItRuns
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: giPlace = 1 2 3
  PERS robtarget pSpot{3}:=[[[100,100,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[200,310,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[430,115,32],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  CONST robtarget pOther{3}:=[[[100,150,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[200,350,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[430,155,32],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  VAR num n;
  PROC main()
    n:=giPlace;
    MoveJ pOther{n},v800,fine,tTorch\WObj:=wPlate;
    pSpot{n}:=CRobT(\Tool:=tTorch\WObj:=wPlate);
    MoveL Offs(pOther{n},0,0,120),v800,fine,tTorch\WObj:=wPlate;
    MoveL pSpot{n},v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pSpot{n},0,0,60),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
