MODULE CornerArc
    ! postproc 0.1.0: compensated for irb4600_60_205
    ! model: joint_compliance
    ! on the TCP: force 200, -200, -200 N, along the whole program
    ! deviation while the arc burns: 2.216 mm before, 0.006 mm after
    ! with moves in the air: 2.382 mm before, 0.025 mm after
    ! 2 targets added; these lines prevent compensating twice
    ! Fillet round the corner of a bracket, one pass.
    PERS tooldata tGun:=[TRUE,[[-58.2,-0.4,361.9],[0.965926,0,0.258819,0]],[4.9,[-18,0,122],[1,0,0,0],0.031,0.034,0.008]];
    PERS wobjdata wBracket:=[FALSE,TRUE,"",[[1190,40,560],[0.999807,0.006172,-0.003378,0.018346]],[[35,-20,12],[1,0,0,0]]];
    PERS seamdata smFillet:=[0.5,0.3,[0,0,23,7,0,0,0,0,0],0.2,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.5,[0,0,21,5.8,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.8];
    PERS welddata wdFillet:=[9,0,[0,0,25,8.4,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];

    CONST robtarget pPre:=[[-89.741,-339.145,120.329],[0.009516,-0.9061666,-0.1073616,-0.4089561],[-1,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pStart:=[[0.296,-308.966,0.375],[0.0095291,-0.9061553,-0.107405,-0.4089693],[-1,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pArcIn:=[[0.079,1.352,0.352],[0.0096057,-0.9061398,-0.1074843,-0.4089811],[0,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pArcMid:=[[17.624,43.856,0.368],[0.0579031,0.8001005,-0.4387738,0.4049245],[0,-1,-2,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pArcOut:=[[60.055,61.535,0.395],[0.1918159,0.5377274,-0.737304,0.3611631],[0,-1,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pEnd:=[[300.031,62.133,0.609],[0.1917324,0.5377858,-0.73726,0.3612103],[0,-1,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pOut:=[[319.859,142.293,110.639],[0.1917013,0.5378225,-0.737246,0.3612007],[0,-1,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

    PROC rCorner()
        MoveJ pPre,v600,z20,tGun\WObj:=wBracket;
        ArcLStart pStart,v150,smFillet,wdFillet,fine,tGun\WObj:=wBracket;
        ArcL ppLineKeep(pStart,pArcIn,0.5,0.018,-0.002,-0.009),v150,smFillet,wdFillet,z0,tGun\WObj:=wBracket;
        ArcL pArcIn,v150,smFillet,wdFillet,z0,tGun\WObj:=wBracket;
        ArcC pArcMid,pArcOut,v150,smFillet,wdFillet,z0,tGun\WObj:=wBracket;
        ArcL ppLinePoint(pArcOut,pEnd,0.5,0.001,-0.013,-0.007),v150,smFillet,wdFillet,z1,tGun\WObj:=wBracket;
        ArcLEnd pEnd,v150,smFillet,wdFillet,fine,tGun\WObj:=wBracket;
        MoveL pOut,v400,z10,tGun\WObj:=wBracket;
        ! swing back over the bracket, clear of the clamp
        MoveC [[119.87,61.738,260.528],[0.0578346,0.800137,-0.438725,0.4049152],[0,-1,-2,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],
              [[-59.883,-118.87,240.333],[0.0095859,-0.906151,-0.1074311,-0.4089706],[-1,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],v400,fine,tGun\WObj:=wBracket;
        MoveJ pPre,v600,fine,tGun\WObj:=wBracket;
    ENDPROC

  ! postproc: the target after a share of the line from s to g, displaced by x, y, z
  ! in the configuration of s
  LOCAL FUNC robtarget ppLineKeep(robtarget s,robtarget g,num share,num x,num y,num z)
    VAR robtarget p;
    VAR confdata c;
    VAR num a;
    VAR num b;
    VAR num d;
    VAR num w;
    c:=s.robconf;
    a:=1-share;
    b:=share;
    d:=s.rot.q1*g.rot.q1+s.rot.q2*g.rot.q2+s.rot.q3*g.rot.q3+s.rot.q4*g.rot.q4;
    IF d<0 THEN
      d:=-d;
      b:=-share;
    ENDIF
    IF d<0.99999 THEN
      w:=ATan2(Sqrt(1-d*d),d);
      a:=Sin(a*w)/Sin(w);
      b:=Sin(b*w)/Sin(w);
    ENDIF
    p:=[[s.trans.x+share*(g.trans.x-s.trans.x)+x,
      s.trans.y+share*(g.trans.y-s.trans.y)+y,
      s.trans.z+share*(g.trans.z-s.trans.z)+z],
      [a*s.rot.q1+b*g.rot.q1,a*s.rot.q2+b*g.rot.q2,
      a*s.rot.q3+b*g.rot.q3,a*s.rot.q4+b*g.rot.q4],
      c,g.extax];
    RETURN p;
  ENDFUNC

  ! postproc: the target after a share of the line from s to g, displaced by x, y, z
  LOCAL FUNC robtarget ppLinePoint(robtarget s,robtarget g,num share,num x,num y,num z)
    VAR robtarget p;
    VAR confdata c;
    VAR num a;
    VAR num b;
    VAR num d;
    VAR num w;
    c:=g.robconf;
    IF share<0.5 THEN
      c:=s.robconf;
    ENDIF
    a:=1-share;
    b:=share;
    d:=s.rot.q1*g.rot.q1+s.rot.q2*g.rot.q2+s.rot.q3*g.rot.q3+s.rot.q4*g.rot.q4;
    IF d<0 THEN
      d:=-d;
      b:=-share;
    ENDIF
    IF d<0.99999 THEN
      w:=ATan2(Sqrt(1-d*d),d);
      a:=Sin(a*w)/Sin(w);
      b:=Sin(b*w)/Sin(w);
    ENDIF
    p:=[[s.trans.x+share*(g.trans.x-s.trans.x)+x,
      s.trans.y+share*(g.trans.y-s.trans.y)+y,
      s.trans.z+share*(g.trans.z-s.trans.z)+z],
      [a*s.rot.q1+b*g.rot.q1,a*s.rot.q2+b*g.rot.q2,
      a*s.rot.q3+b*g.rot.q3,a*s.rot.q4+b*g.rot.q4],
      c,g.extax];
    RETURN p;
  ENDFUNC
ENDMODULE
