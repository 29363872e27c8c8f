! A displacement made of two poses by PoseMult, one of them the operator's.
MODULE PoseProduct
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS pose peJig:=[[30,20,5],[1,0,0,0]];
  CONST pose peTurn:=[[0,0,0],[0.9961947,0,0,0.0871557]];
  VAR pose peBoth;
  CONST robtarget pT1:=[[140,120,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pT2:=[[330,130,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    peBoth:=PoseMult(peJig,peTurn);
    MoveJ Offs(pT1,0,0,100),v800,z20,tTorch\WObj:=wPlate;
    PDispSet peBoth;
    MoveL pT1,v200,fine,tTorch\WObj:=wPlate;
    MoveL pT2,v200,fine,tTorch\WObj:=wPlate;
    PDispSet PoseInv(peBoth);
    MoveL pT2,v200,fine,tTorch\WObj:=wPlate;
    PDispOff;
    MoveL Offs(pT2,0,0,100),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
