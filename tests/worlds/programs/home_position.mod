! A home position as a robtarget, driven to four times from different places.
MODULE HomePosition
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pHome:=[[240,60,280],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pOne:=[[120,140,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pTwo:=[[360,380,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pHome,v1000,fine,tTorch\WObj:=wPlate;
    MoveJ pOne,v800,fine,tTorch\WObj:=wPlate;
    MoveJ pHome,v1000,z50,tTorch\WObj:=wPlate;
    MoveJ pTwo,v800,fine,tTorch\WObj:=wPlate;
    MoveJ pHome,v1000,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pOne,0,0,60),v400,fine,tTorch\WObj:=wPlate;
    MoveJ pHome,v1000,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
