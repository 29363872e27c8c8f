! Tool and work object are handed over; the same target under two work objects.
MODULE HandedFrames
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS wobjdata wLeft:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS wobjdata wRight:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[40,150,0],[0.9990482,0,0,0.0436194]]];
  CONST robtarget pPost:=[[120,120,40],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    rPost wLeft,60;
    rPost wRight,90;
    MoveJ Offs(pPost,0,0,200),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
  PROC rPost(PERS wobjdata wAt,num nUp)
    MoveJ Offs(pPost,0,0,nUp),v800,z20,tTorch\WObj:=wAt;
    MoveL pPost,v200,fine,tTorch\WObj:=wAt;
    MoveL Offs(pPost,180,0,0),v200,fine,tTorch\WObj:=wAt;
    MoveL Offs(pPost,180,0,nUp),v800,fine,tTorch\WObj:=wAt;
  ENDPROC
ENDMODULE
