! dnum counts beyond single precision; its remainder chooses the slot.
MODULE DoubleNumbers
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS dnum dSerial:=16777217;
  ! world: dSerial = 16777217 16777218 16777219
  VAR num nSlot:=0;
  CONST robtarget pRack:=[[120,150,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    dSerial:=dSerial+1;
    nSlot:=DnumToNum(dSerial-16777217);
    MoveJ Offs(pRack,0,0,90),v800,z20,tTorch\WObj:=wPlate;
    MoveL Offs(pRack,nSlot*55,0,0),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pRack,nSlot*55,90,0),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
