! ORobT takes the displacement out of a position that was read with it.
MODULE BackTransformed
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR robtarget pWith;
  VAR robtarget pWithout;
  PERS pose peDisp:=[[12,35,6],[1,0,0,0]];
  CONST robtarget pBase:=[[160,180,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    PDispSet peDisp;
    MoveJ pBase,v800,fine,tTorch\WObj:=wPlate;
    pWith:=CRobT(\Tool:=tTorch\WObj:=wPlate);
    pWithout:=ORobT(pWith);
    PDispOff;
    MoveL pWithout,v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pWithout,120,0,0),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pBase,0,0,100),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
