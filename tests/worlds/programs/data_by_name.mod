! SetDataVal writes a height whose name is put together, GetDataVal reads a target by name.
MODULE DataByName
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: giLine = 1 2
  VAR num nHigh1:=40;
  VAR num nHigh2:=70;
  VAR num nUse:=0;
  VAR robtarget pUse;
  CONST robtarget pLine1:=[[120,150,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pLine2:=[[120,330,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    SetDataVal "nHigh"+ValToStr(giLine),95;
    FOR i FROM 1 TO 2 DO
      GetDataVal "pLine"+NumToStr(i,0),pUse;
      GetDataVal "nHigh"+NumToStr(i,0),nUse;
      MoveJ Offs(pUse,0,0,nUse),v800,z10,tTorch\WObj:=wPlate;
      MoveL Offs(pUse,150,0,nHigh1),v200,fine,tTorch\WObj:=wPlate;
    ENDFOR
    MoveL Offs(pLine1,0,0,nHigh1),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pLine2,0,0,nHigh2),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
