! A component of a PERS target is changed for some motions and set back.
MODULE ComponentBack
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS robtarget pSlot:=[[220,200,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num nKeep:=0;
  PROC main()
    nKeep:=pSlot.trans.z;
    MoveJ Offs(pSlot,0,0,120),v800,z20,tTorch\WObj:=wPlate;
    pSlot.trans.z:=nKeep+30;
    MoveL pSlot,v200,fine,tTorch\WObj:=wPlate;
    pSlot.trans.z:=nKeep;
    MoveL pSlot,v100,fine,tTorch\WObj:=wPlate;
    SetDO doSlot,1;
    MoveL Offs(pSlot,0,0,120),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
