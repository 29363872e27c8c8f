! Tool, work object and heights stand in user.sys.
MODULE UserDataMain
  CONST robtarget pU1:=[[120,200,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pU2:=[[350,240,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pU1,0,0,nUserHeight),v800,z20,tTorch\WObj:=wPlate;
    MoveL pU1,vUser,fine,tTorch\WObj:=wPlate;
    MoveL pU2,vUser,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pU2,0,0,nUserHeight),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
