! A state machine of a palletizer: box, layer and rotation by counters, a finished layer changes the pattern.
MODULE Palletizer
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nBoxX:=110;
  PERS num nBoxY:=90;
  PERS num nBoxZ:=45;
  VAR num nState:=0;
  VAR num nBox:=0;
  VAR num nLayer:=0;
  VAR robtarget pDrop;
  CONST robtarget pFetch:=[[110,420,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pPallet:=[[150,120,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nState:=10;
    nBox:=0;
    nLayer:=0;
    WHILE nState<>99 DO
      TEST nState
      CASE 10:
        MoveJ Offs(pFetch,0,0,130),v800,z20,tTorch\WObj:=wPlate;
        MoveL pFetch,v200,fine,tTorch\WObj:=wPlate;
        Set doGrip;
        MoveL Offs(pFetch,0,0,130),v800,z20,tTorch\WObj:=wPlate;
        nState:=20;
      CASE 20:
        pDrop:=Offs(pPallet,(nBox MOD 2)*nBoxX,(nBox DIV 2)*nBoxY,nLayer*nBoxZ);
        IF nLayer MOD 2=1 pDrop:=RelTool(pDrop,0,0,0\Rz:=4);
        MoveJ Offs(pDrop,0,0,100),v800,z20,tTorch\WObj:=wPlate;
        MoveL pDrop,v200,fine,tTorch\WObj:=wPlate;
        Reset doGrip;
        MoveL Offs(pDrop,0,0,100),v800,z20,tTorch\WObj:=wPlate;
        nBox:=nBox+1;
        IF nBox>=3 THEN
          nBox:=0;
          nLayer:=nLayer+1;
        ENDIF
        nState:=10;
        IF nLayer>=2 nState:=99;
      ENDTEST
    ENDWHILE
  ENDPROC
ENDMODULE
