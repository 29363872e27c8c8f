! A7 with both ends of the operator's: targets added between must follow either of them.
! world: tolerance = 0.001
MODULE BothEnds
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nFrom:=120;
  ! world: nFrom = 60 120 200
  PERS num nUpTo:=150;
  ! world: nUpTo = 90 150 210
  CONST robtarget pBody:=[[120,150,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pBody,0,0,nFrom),v800,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pBody,200,nUpTo,30),v200,fine,tTorch\WObj:=wPlate;
    MoveL RelTool(pBody,0,0,-nFrom),v200,fine,tTorch\WObj:=wPlate;
    MoveL pBody,v100,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
