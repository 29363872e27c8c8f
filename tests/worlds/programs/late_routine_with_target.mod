! Late binding with a target as an argument; one of the procedures changes it.
MODULE LateTarget
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: giKind = 1 2
  VAR robtarget pWay;
  VAR string sName:="";
  CONST robtarget pOld:=[[160,220,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    pWay:=pOld;
    MoveJ Offs(pOld,0,0,100),v800,z20,tTorch\WObj:=wPlate;
    sName:="rKind"+NumToStr(giKind,0);
    %sName% pWay,18;
    MoveL pWay,v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pOld,100,0,0),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rKind1(INOUT robtarget p,num n)
    p.trans.z:=p.trans.z+n;
  ENDPROC
  PROC rKind2(INOUT robtarget p,num n)
    p:=Offs(p,n,2*n,0);
    MoveL Offs(p,0,0,30),v200,z5,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
