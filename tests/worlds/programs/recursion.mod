! A routine calls itself for each smaller square of a nest.
MODULE Recursion
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pCentre:=[[240,240,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pCentre,0,0,120),v800,z20,tTorch\WObj:=wPlate;
    rSquare 120;
    MoveJ Offs(pCentre,0,0,120),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rSquare(num nHalf)
    IF nHalf<40 RETURN;
    MoveL Offs(pCentre,-nHalf,-nHalf,0),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pCentre,nHalf,-nHalf,0),v200,z1,tTorch\WObj:=wPlate;
    MoveL Offs(pCentre,nHalf,nHalf,0),v200,z1,tTorch\WObj:=wPlate;
    MoveL Offs(pCentre,-nHalf,nHalf,0),v200,z1,tTorch\WObj:=wPlate;
    MoveL Offs(pCentre,-nHalf,-nHalf,0),v200,fine,tTorch\WObj:=wPlate;
    rSquare nHalf-45;
  ENDPROC
ENDMODULE
