! One routine serves two trays: the work object, the displacement and what the gripper holds differ between its calls.
MODULE TwoTrays
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wLeft:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS wobjdata wRight:=[FALSE,TRUE,"",[[1150,-150,380],[0.965926,0,0,0.258819]],[[0,0,0],[1,0,0,0]]];
  CONST loaddata lPart:=[12,[0,0,80],[1,0,0,0],0,0,0];
  ! world: giPlace = 1 2 3
  CONST robtarget pTray{3}:=[[[100,100,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[200,110,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[330,115,32],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  VAR num n;
  PROC main()
    n:=giPlace;
    Visit wLeft;
    GripLoad lPart;
    Visit wRight;
    GripLoad load0;
    PDispSet [[0,0,25],[1,0,0,0]];
    n:=giPlace;
    Visit wLeft;
    PDispOff;
  ENDPROC
  PROC Visit(PERS wobjdata w)
    MoveJ Offs(pTray{n},0,0,90),v800,z10,tTorch\WObj:=w;
    MoveL pTray{n},v200,fine,tTorch\WObj:=w;
    MoveL Offs(pTray{n},0,0,90),v800,z10,tTorch\WObj:=w;
  ENDPROC
ENDMODULE
