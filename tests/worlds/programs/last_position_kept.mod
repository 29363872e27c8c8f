! A PERS target keeps where the last part was put; the next one goes beside it.
MODULE LastKept
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS robtarget pLast:=[[130,140,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pFirst:=[[130,140,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    pLast:=pFirst;
    FOR i FROM 1 TO 4 DO
      MoveJ Offs(pLast,0,0,70),v800,z20,tTorch\WObj:=wPlate;
      MoveL pLast,v200,fine,tTorch\WObj:=wPlate;
      Reset doVac;
      MoveL Offs(pLast,0,0,70),v800,z20,tTorch\WObj:=wPlate;
      IF i MOD 2=0 THEN
        pLast:=Offs(pLast,-90,85,0);
      ELSE
        pLast:=Offs(pLast,90,0,0);
      ENDIF
    ENDFOR
    MoveJ Offs(pFirst,0,0,150),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
