! PDispOn without ExeP: the displacement is from where the arm stands.
MODULE DispHere
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nJog:=25;
  CONST robtarget pRefA:=[[140,140,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pLine:=[[340,160,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pRefA,nJog,40,0),v800,fine,tTorch\WObj:=wPlate;
    PDispOn pRefA,tTorch\WObj:=wPlate;
    MoveL pRefA,v200,fine,tTorch\WObj:=wPlate;
    MoveL pLine,v200,fine,tTorch\WObj:=wPlate;
    PDispOff;
    MoveL Offs(pLine,0,0,100),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
