! A user function returns a pose; the displacement is set by it.
MODULE FrameFunction
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nTurn:=3.5;
  CONST robtarget pD1:=[[150,150,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pD2:=[[330,160,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    PDispSet fPlace(20,30);
    rDo;
    PDispSet fPlace(30,110);
    rDo;
    PDispOff;
    MoveJ Offs(pD1,0,0,150),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rDo()
    MoveJ Offs(pD1,0,0,60),v800,z20,tTorch\WObj:=wPlate;
    MoveL pD1,v200,fine,tTorch\WObj:=wPlate;
    MoveL pD2,v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pD2,0,0,60),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  FUNC pose fPlace(num nX,num nY)
    VAR pose pePlace;
    pePlace.trans:=[nX,nY,0];
    pePlace.rot:=OrientZYX(nTurn,0,0);
    RETURN pePlace;
  ENDFUNC
ENDMODULE
