! TEST by a string from a list of an array of strings.
MODULE ManySides
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: giSide = 1 2 3
  CONST string sSides{3}:=["north","east","south"];
  VAR string sSide:="";
  CONST robtarget pO:=[[240,240,80],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    FOR i FROM 1 TO 2 DO
      sSide:=sSides{giSide};
      TEST sSide
      CASE "north":
        rGo 0,60;
      CASE "east","west":
        rGo 60,0;
      DEFAULT:
        rGo 0,-60;
      ENDTEST
    ENDFOR
    MoveJ pO,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  LOCAL PROC rGo(num nX,num nY)
    MoveJ Offs(pO,nX,nY,60),v800,z20,tTorch\WObj:=wPlate;
    MoveL Offs(pO,nX,nY,-30),v200,fine,tTorch\WObj:=wPlate;
    TPWrite sSide;
  ENDPROC
ENDMODULE
