! A trap stores the path, moves away, cleans and comes back.
MODULE TrapMoves
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR intnum iClean;
  VAR robtarget pWas;
  CONST robtarget pR1:=[[120,140,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pR2:=[[350,160,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pBrush:=[[240,400,160],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    CONNECT iClean WITH tClean;
    ISignalDI\Single,diDirty,1,iClean;
    MoveJ pR1,v800,fine,tTorch\WObj:=wPlate;
    MoveL pR2,v200,fine,tTorch\WObj:=wPlate;
    Set doA;
    MoveL Offs(pR2,0,60,0),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pR1,0,60,0),v200,fine,tTorch\WObj:=wPlate;
    IDelete iClean;
  ENDPROC
  TRAP tClean
    StopMove;
    StorePath;
    pWas:=CRobT(\Tool:=tTorch\WObj:=wPlate);
    MoveJ pBrush,v800,fine,tTorch\WObj:=wPlate;
    PulseDO doBrush;
    MoveL Offs(pWas,0,0,80),v400,z20,tTorch\WObj:=wPlate;
    MoveL pWas,v200,fine,tTorch\WObj:=wPlate;
    RestoPath;
    StartMove;
  ENDTRAP
ENDMODULE
