! A stack is searched from above; the depth found sets the height for the next part.
MODULE SearchStack
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR robtarget pTop;
  PERS num nThick:=14.5;
  CONST robtarget pStack:=[[180,220,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pBench:=[[350,180,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pStack,0,0,150),v800,fine,tTorch\WObj:=wPlate;
    SearchL\Stop,diVac,pTop,pStack,v40,tTorch\WObj:=wPlate;
    FOR i FROM 0 TO 1 DO
      MoveL Offs(pTop,0,0,20-i*nThick),v200,fine,tTorch\WObj:=wPlate;
      MoveL Offs(pTop,0,0,-i*nThick),v50,fine,tTorch\WObj:=wPlate;
      Set doVac;
      MoveL Offs(pStack,0,0,150),v400,z20,tTorch\WObj:=wPlate;
      MoveJ Offs(pBench,0,0,80),v800,z20,tTorch\WObj:=wPlate;
      MoveL Offs(pBench,0,0,i*nThick),v200,fine,tTorch\WObj:=wPlate;
      Reset doVac;
      MoveL Offs(pBench,0,0,80),v800,z20,tTorch\WObj:=wPlate;
      MoveJ Offs(pStack,0,0,150),v800,fine,tTorch\WObj:=wPlate;
    ENDFOR
  ERROR
    pTop:=Offs(pStack,0,0,5);
    TRYNEXT;
  ENDPROC
ENDMODULE
