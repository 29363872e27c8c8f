! Targets are handed to a routine as parameters, once literally.
MODULE HandedTargets
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pIn:=[[100,200,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pOut:=[[380,260,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    rVisit pIn,80;
    rVisit pOut,120;
    rVisit [[240,360,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],100;
    rVisit Offs(pIn,40,0,0),60;
  ENDPROC
  PROC rVisit(robtarget pGoal,num nUp)
    MoveJ Offs(pGoal,0,0,nUp),v800,z20,tTorch\WObj:=wPlate;
    MoveL pGoal,v200,fine,tTorch\WObj:=wPlate;
    PulseDO doShot;
    MoveL Offs(pGoal,0,0,nUp),v800,z20,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
