! Late binding to a LOCAL routine of another module by its full name.
MODULE LateModuleMain
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  ! world: giRecipe = 1 2
  VAR robtarget pJob;
  CONST robtarget pDefault:=[[180,180,60],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    pJob:=pDefault;
    MoveJ Offs(pDefault,0,0,90),v800,z20,tTorch\WObj:=wPlate;
    %"Recipe"+NumToStr(giRecipe,0)+":rLoad"%;
    MoveL pJob,v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pJob,80,0,0),v200,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pDefault,0,0,90),v400,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
