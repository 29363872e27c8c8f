MODULE CornerArc
    ! Fillet round the corner of a bracket, one pass.
    PERS tooldata tGun:=[TRUE,[[-58.2,-0.4,361.9],[0.965926,0,0.258819,0]],[4.9,[-18,0,122],[1,0,0,0],0.031,0.034,0.008]];
    PERS wobjdata wBracket:=[FALSE,TRUE,"",[[1190,40,560],[0.999807,0.006172,-0.003378,0.018346]],[[35,-20,12],[1,0,0,0]]];
    PERS seamdata smFillet:=[0.5,0.3,[0,0,23,7,0,0,0,0,0],0.2,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.5,[0,0,21,5.8,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.8];
    PERS welddata wdFillet:=[9,0,[0,0,25,8.4,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];

    CONST robtarget pPre:=[[-90,-340,120],[0.009357,-0.906237,-0.107085,-0.408876],[-1,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pStart:=[[0,-310,0],[0.009357,-0.906237,-0.107085,-0.408876],[-1,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pArcIn:=[[0,0,0],[0.009357,-0.906237,-0.107085,-0.408876],[0,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pArcMid:=[[17.57,42.43,0],[0.058222,0.79993,-0.43914,0.404818],[0,-1,-2,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pArcOut:=[[60,60,0],[0.192175,0.537369,-0.737541,0.361021],[0,-1,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pEnd:=[[300,60,0],[0.192175,0.537369,-0.737541,0.361021],[0,-1,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pOut:=[[320,140,110],[0.192175,0.537369,-0.737541,0.361021],[0,-1,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

    PROC rCorner()
        MoveJ pPre,v600,z20,tGun\WObj:=wBracket;
        ArcLStart pStart,v150,smFillet,wdFillet,fine,tGun\WObj:=wBracket;
        ArcL pArcIn,v150,smFillet,wdFillet,z0,tGun\WObj:=wBracket;
        ArcC pArcMid,pArcOut,v150,smFillet,wdFillet,z0,tGun\WObj:=wBracket;
        ArcLEnd pEnd,v150,smFillet,wdFillet,fine,tGun\WObj:=wBracket;
        MoveL pOut,v400,z10,tGun\WObj:=wBracket;
        ! swing back over the bracket, clear of the clamp
        MoveC [[120,60,260],[0.058222,0.79993,-0.43914,0.404818],[0,-1,-2,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],
              [[-60,-120,240],[0.009357,-0.906237,-0.107085,-0.408876],[-1,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],v400,fine,tGun\WObj:=wBracket;
        MoveJ pPre,v600,fine,tGun\WObj:=wBracket;
    ENDPROC
ENDMODULE
