! A6: the program's own Offs counts in centimetres; a part is run twice under displacements, so that corrections differ.
MODULE OwnOffsDisplaced
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pPa:=[[110,100,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pPb:=[[320,110,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    rRun;
    PDispSet [[0,220,0],[1,0,0,0]];
    rRun;
    PDispSet [[20,120,60],[1,0,0,0]];
    rRun;
    PDispOff;
    MoveJ Offs(pPa,0,0,7),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rRun()
    MoveJ Offs(pPa,0,0,4),v800,z20,tTorch\WObj:=wPlate;
    MoveL pPa,v200,fine,tTorch\WObj:=wPlate;
    MoveL pPb,v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pPb,0,0,4),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  FUNC robtarget Offs(robtarget pOf,num nX,num nY,num nZ)
    pOf.trans.x:=pOf.trans.x+10*nX;
    pOf.trans.y:=pOf.trans.y+10*nY;
    pOf.trans.z:=pOf.trans.z+10*nZ;
    RETURN pOf;
  ENDFUNC
ENDMODULE
