! Three searches make the object frame in which the seam lies.
MODULE ThreeSearches
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  PERS wobjdata wFound:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR robtarget pHit1;
  VAR robtarget pHit2;
  VAR robtarget pHit3;
  CONST robtarget pOver1:=[[120,120,80],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pOver2:=[[360,120,80],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pOver3:=[[120,330,80],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pBead1:=[[20,40,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pBead2:=[[210,60,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    rProbe pOver1,pHit1;
    rProbe pOver2,pHit2;
    rProbe pOver3,pHit3;
    wFound.oframe:=PoseMult(wPlate.oframe,DefFrame(pHit1,pHit2,pHit3));
    MoveJ Offs(pBead1,0,0,120),v400,z10,tTorch\WObj:=wFound;
    ArcLStart pBead1,v100,smA,wdA,fine,tTorch\WObj:=wFound;
    ArcLEnd pBead2,v100,smA,wdA,fine,tTorch\WObj:=wFound;
    MoveL Offs(pBead2,0,0,120),v400,fine,tTorch\WObj:=wFound;
  ENDPROC
  PROC rProbe(robtarget pFrom,INOUT robtarget pHit)
    MoveJ pFrom,v600,fine,tTorch\WObj:=wPlate;
    SearchL\Stop,diTouch,pHit,Offs(pFrom,0,0,-90),v20,tTorch\WObj:=wPlate;
    MoveL pFrom,v200,fine,tTorch\WObj:=wPlate;
  ERROR
    pHit:=Offs(pFrom,0,0,-60);
    TRYNEXT;
  ENDPROC
ENDMODULE
