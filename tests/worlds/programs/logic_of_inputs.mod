! A5 with inputs: NOT, AND, OR, XOR without parentheses decide over a side.
MODULE LogicInputs
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR bool bOpen:=FALSE;
  VAR bool bFull:=FALSE;
  VAR num nSideways:=0;
  CONST robtarget pGate:=[[200,200,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    FOR i FROM 1 TO 3 DO
      bOpen:=DInput(diOpen)=1;
      bFull:=DInput(diFull)=1;
      nSideways:=0;
      IF NOT bOpen AND bFull nSideways:=nSideways+40;
      IF bOpen OR bFull AND i=2 nSideways:=nSideways+20;
      IF bOpen XOR bFull nSideways:=nSideways-15;
      MoveJ Offs(pGate,0,0,90),v800,z10,tTorch\WObj:=wPlate;
      MoveL Offs(pGate,nSideways,0,0),v200,fine,tTorch\WObj:=wPlate;
    ENDFOR
  ENDPROC
ENDMODULE
