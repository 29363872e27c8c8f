! WHILE an input is on, with a counter that ends it at the latest.
MODULE WhileInput
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: diRun = 0 1 1 1
  VAR num nTurns:=0;
  CONST robtarget pWa:=[[140,140,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pWb:=[[330,300,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nTurns:=0;
    MoveJ pWa,v800,fine,tTorch\WObj:=wPlate;
    WHILE diRun=1 AND nTurns<4 DO
      MoveL Offs(pWb,0,0,nTurns*6),v300,fine,tTorch\WObj:=wPlate;
      MoveL Offs(pWa,0,0,nTurns*6),v300,fine,tTorch\WObj:=wPlate;
      Incr nTurns;
    ENDWHILE
    MoveJ Offs(pWa,0,0,110),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
