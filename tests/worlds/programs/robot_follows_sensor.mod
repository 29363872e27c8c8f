! Offsets of a sensor of another file at every point of a path, by a function with side effects in this one.
MODULE SensorPath
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR num nAsked:=0;
  VAR pos psRead:=[0,0,0];
  CONST robtarget pPath{4}:=[[[110,150,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[190,155,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[270,165,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[350,180,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  PROC main()
    nAsked:=0;
    MoveJ Offs(pPath{1},0,0,70),v800,z20,tTorch\WObj:=wPlate;
    FOR i FROM 1 TO 4 DO
      MoveL fAt(i),v100,fine,tTorch\WObj:=wPlate;
    ENDFOR
    MoveL Offs(pPath{4},0,0,70),v800,fine,tTorch\WObj:=wPlate;
    SetGO goAsked,nAsked;
  ENDPROC
  FUNC robtarget fAt(num n)
    nAsked:=nAsked+1;
    rReadSensor psRead;
    RETURN Offs(pPath{n},0,psRead.y/10,psRead.z/10);
  ENDFUNC
ENDMODULE
