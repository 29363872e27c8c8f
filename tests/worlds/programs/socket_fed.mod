! A vision computer sends places as text; the program turns them into numbers (StrToVal) and goes there.
MODULE SocketFed
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pBase:=[[100,100,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  ! world: sX = "120" "188.25" "240"
  ! world: sY = "90.5" "150" "310"
  VAR socketdev sckEye;
  VAR string sX:="120";
  VAR string sY:="150";
  VAR num nX;
  VAR num nY;
  VAR bool bRead;
  VAR robtarget pSeen;
  PROC main()
    MoveJ Offs(pBase,0,0,200),v800,fine,tTorch\WObj:=wPlate;
    FOR i FROM 1 TO 3 DO
      SocketReceive sckEye\Str:=sX;
      SocketReceive sckEye\Str:=sY;
      bRead:=StrToVal(sX,nX);
      bRead:=StrToVal(sY,nY);
      pSeen:=pBase;
      pSeen.trans.x:=nX;
      pSeen.trans.y:=nY;
      MoveL Offs(pSeen,0,0,80),v200,z5,tTorch\WObj:=wPlate;
      MoveL pSeen,v100,fine,tTorch\WObj:=wPlate;
      MoveL Offs(pSeen,0,0,80),v200,z5,tTorch\WObj:=wPlate;
    ENDFOR
    MoveL Offs(pBase,0,0,200),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
