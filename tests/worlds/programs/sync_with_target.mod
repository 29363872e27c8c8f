! MoveJSync and MoveCSync; their procedures count and change a target.
MODULE SyncTarget
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR robtarget pNext:=[[120,330,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num nPassed:=0;
  CONST robtarget pY1:=[[130,140,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pYm:=[[230,210,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pY2:=[[330,140,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    pNext:=[[120,330,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    nPassed:=0;
    MoveJ pY1,v800,fine,tTorch\WObj:=wPlate;
    MoveCSync pYm,pY2,v200,z10,tTorch\WObj:=wPlate,"rPassed";
    MoveJSync Offs(pY2,0,60,40),v400,z10,tTorch\WObj:=wPlate,"rPassed";
    WaitTime 0.2;
    WaitTime 0.2;
    WaitTime 0.2;
    MoveL pNext,v200,fine,tTorch\WObj:=wPlate;
    SetGO goPassed,nPassed;
    MoveJ pY1,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rPassed()
    nPassed:=nPassed+1;
    pNext:=Offs(pNext,20,0,0);
  ENDPROC
ENDMODULE
