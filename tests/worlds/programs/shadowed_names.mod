! A routine's own data hide the module's of the same names; a loop variable hides both.
MODULE Shadowed
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pX:=[[120,140,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num nUp:=90;
  VAR num k:=7;
  PROC main()
    MoveJ Offs(pX,0,0,nUp),v800,z20,tTorch\WObj:=wPlate;
    rInner;
    MoveL Offs(pX,k,0,nUp),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rInner()
    CONST robtarget pX:=[[320,300,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    VAR num nUp:=40;
    nUp:=nUp+AInput(aiLift);
    MoveL Offs(pX,0,0,nUp),v200,fine,tTorch\WObj:=wPlate;
    FOR k FROM 1 TO 2 DO
      MoveL Offs(pX,0,-30*k,0),v200,fine,tTorch\WObj:=wPlate;
    ENDFOR
    MoveL Offs(pX,0,0,nUp),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
