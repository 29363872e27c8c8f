! The index goes on by a step that an operator sets.
MODULE IndexByStep
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pS{4}:=[[[110,100,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[510,160,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[480,420,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[140,380,90],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  ! world: nStep = 1 2 3
  PERS num nStep:=1;
  VAR num nAt;
  PROC main()
    MoveL pS{3},v200,fine,tTorch\WObj:=wPlate;
    MoveL pS{4},v200,fine,tTorch\WObj:=wPlate;
    nAt:=1;
    MoveL pS{nAt},v200,fine,tTorch\WObj:=wPlate;
    nAt:=nAt+nStep;
    MoveL pS{nAt},v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
