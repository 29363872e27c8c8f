! DefDFrame: three points searched against three taught ones displace the work.
MODULE DisplacedPoints
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  VAR robtarget pS1;
  VAR robtarget pS2;
  VAR robtarget pS3;
  CONST robtarget pN1:=[[120,120,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pN2:=[[360,120,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pN3:=[[120,330,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pDraw1:=[[160,160,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pDraw2:=[[320,260,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveJ Offs(pN1,0,0,50),v600,fine,tTorch\WObj:=wPlate;
    SearchL\Stop,diPen,pS1,Offs(pN1,0,0,-30),v20,tTorch\WObj:=wPlate;
    MoveJ Offs(pN2,0,0,50),v600,fine,tTorch\WObj:=wPlate;
    SearchL\Stop,diPen,pS2,Offs(pN2,0,0,-30),v20,tTorch\WObj:=wPlate;
    MoveJ Offs(pN3,0,0,50),v600,fine,tTorch\WObj:=wPlate;
    SearchL\Stop,diPen,pS3,Offs(pN3,0,0,-30),v20,tTorch\WObj:=wPlate;
    MoveJ Offs(pN3,0,0,50),v600,fine,tTorch\WObj:=wPlate;
    PDispSet DefDFrame(pN1,pN2,pN3,pS1,pS2,pS3);
    MoveL Offs(pDraw1,0,0,15),v200,fine,tTorch\WObj:=wPlate;
    MoveL pDraw1,v100,fine,tTorch\WObj:=wPlate;
    MoveL pDraw2,v100,fine,tTorch\WObj:=wPlate;
    MoveL Offs(pDraw2,0,0,40),v200,fine,tTorch\WObj:=wPlate;
    PDispOff;
  ERROR
    IF ERRNO=ERR_WHLSEARCH THEN
      TPWrite "no contact";
      PDispOff;
      MoveJ Offs(pN3,0,0,90),v600,fine,tTorch\WObj:=wPlate;
      RETURN;
    ENDIF
    RAISE;
  ENDPROC
ENDMODULE
