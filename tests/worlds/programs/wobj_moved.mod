! The object frame is changed at run time by an analog input.
MODULE WobjMoved
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS wobjdata wJig:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[30,20,0],[1,0,0,0]]];
  CONST robtarget pN1:=[[100,150,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pN2:=[[330,170,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    wJig.oframe.trans.x:=20+AInput(aiStop);
    MoveJ Offs(pN1,0,0,90),v800,z20,tTorch\WObj:=wJig;
    MoveL pN1,v200,fine,tTorch\WObj:=wJig;
    MoveL pN2,v100,fine,tTorch\WObj:=wJig;
    wJig.oframe.trans.y:=wJig.oframe.trans.y+60;
    MoveL pN1,v200,fine,tTorch\WObj:=wJig;
    wJig.oframe.trans:=[30,20,0];
    MoveJ Offs(pN1,0,0,120),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
