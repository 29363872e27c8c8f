! A trap moves a point that a line begins at: where the arm stands is not what the point says by then.
MODULE TrapMovesStart
  PERS tooldata tT:=[TRUE,[[-63.4,0.8,372.6],[0.953717,0,0.300706,0]],[5.6,[-21.5,0,131],[1,0,0,0],0.038,0.041,0.009]];
  PERS wobjdata wP:=[FALSE,TRUE,"",[[1000,-550,400],[1,0,0,0]],[[20,10,0],[1,0,0,0]]];
  PERS wobjdata wQ:=[FALSE,TRUE,"",[[1020,-530,410],[1,0,0,0]],[[0,0,0],[0.9998477,0,0,0.0174524]]];
  PERS seamdata smA:=[0.3,0.2,[0,0,24,8,0,0,0,0,0],0.15,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.4,[0,0,22,6.5,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.6];
  PERS welddata wdA:=[7.5,0,[0,0,26.5,9.2,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  PERS robtarget p1:=[[90,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget p2:=[[250,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget p3:=[[400,150,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget p4:=[[400,300,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget p5:=[[250,310,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS robtarget p6:=[[100,320,10],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR intnum i1;
  PERS robtarget pM:=[[120,240,20],[0.158241,-0.60035,0.754504,0.212751],[-1,0,-2,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    CONNECT i1 WITH t;
    ITimer 1,i1;
    MoveJ p1,v500,z10,tT\WObj:=wP;
    MoveL pM,v100,fine,tT\WObj:=wP;
    MoveL p3,v100,fine,tT\WObj:=wP;
    ArcLStart pM,v100,smA,wdA,fine,tT\WObj:=wP;
    ArcLEnd p4,v100,smA,wdA,fine,tT\WObj:=wP;
    IDelete i1;
    MoveL pM,v100,fine,tT\WObj:=wP;
    MoveL p6,v100,fine,tT\WObj:=wP;
  ENDPROC
  TRAP t
    pM.trans.z:=pM.trans.z+5;
    IF pM.trans.z>60 pM.trans.z:=20;
  ENDTRAP
ENDMODULE
