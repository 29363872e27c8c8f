! A routine follows all targets of an array that it is handed, whatever its length.
MODULE ArrayParameter
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pShort{2}:=[[[110,120,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[300,120,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  VAR robtarget pLong{3}:=[[[110,300,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[220,330,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[330,300,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  PROC main()
    rFollow pShort,0;
    rFollow pLong,15;
    pLong{2}:=Offs(pLong{2},0,0,35);
    rFollow pLong,0;
  ENDPROC
  PROC rFollow(robtarget pAll{*},num nUp)
    MoveJ Offs(pAll{1},0,0,nUp+80),v800,z20,tTorch\WObj:=wPlate;
    FOR i FROM 1 TO Dim(pAll,1) DO
      MoveL Offs(pAll{i},0,0,nUp),v200,fine,tTorch\WObj:=wPlate;
    ENDFOR
  ENDPROC
ENDMODULE
