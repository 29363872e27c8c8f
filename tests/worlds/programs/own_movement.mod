! The program's own procedure is named like an instruction of an option and wraps a motion.
MODULE OwnMovement
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nExtra:=3.5;
  CONST robtarget pZ1:=[[130,200,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pZ2:=[[330,210,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pZ1,v800,fine,tTorch\WObj:=wPlate;
    MoveLShift pZ2,v200,fine,10;
    MoveLShift Offs(pZ2,0,70,0),v200,fine,-10;
    MoveLShift pZ1,v200,fine,0;
  ENDPROC
  PROC MoveLShift(robtarget pTo,speeddata vHow,zonedata zHow,num nShift)
    MoveL Offs(pTo,nShift,0,nExtra),vHow,zHow,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
