! A station chosen by an input sets the work object by a whole assignment.
MODULE TwoStations
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS wobjdata wA:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS wobjdata wB:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[35,160,0],[0.9998477,0,0,0.0174524]]];
  PERS wobjdata wNow:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pSt1:=[[120,110,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pSt2:=[[320,120,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    FOR i FROM 1 TO 2 DO
      IF diStationB=1 THEN
        wNow:=wB;
      ELSE
        wNow:=wA;
      ENDIF
      MoveJ Offs(pSt1,0,0,80),v800,z20,tTorch\WObj:=wNow;
      MoveL pSt1,v200,fine,tTorch\WObj:=wNow;
      MoveL pSt2,v200,fine,tTorch\WObj:=wNow;
      MoveL Offs(pSt2,0,0,80),v800,fine,tTorch\WObj:=wNow;
    ENDFOR
  ENDPROC
ENDMODULE
