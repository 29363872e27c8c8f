! A record of the program's own holds a target, an approach and a name.
MODULE RecordTargets
  RECORD station
    robtarget place;
    num above;
    string label;
  ENDRECORD
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS station stLeft:=[[[120,140,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],110,"left"];
  PERS station stRight:=[[[120,380,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],90,"right"];
  VAR station stNow;
  PROC main()
    stNow:=stLeft;
    rServe;
    stNow:=stRight;
    rServe;
  ENDPROC
  PROC rServe()
    MoveJ Offs(stNow.place,0,0,stNow.above),v800,z20,tTorch\WObj:=wPlate;
    MoveL stNow.place,v200,fine,tTorch\WObj:=wPlate;
    TPWrite "at "+stNow.label;
    MoveL Offs(stNow.place,0,0,stNow.above),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
