! Two files of one task: routines and targets of the other module.
MODULE TwoFilesMain
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nOver:=75;
  CONST robtarget pEntry:=[[140,120,160],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pEntry,v800,z20,tTorch\WObj:=wPlate;
    rCell pLower,nOver;
    rCell Offs(pLower,0,140,0),nOver+20;
    MoveJ pEntry,v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
