! The target is what a camera function of another file returns.
MODULE VisionTarget
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: fcamera = 1 2
  VAR robtarget pSeen;
  VAR num nGrip:=0;
  CONST robtarget pLook:=[[220,220,240],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pDrop:=[[380,110,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pLook,v800,fine,tTorch\WObj:=wPlate;
    pSeen:=fLocate(pLook);
    nGrip:=fGripDepth();
    MoveJ Offs(pSeen,0,0,40),v400,z10,tTorch\WObj:=wPlate;
    MoveL Offs(pSeen,0,0,nGrip),v100,fine,tTorch\WObj:=wPlate;
    Set doVac;
    MoveL Offs(pSeen,0,0,60),v400,z10,tTorch\WObj:=wPlate;
    MoveJ Offs(pDrop,0,0,80),v800,z10,tTorch\WObj:=wPlate;
    MoveL Offs(pDrop,0,0,nGrip),v200,fine,tTorch\WObj:=wPlate;
    Reset doVac;
    MoveL Offs(pDrop,0,0,80),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
