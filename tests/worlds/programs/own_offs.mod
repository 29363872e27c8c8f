! A6: the program has its own function Offs, which turns the offset.
MODULE OwnOffs
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  CONST robtarget pMid:=[[200,200,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pEnd:=[[320,260,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ pMid,v600,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pMid,40,0,30),v200,fine,tTorch\WObj:=wPlate;
    MoveL pEnd,v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pEnd,0,50,0),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
  FUNC robtarget Offs(robtarget p,num dx,num dy,num dz)
    VAR robtarget pNew;
    pNew:=p;
    pNew.trans.x:=p.trans.x+dy;
    pNew.trans.y:=p.trans.y+dx;
    pNew.trans.z:=p.trans.z+2*dz;
    RETURN pNew;
  ENDFUNC
ENDMODULE
