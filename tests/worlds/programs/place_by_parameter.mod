! A routine is called with a number that a host has sent; two elements were never taught.
MODULE PlaceByParameter
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: nFromHost = 1 2 3
  PERS robtarget pStack{5}:=[[[100,100,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[200,310,30],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[430,115,32],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[0,0,0],[0,0,0,0],[0,0,0,0],[0,0,0,0,0,0]],[[0,0,0],[0,0,0,0],[0,0,0,0],[0,0,0,0,0,0]]];
  CONST robtarget pWait:=[[300,200,350],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pWait,v1000,fine,tTorch\WObj:=wPlate;
    FOR i FROM 1 TO 3 DO
      Put AskHost(), 12;
    ENDFOR
    MoveJ pWait,v1000,fine,tTorch\WObj:=wPlate;
  ENDPROC
  FUNC num AskHost()
    RETURN giNumber;
  ENDFUNC
  ! world: giNumber = 1 2 3
  PROC Put(num place, num depth)
    MoveL Offs(pStack{place},0,0,90),v800,z10,tTorch\WObj:=wPlate;
    MoveL Offs(pStack{place},0,0,depth),v200,fine,tTorch\WObj:=wPlate;
    Reset doVac;
    MoveL Offs(pStack{place},0,0,90),v800,z10,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
