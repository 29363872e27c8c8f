! PDispSet from the operator's pose, the same part twice.
MODULE DispSet
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS pose peSecond:=[[0,160,12],[0.9998477,0,0,0.0174524]];
  CONST robtarget pP1:=[[100,100,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pP2:=[[330,110,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    PDispOff;
    rPart;
    PDispSet peSecond;
    rPart;
    PDispOff;
    MoveJ Offs(pP1,0,0,150),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rPart()
    MoveJ Offs(pP1,0,0,100),v800,z20,tTorch\WObj:=wPlate;
    MoveL pP1,v200,fine,tTorch\WObj:=wPlate;
    MoveL pP2,v100,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pP2,0,0,100),v800,z20,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
