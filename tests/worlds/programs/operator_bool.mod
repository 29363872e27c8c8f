! The operator switches a second pass on by a PERS bool, and its offset by a PERS pos.
MODULE OperatorBool
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  PERS bool bSecond:=TRUE;
  PERS pos psOffset:=[0,3.5,2.5];
  CONST robtarget pI1:=[[110,180,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pI2:=[[350,190,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    rPass [0,0,0];
    IF bSecond rPass psOffset;
    MoveJ Offs(pI1,0,0,160),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rPass(pos psBy)
    MoveJ Offs(pI1,0,0,70),v800,z20,tTorch\WObj:=wPlate;
    ArcLStart Offs(pI1,psBy.x,psBy.y,psBy.z),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    ArcLEnd Offs(pI2,psBy.x,psBy.y,psBy.z),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pI2,0,0,70),v800,z20,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
