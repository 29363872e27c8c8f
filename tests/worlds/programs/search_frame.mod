! A plate is found by a search; the program displacement carries the seam to it.
MODULE SearchFrame
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  VAR robtarget pHit;
  CONST robtarget pNominal:=[[150,150,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pFrom:=[[150,150,90],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pTo:=[[150,150,-20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pS:=[[120,180,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pE:=[[380,200,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pFrom,v600,fine,tTorch\WObj:=wPlate;
    SearchL\Stop,diTouch,pHit,pTo,v20,tTorch\WObj:=wPlate;
    PDispOn\ExeP:=pHit,pNominal,tTorch\WObj:=wPlate;
    MoveL Offs(pS,0,0,60),v300,z10,tTorch\WObj:=wPlate;
    ArcLStart pS,v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    ArcLEnd pE,v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pE,0,0,60),v300,fine,tTorch\WObj:=wPlate;
    PDispOff;
    MoveJ pFrom,v600,fine,tTorch\WObj:=wPlate;
  ERROR
    IF ERRNO=ERR_WHLSEARCH THEN
      PDispOff;
      MoveL pFrom,v100,fine,tTorch\WObj:=wPlate;
      RETURN;
    ENDIF
  ENDPROC
ENDMODULE
