! Types by ALIAS and a record in a record; the operator's part table.
MODULE PartTable
  ALIAS num millimetre;
  RECORD gap
    millimetre side;
    millimetre height;
  ENDRECORD
  RECORD piece
    robtarget first;
    robtarget last;
    gap extra;
  ENDRECORD
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS piece pcTable{2}:=[[[[110,120,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[330,125,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[1.5,0.5]],[[[110,290,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[330,300,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[-2.5,1.5]]];
  VAR piece pcNow;
  PROC main()
    FOR i FROM 1 TO 2 DO
      pcNow:=pcTable{i};
      MoveJ Offs(pcNow.first,0,0,80),v800,z20,tTorch\WObj:=wPlate;
      MoveL Offs(pcNow.first,0,pcNow.extra.side,pcNow.extra.height),v200,fine,tTorch\WObj:=wPlate;
      MoveL Offs(pcNow.last,0,pcNow.extra.side,pcNow.extra.height),v100,fine,tTorch\WObj:=wPlate;
      MoveL Offs(pcNow.last,0,0,80),v800,z20,tTorch\WObj:=wPlate;
    ENDFOR
    MoveJ pcTable{1}.first,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
