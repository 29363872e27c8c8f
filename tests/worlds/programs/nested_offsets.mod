! Offs in RelTool in Offs, with constants, a literal turn and the operator's number.
MODULE NestedOffsets
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nSide:=17.5;
  CONST num nFixed:=40;
  CONST robtarget pDeep:=[[200,200,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(RelTool(pDeep,0,0,-nFixed),0,0,60),v800,z20,tTorch\WObj:=wPlate;
    MoveL RelTool(Offs(pDeep,nSide,0,0),0,0,-nFixed\Rz:=5),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(RelTool(Offs(pDeep,0,nSide,0),0,0,-10),0,20,0),v200,fine,tTorch\WObj:=wPlate;
    MoveL pDeep,v100,fine,tTorch\WObj:=wPlate;
    MoveL RelTool(pDeep,0,0,-nFixed),v200,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
