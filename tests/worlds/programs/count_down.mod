! FOR with a negative step, DIV and MOD make rows and columns of a count.
MODULE CountDown
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pBox:=[[110,120,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num nLeft:=0;
  PROC main()
    FOR n FROM 5 TO 0 STEP -1 DO
      MoveJ Offs(pBox,(n MOD 3)*95,(n DIV 3)*130,70),v800,z10,tTorch\WObj:=wPlate;
      MoveL Offs(pBox,(n MOD 3)*95,(n DIV 3)*130,0),v200,fine,tTorch\WObj:=wPlate;
      nLeft:=n;
    ENDFOR
    MoveJ Offs(pBox,0,0,150),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
