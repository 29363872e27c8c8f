! A loop over parts without end, left when the operator says so; the first part is measured only.
MODULE RepeatedPart
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: nAgain = 0 1
  VAR num nAgain:=1;
  VAR bool bFirst:=TRUE;
  VAR num nPieces:=0;
  CONST robtarget pH1:=[[140,150,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pH2:=[[330,250,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    bFirst:=TRUE;
    nPieces:=0;
    WHILE TRUE DO
      MoveJ Offs(pH1,0,0,80),v800,z20,tTorch\WObj:=wPlate;
      IF NOT bFirst THEN
        MoveL pH1,v200,fine,tTorch\WObj:=wPlate;
        MoveL pH2,v200,fine,tTorch\WObj:=wPlate;
      ELSE
        MoveL Offs(pH2,0,0,15),v200,fine,tTorch\WObj:=wPlate;
        bFirst:=FALSE;
      ENDIF
      nPieces:=nPieces+1;
      TPReadNum nAgain,"Again?";
      IF nAgain=0 OR nPieces>4 RETURN;
    ENDWHILE
  ENDPROC
ENDMODULE
