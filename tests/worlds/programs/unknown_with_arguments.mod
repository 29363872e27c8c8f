! A routine of another file gets a variable by name and may change it, and one target.
MODULE UnknownArguments
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR num nDrop:=30;
  VAR robtarget pFound:=[[180,180,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pAbove:=[[180,180,200],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pAbove,v600,fine,tTorch\WObj:=wPlate;
    rLaserProbe nDrop,pFound,5;
    MoveL Offs(pFound,0,0,nDrop),v200,fine,tTorch\WObj:=wPlate;
    MoveL pFound,v50,fine,tTorch\WObj:=wPlate;
    MoveL pAbove,v600,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
