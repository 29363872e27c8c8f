! Targets come from a function that calculates them from a corner and two numbers.
MODULE TargetFunction
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nPitchX:=85;
  PERS num nPitchY:=70;
  CONST robtarget pCorner:=[[100,100,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    FOR iRow FROM 0 TO 1 DO
      FOR iCol FROM 0 TO 2 DO
        MoveJ Offs(fCell(iRow,iCol),0,0,80),v800,z20,tTorch\WObj:=wPlate;
        MoveL fCell(iRow,iCol),v200,fine,tTorch\WObj:=wPlate;
        PulseDO doMark;
      ENDFOR
    ENDFOR
    MoveJ Offs(pCorner,0,0,160),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  FUNC robtarget fCell(num nRow,num nCol)
    VAR robtarget pCell;
    pCell:=pCorner;
    pCell.trans.x:=pCell.trans.x+nCol*nPitchX;
    pCell.trans.y:=pCell.trans.y+nRow*nPitchY;
    RETURN pCell;
  ENDFUNC
ENDMODULE
