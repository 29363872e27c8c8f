! A pallet: the place comes from a group input, places are the elements of a CONST array.
MODULE PalletInput
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: giPlace = 1 2 3 4
  CONST robtarget pPlace{4}:=[[[100,100,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[100,300,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[300,100,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[300,300,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  VAR num nPlace:=1;
  PROC main()
    FOR i FROM 1 TO 3 DO
      WaitUntil giPlace>0;
      nPlace:=giPlace;
      MoveJ Offs(pPlace{nPlace},0,0,120),v800,z20,tTorch\WObj:=wPlate;
      MoveL pPlace{nPlace},v200,fine,tTorch\WObj:=wPlate;
      Reset doVac;
      MoveL Offs(pPlace{nPlace},0,0,120),v400,z20,tTorch\WObj:=wPlate;
    ENDFOR
  ENDPROC
ENDMODULE
