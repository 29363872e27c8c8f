! The same declared target under two tools and two work objects, and handed on.
MODULE TwoTools
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS tooldata tProbe:=[TRUE,[[-60,0,350],[0.953717,0,0.300706,0]],[3.2,[-15,0,110],[1,0,0,0],0,0,0]];
  PERS wobjdata wSide:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[60,90,10],[1,0,0,0]]];
  CONST robtarget pBoth:=[[160,150,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pBoth,v800,fine,tTorch\WObj:=wPlate;
    MoveJ Offs(pBoth,0,0,60),v800,fine,tProbe\WObj:=wPlate;
    MoveL pBoth,v200,fine,tProbe\WObj:=wPlate;
    MoveJ pBoth,v800,fine,tProbe\WObj:=wSide;
    MoveJ Offs(pBoth,0,0,40),v800,fine,tTorch\WObj:=wSide;
    rBack pBoth;
  ENDPROC
  PROC rBack(robtarget pBackTo)
    MoveJ pBackTo,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
