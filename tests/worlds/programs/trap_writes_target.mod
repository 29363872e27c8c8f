! A trap moves the target itself.
MODULE TrapTarget
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR intnum iNew;
  VAR robtarget pFlow:=[[200,150,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pUp:=[[200,150,220],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    CONNECT iNew WITH tNew;
    ITimer 0.5,iNew;
    FOR i FROM 1 TO 3 DO
      MoveJ pUp,v800,fine,tTorch\WObj:=wPlate;
      MoveL Offs(pFlow,0,0,40),v300,z5,tTorch\WObj:=wPlate;
      MoveL pFlow,v100,fine,tTorch\WObj:=wPlate;
      SetGO goCount,i;
    ENDFOR
    IDelete iNew;
  ENDPROC
  TRAP tNew
    pFlow.trans.x:=pFlow.trans.x+9;
    pFlow.trans.y:=180;
  ENDTRAP
ENDMODULE
