! A7: the height of the approach is the operator's; targets added on the way down must follow both ends.
! world: tolerance = 0.001
! world: nPre = 100 150 180 220
MODULE OperatorApproach
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nPre:=250;
  CONST robtarget pPick:=[[240,220,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pPick,0,0,nPre),v500,fine,tTorch\WObj:=wPlate;
    MoveL pPick,v100,fine,tTorch\WObj:=wPlate;
    SetDO doVac,1;
    MoveL Offs(pPick,0,0,nPre),v300,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
