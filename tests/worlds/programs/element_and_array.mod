! INOUT: an element of an array and the whole array at once.
MODULE ElementArray
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR num nLift{3}:=[20,35,50];
  CONST robtarget pBase:=[[140,160,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nLift{1}:=20;
    nLift{2}:=35;
    nLift{3}:=50;
    MoveJ Offs(pBase,0,0,100),v800,z20,tTorch\WObj:=wPlate;
    rMix nLift,nLift{2};
    FOR i FROM 1 TO 3 DO
      MoveL Offs(pBase,i*50,0,nLift{i}),v200,fine,tTorch\WObj:=wPlate;
    ENDFOR
    MoveL Offs(pBase,0,0,nLift{2}),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rMix(INOUT num nAll{*},INOUT num nOne)
    nAll{2}:=5;
    nOne:=nOne+nAll{1};
    nAll{3}:=nOne-10;
  ENDPROC
ENDMODULE
