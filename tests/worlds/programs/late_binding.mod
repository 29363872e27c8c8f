! The name of the procedure is put together from a string.
MODULE LateBound
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: giStation = 1 2
  VAR num nStation:=1;
  VAR robtarget pUse;
  CONST robtarget pLeft:=[[120,120,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pRight:=[[120,360,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nStation:=GInput(giStation);
    MoveJ [[120,240,220],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v800,z50,tTorch\WObj:=wPlate;
    %"rStation"+NumToStr(nStation,0)%;
    MoveL Offs(pUse,0,0,90),v300,z10,tTorch\WObj:=wPlate;
    MoveL pUse,v100,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pUse,0,0,90),v300,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rStation1()
    pUse:=pLeft;
  ENDPROC
  PROC rStation2()
    pUse:=pRight;
  ENDPROC
ENDMODULE
