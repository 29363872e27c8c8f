! Two modules with a LOCAL rLoad each.
MODULE Recipe1
  LOCAL PROC rLoad()
    pJob:=Offs(pDefault,30,40,0);
  ENDPROC
ENDMODULE
MODULE Recipe2
  LOCAL CONST robtarget pOther:=[[330,320,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  LOCAL PROC rLoad()
    pJob:=pOther;
  ENDPROC
ENDMODULE
