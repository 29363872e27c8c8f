! CalcRobT makes a target of the joint home position.
MODULE JointsAsTarget
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST jointtarget jHome:=[[-30,20,10,50,90,-120],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR robtarget pCalc;
  CONST robtarget pDown:=[[260,260,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveAbsJ jHome,v800,fine,tTorch;
    pCalc:=CalcRobT(jHome,tTorch\WObj:=wPlate);
    MoveL Offs(pCalc,0,0,-40),v200,fine,tTorch\WObj:=wPlate;
    MoveL pDown,v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pDown,0,0,90),v200,fine,tTorch\WObj:=wPlate;
    MoveAbsJ jHome\NoEOffs,v800,fine,tTorch;
  ENDPROC
ENDMODULE
