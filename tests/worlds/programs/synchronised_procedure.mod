! A3: MoveLSync calls a procedure that changes the depth of a later motion.
MODULE SyncDepth
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR num nLift:=10;
  CONST robtarget pA:=[[120,120,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pB:=[[320,120,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nLift:=10;
    MoveJ pA,v600,fine,tTorch\WObj:=wPlate;
    MoveLSync pB,v200,z10,tTorch\WObj:=wPlate,"rRaise";
    MoveL Offs(pB,0,80,20),v200,fine,tTorch\WObj:=wPlate;
    WaitTime 0.5;
    SetDO doReady,1;
    MoveL Offs(pA,0,0,nLift),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rRaise()
    nLift:=50;
  ENDPROC
ENDMODULE
