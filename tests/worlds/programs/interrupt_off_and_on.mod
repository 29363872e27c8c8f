! Interrupts are disabled over a seam and enabled again behind it.
MODULE InterruptOff
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR intnum iTouch;
  VAR num nDown:=0;
  CONST robtarget pV1:=[[120,150,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pV2:=[[340,160,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    CONNECT iTouch WITH tTouch;
    ISignalDI diHand,1,iTouch;
    nDown:=0;
    IDisable;
    MoveJ Offs(pV1,0,0,70),v800,z20,tTorch\WObj:=wPlate;
    MoveL Offs(pV1,0,0,nDown),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pV2,0,0,nDown),v200,fine,tTorch\WObj:=wPlate;
    IEnable;
    SetDO doOpen,1;
    WaitTime 0.1;
    MoveL Offs(pV2,0,40,nDown),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pV1,0,40,nDown),v200,fine,tTorch\WObj:=wPlate;
    ISleep iTouch;
    MoveJ Offs(pV1,0,0,70),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  TRAP tTouch
    nDown:=nDown-2;
    IF nDown<-12 nDown:=-12;
  ENDTRAP
ENDMODULE
