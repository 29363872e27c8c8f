! SingArea\Wrist: the wrist flips along the first seam; the approaches follow points that are touched up.
MODULE FlippedWrist
  PERS tooldata tTorch:=[TRUE,[[12.5,0,374.2],[0.981627,0,0.190809,0]],[5.3,[-12,1,138],[1,0,0,0],0,0,0.04]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  PERS robtarget pA:=[[1826.81,107.22,740.36],[0.317924,-0.007534,0.947755,-0.025055],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pB:=[[1826.81,247.22,740.36],[0.317924,-0.007534,0.947755,-0.025055],[0,1,-2,1],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pC:=[[1856.81,277.22,740.36],[0.317924,-0.007534,0.947755,-0.025055],[0,1,-2,1],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget pD:=[[1826.81,307.22,740.36],[0.317924,-0.007534,0.947755,-0.025055],[0,1,-2,1],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pE:=[[1766.81,167.22,740.36],[0.317924,-0.007534,0.947755,-0.025055],[0,-1,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR num nPass;
  PROC main()
    FOR nPass FROM 0 TO 1 DO
      SingArea\Off;
      MoveJ pE,v800,z20,tTorch;
      MoveL RelTool(pA,0,0,-30),v400,z5,tTorch;
      SingArea\Wrist;
      ArcLStart Offs(pA,0,0,4*nPass),v100,smA,wdA,fine,tTorch;
      ArcL Offs(pB,0,0,4*nPass),v100,smA,wdA,z1,tTorch;
      ArcCEnd pC,pD,v100,smA,wdA,fine,tTorch;
      MoveL RelTool(pD,0,0,-50),v400,z10,tTorch;
      MoveL pE,v400,fine,tTorch;
    ENDFOR
  ENDPROC
ENDMODULE
