! The tool's length is corrected at run time by what a calibration routine of another file measured.
MODULE ToolChanged
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: writes rCheckTip = nWear
  ! world: nWear = -1.5 .. 1.5
  PERS tooldata tGrip:=[TRUE,[[-63.4,0.8,352.6],[0.953717,0,0.300706,0]],[4.1,[-20,0,120],[1,0,0,0],0,0,0]];
  VAR num nWear:=0;
  CONST robtarget pQ1:=[[150,150,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pQ2:=[[330,220,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    rCheckTip;
    tGrip.tframe.trans.z:=352.6+nWear;
    MoveJ Offs(pQ1,0,0,90),v800,z20,tGrip\WObj:=wPlate;
    MoveL pQ1,v200,fine,tGrip\WObj:=wPlate;
    MoveL pQ2,v200,fine,tGrip\WObj:=wPlate;
    MoveL Offs(pQ2,0,0,90),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
