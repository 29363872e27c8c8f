! A menu by function keys; every choice has its own motions in its CASE.
MODULE MenuMoves
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR num nKey:=0;
  ! world: nKey = 1 2 3
  CONST robtarget pMenu:=[[200,80,240],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pTest:=[[320,220,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pPark:=[[120,420,120],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    FOR i FROM 1 TO 2 DO
      MoveJ pMenu,v800,fine,tTorch\WObj:=wPlate;
      TPReadFK nKey,"Choose","Test","Park","",stEmpty,stEmpty;
      TEST nKey
      CASE 1:
        MoveL pTest,v200,fine,tTorch\WObj:=wPlate;
        PulseDO doBeep;
        MoveL Offs(pTest,0,0,80),v200,z10,tTorch\WObj:=wPlate;
      CASE 2:
        MoveJ pPark,v800,fine,tTorch\WObj:=wPlate;
        RETURN;
      DEFAULT:
        TPWrite "none";
      ENDTEST
    ENDFOR
  ENDPROC
ENDMODULE
