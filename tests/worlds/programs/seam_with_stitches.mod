! Stitch welding: the length of stitches and gaps is the operator's, the number is calculated.
MODULE Stitches
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  PERS num nStitch:=40;
  PERS num nSkip:=25;
  VAR num nAlong:=0;
  CONST robtarget pBar:=[[100,160,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nAlong:=0;
    MoveJ Offs(pBar,0,0,60),v800,z20,tTorch\WObj:=wPlate;
    WHILE nAlong+nStitch<=260 DO
      MoveL Offs(pBar,nAlong,0,10),v200,z1,tTorch\WObj:=wPlate;
      ArcLStart Offs(pBar,nAlong,0,0),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
      ArcLEnd Offs(pBar,nAlong+nStitch,0,0),v100,smA,wdA,fine,tTorch\WObj:=wPlate;
      MoveL Offs(pBar,nAlong+nStitch,0,10),v200,z1,tTorch\WObj:=wPlate;
      nAlong:=nAlong+nStitch+nSkip;
    ENDWHILE
    MoveL Offs(pBar,nAlong-nSkip,0,60),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
