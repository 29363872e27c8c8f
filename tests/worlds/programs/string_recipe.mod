! A recipe that another file receives as text is read piece by piece into numbers.
MODULE StringRecipe
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: frecipe = 12;55; 30;20; 8;90;
  VAR string sRecipe:="";
  VAR string sPiece:="";
  VAR num nAt:=1;
  VAR num nTo:=0;
  VAR num nValue{2}:=[0,0];
  VAR bool bRead:=FALSE;
  CONST robtarget pOrigin:=[[130,140,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    sRecipe:=fRecipe();
    nAt:=1;
    FOR i FROM 1 TO 2 DO
      nTo:=StrFind(sRecipe,nAt,";");
      sPiece:=StrPart(sRecipe,nAt,nTo-nAt);
      bRead:=StrToVal(sPiece,nValue{i});
      nAt:=nTo+1;
    ENDFOR
    MoveJ Offs(pOrigin,0,0,130),v800,z20,tTorch\WObj:=wPlate;
    MoveL Offs(pOrigin,nValue{1},nValue{2},0),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pOrigin,nValue{1}+60,nValue{2},0),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pOrigin,0,0,130),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
