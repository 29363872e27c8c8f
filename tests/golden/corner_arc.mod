MODULE CornerArc
    ! postproc 0.1.0: compensated for irb4600_60_205
    ! The tolerance of 0.1 mm is kept in the model; on the arm 0.12 to 2.47 mm are expected while the arc burns.
    ! the stiffness of this arm is not measured: with that of its type 5 to 92 % of its own deflection remain
    ! six set-ups of a dial gauge leave about 1 to 9 % of it: `postproc plan irb4600_60_205 -n 6 --kind gauge --load 60 --pull 100 -o gauge.csv`
    ! model: joint_compliance
    ! on the TCP: force 200, -200, -200 N, along the whole program
    ! deviation [mm]  before  after, in the model  tolerance  expected on the arm
    ! weld              2.22                 0.02       0.10  0.12 to 2.47
    ! air               2.31                 0.02       0.20  0.13 to 2.58
    ! 0 targets added; these lines prevent compensating twice
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
        ArcL pArcIn,v150,smFillet,wdFillet,z0,tGun\WObj:=wBracket;
        ArcC pArcMid,pArcOut,v150,smFillet,wdFillet,z0,tGun\WObj:=wBracket;
        ArcLEnd pEnd,v150,smFillet,wdFillet,fine,tGun\WObj:=wBracket;
        MoveL pOut,v400,z10,tGun\WObj:=wBracket;
        ! swing back over the bracket, clear of the clamp
        MoveC [[119.87,61.738,260.528],[0.0578346,0.800137,-0.438725,0.4049152],[0,-1,-2,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],
              [[-59.883,-118.87,240.333],[0.0095859,-0.906151,-0.1074311,-0.4089706],[-1,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],v400,fine,tGun\WObj:=wBracket;
        MoveJ pPre,v600,fine,tGun\WObj:=wBracket;
    ENDPROC
ENDMODULE
