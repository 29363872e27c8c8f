! The operator types the number of the part; a TEST chooses the target.
MODULE OperatorAnswer
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: nPart = 1 2 3
  VAR num nPart:=0;
  VAR robtarget pPart;
  CONST robtarget pPart1:=[[110,150,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pPart2:=[[240,280,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pPart3:=[[380,150,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pSafe:=[[240,120,250],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pSafe,v800,fine,tTorch\WObj:=wPlate;
    TPErase;
    TPReadNum nPart,"Which part?";
    TEST nPart
    CASE 1:
      pPart:=pPart1;
    CASE 2:
      pPart:=pPart2;
    DEFAULT:
      pPart:=pPart3;
    ENDTEST
    MoveL Offs(pPart,0,0,70),v400,z10,tTorch\WObj:=wPlate;
    MoveL pPart,v100,fine,tTorch\WObj:=wPlate;
    MoveJ pSafe,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
