! SetDataVal moves a whole target by a name that comes from an input.
MODULE WrittenByName
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: giWhich = 1 2
  VAR robtarget pSlot1:=[[120,150,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR robtarget pSlot2:=[[320,300,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    pSlot1:=[[120,150,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    pSlot2:=[[320,300,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    SetDataVal "pSlot"+NumToStr(giWhich,0),[[200,220,70],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    MoveJ Offs(pSlot1,0,0,80),v800,z20,tTorch\WObj:=wPlate;
    MoveL pSlot1,v200,fine,tTorch\WObj:=wPlate;
    MoveJ Offs(pSlot2,0,0,80),v800,z20,tTorch\WObj:=wPlate;
    MoveL pSlot2,v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pSlot2,0,0,80),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
