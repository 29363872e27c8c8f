! A function of another file may write a target where the arm stands: the line that begins there does not follow it.
MODULE UnseenBetween
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS robtarget pW1:=[[90,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pW3:=[[400,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pW5:=[[100,320,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pFixed:=[[90,150,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num nSeen;
  PROC main()
    MoveJ pFixed,v100,fine,tTorch\WObj:=wPlate;
    MoveL pW1,v100,fine,tTorch\WObj:=wPlate;
    nSeen:=Gauge(pW1);
    MoveL pW3,v100,fine,tTorch\WObj:=wPlate;
    MoveL pFixed,v100,fine,tTorch\WObj:=wPlate;
    MoveL pW5,v100,fine,tTorch\WObj:=wPlate;
    nSeen:=MaxRobReorientSpeed();
    MoveL pW3,v100,fine,tTorch\WObj:=wPlate;
    nSeen:=Camera();
    MoveL pFixed,v100,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
