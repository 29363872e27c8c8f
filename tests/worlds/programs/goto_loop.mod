! A loop of GOTO, left by an input; the row moves on at every turn.
MODULE GotoLoop
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: diMore = 0 1 1
  VAR num nRow:=0;
  CONST robtarget pRow:=[[110,100,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nRow:=0;
  again:
    MoveJ Offs(pRow,0,nRow*40,90),v800,z20,tTorch\WObj:=wPlate;
    MoveL Offs(pRow,0,nRow*40,0),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pRow,200,nRow*40,0),v100,fine,tTorch\WObj:=wPlate;
    nRow:=nRow+1;
    IF nRow>6 GOTO done;
    IF DInput(diMore)=1 GOTO again;
  done:
    MoveJ Offs(pRow,0,0,200),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
