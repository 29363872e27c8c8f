! A surface in lines to and fro; the pitch is the operator's, the direction a sign.
MODULE ZigZag
  PERS tooldata tTorch:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wPlate:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS num nPitch:=22.5;
  VAR num nSign:=1;
  CONST robtarget pArea:=[[120,120,50],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    nSign:=1;
    MoveJ Offs(pArea,0,0,80),v800,z20,tTorch\WObj:=wPlate;
    FOR i FROM 0 TO 3 DO
      IF nSign>0 THEN
        MoveL Offs(pArea,0,i*nPitch,0),v200,z1,tTorch\WObj:=wPlate;
        MoveL Offs(pArea,200,i*nPitch,0),v200,z1,tTorch\WObj:=wPlate;
      ELSE
        MoveL Offs(pArea,200,i*nPitch,0),v200,z1,tTorch\WObj:=wPlate;
        MoveL Offs(pArea,0,i*nPitch,0),v200,z1,tTorch\WObj:=wPlate;
      ENDIF
      nSign:=-nSign;
    ENDFOR
    MoveL Offs(pArea,0,3*nPitch,80),v800,fine,tTorch\WObj:=wPlate;
  ENDPROC
ENDMODULE
