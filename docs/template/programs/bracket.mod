MODULE Bracket
    ! One straight fillet on a bracket: replace it by your own programs.
    PERS tooldata tGun:=[TRUE,[[-58.2,-0.4,361.9],[0.965926,0,0.258819,0]],[4.9,[-18,0,122],[1,0,0,0],0.031,0.034,0.008]];
    PERS wobjdata wBracket:=[FALSE,TRUE,"",[[1190,40,560],[0.999807,0.006172,-0.003378,0.018346]],[[35,-20,12],[1,0,0,0]]];
    PERS seamdata smFillet:=[0.5,0.3,[0,0,23,7,0,0,0,0,0],0.2,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0.5,[0,0,21,5.8,0,0,0,0,0],0.05,0,[0,0,0,0,0,0,0,0,0],0.8];
    PERS welddata wdFillet:=[9,0,[0,0,25,8.4,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];

    CONST robtarget pPre:=[[-90,-340,120],[0.009357,-0.906237,-0.107085,-0.408876],[-1,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pStart:=[[0,-310,0],[0.009357,-0.906237,-0.107085,-0.408876],[-1,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget pEnd:=[[0,0,0],[0.009357,-0.906237,-0.107085,-0.408876],[0,0,-3,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

    PROC rBracket()
        MoveJ pPre,v600,fine,tGun\WObj:=wBracket;
        ArcLStart pStart,v150,smFillet,wdFillet,fine,tGun\WObj:=wBracket;
        ArcLEnd pEnd,v150,smFillet,wdFillet,fine,tGun\WObj:=wBracket;
    ENDPROC
ENDMODULE
