! A6 with parameters: the program's own Offs stands in another module; targets are handed to a routine.
MODULE OwnOffsMain
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pG1:=[[140,150,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pG2:=[[320,280,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    rTouch pG1,30;
    rTouch pG2,55;
    rTouch pG1,70;
  ENDPROC
  PROC rTouch(robtarget pAt,num nUp)
    MoveJ Offs(pAt,0,0,nUp),v800,fine,tTorch\WObj:=wPlate;
    MoveL pAt,v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pAt,10,0,nUp),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
