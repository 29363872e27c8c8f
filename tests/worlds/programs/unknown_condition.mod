! A function of another file decides with what numbers a path is repeated.
MODULE UnknownCondition
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR num nAgainst:=0;
  VAR bool bOk:=FALSE;
  CONST robtarget pRub1:=[[130,170,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pRub2:=[[330,180,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nAgainst:=0;
    bOk:=FALSE;
    MoveJ Offs(pRub1,0,0,80),v800,z20,tTorch\WObj:=wPlate;
    WHILE bOk=FALSE AND nAgainst<3 DO
      MoveL Offs(pRub1,0,0,-nAgainst*0.5),v200,fine,tTorch\WObj:=wPlate;
      MoveL Offs(pRub2,0,0,-nAgainst*0.5),v200,fine,tTorch\WObj:=wPlate;
      nAgainst:=nAgainst+1;
      bOk:=fInspect(nAgainst);
    ENDWHILE
    MoveL Offs(pRub2,0,0,80),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
