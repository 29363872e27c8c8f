! TriggL raises an interrupt underway; its trap counts and raises the next layer.
MODULE TriggLayers
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR intnum iMid;
  VAR triggdata trMid;
  VAR num nRaise:=0;
  CONST robtarget pX:=[[100,100,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pY:=[[380,100,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    CONNECT iMid WITH tMid;
    TriggInt trMid,40\Start,iMid;
    nRaise:=0;
    MoveJ pX,v600,fine,tTorch\WObj:=wPlate;
    TriggL pY,v200,trMid,fine,tTorch\WObj:=wPlate;
    WaitTime 0.2;
    WaitTime 0.2;
    WaitTime 0.2;
    MoveL Offs(pX,0,0,nRaise),v200,fine,tTorch\WObj:=wPlate;
    TriggL Offs(pY,0,0,nRaise),v200,trMid,fine,tTorch\WObj:=wPlate;
    IDelete iMid;
  ENDPROC
  TRAP tMid
    nRaise:=nRaise+12;
  ENDTRAP
ENDMODULE
