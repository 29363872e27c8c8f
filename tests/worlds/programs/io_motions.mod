! MoveLDO, MoveJAO and triggers that set signals underway; the value comes from the program.
MODULE IoMotions
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR triggdata trGun;
  VAR num nLevel:=0;
  CONST robtarget pJ1:=[[120,180,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pJ2:=[[340,200,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nLevel:=AInput(aiFlow);
    TriggIO trGun,15\DOp:=doGun,1;
    MoveJAO Offs(pJ1,0,0,70),v800,z20,tTorch\WObj:=wPlate,aoFlow,nLevel;
    MoveL pJ1,v200,fine,tTorch\WObj:=wPlate;
    TriggL pJ2,v200,trGun,fine,tTorch\WObj:=wPlate;
    MoveLDO Offs(pJ2,0,0,nLevel*3),v200,fine,tTorch\WObj:=wPlate,doGun,0;
    MoveL Offs(pJ2,0,0,90),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
