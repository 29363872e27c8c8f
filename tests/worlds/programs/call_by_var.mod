! A2: which procedure sets the depth is decided by CallByVar.
MODULE CallByVarDepth
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: nType = 1 2 3
  PERS num nType:=1;
  VAR num nDepth:=10;
  CONST robtarget pFeed:=[[180,200,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pFeed,0,0,160),v800,z20,tTorch\WObj:=wPlate;
    nDepth:=10;
    CallByVar "rSet",nType;
    MoveL Offs(pFeed,0,0,nDepth),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pFeed,0,0,160),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rSet1()
    nDepth:=50;
  ENDPROC
  PROC rSet2()
    nDepth:=25;
  ENDPROC
  PROC rSet3()
    nDepth:=0;
  ENDPROC
ENDMODULE
